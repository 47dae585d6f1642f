//! The main job and its result.

use crate::arrays::{array, rows};
use crate::errors::Raise as _;
use crate::figure::Svg;
use crate::progress::watched;
use crate::record::several;
use crate::spec::{self, Keywords};
use motorfit::identify::{Estimated, IdentifySpec, identify_with, repeatability, validate};
use motorfit::motor::Scope;
use motorfit::record::Record;
use motorfit::report::figures::{self, Modelled};
use motorfit::report::{IdentifyDocument, json};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// What was found. Values in SI units: R in ohm, L in H, K in V·s/rad, B in N·m·s/rad, J in kg·m².
#[pyclass(frozen, module = "motorfit")]
pub struct Identification {
    records: Vec<Record>,
    spec: IdentifySpec,
    found: motorfit::identify::Identification,
    text: String,
}

fn name_of(estimated: &Estimated) -> String {
    name(estimated.parameter, estimated.scope)
}

/// The name of a parameter: its symbol, with the number of the recording where it belongs to one.
pub fn name(parameter: motorfit::motor::Parameter, scope: Scope) -> String {
    match scope {
        Scope::Shared => parameter.symbol().to_owned(),
        Scope::Recording(n) => format!("{}[{n}]", parameter.symbol()),
    }
}

impl Identification {
    fn by_name<'py, T: IntoPyObject<'py>>(
        &self,
        py: Python<'py>,
        of: impl Fn(&Estimated) -> T,
    ) -> PyResult<Bound<'py, PyDict>> {
        let values = PyDict::new(py);
        for estimated in self.found.estimates() {
            values.set_item(name_of(&estimated), of(&estimated))?;
        }
        Ok(values)
    }
}

#[pymethods]
impl Identification {
    /// Value of each parameter, by its symbol; `None` where the recordings do not tell it.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.by_name(py, |e| e.value)
    }

    /// Standard error of each parameter; `None` where there is none: held, at a bound, without a polish.
    #[getter]
    fn std_errors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.by_name(py, |e| e.std_error)
    }

    /// 95 % interval of each parameter.
    #[getter]
    fn ci95<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.by_name(py, |e| e.ci95.map(|[low, high]| (low, high)))
    }

    /// The names of the free parameters: the order of `covariance` and `correlation`.
    #[getter]
    fn free(&self) -> Vec<String> {
        self.found.space.free().iter().map(|axis| name(axis.parameter, axis.scope)).collect()
    }

    /// Correlations of the free parameters, shape (p, p); nan where there are none. `None` without a polish.
    #[getter]
    fn correlation<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let Some(of) = &self.found.uncertainty else { return Ok(None) };
        let values: Vec<f64> = of.correlation.iter().flatten().map(|v| v.unwrap_or(f64::NAN)).collect();
        rows(py, values, of.correlation.len()).map(Some)
    }

    /// Covariance of the free parameters, shape (p, p), in their units; nan where there is none. `None` without a polish.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let Some(of) = &self.found.uncertainty else { return Ok(None) };
        let error = |n: usize| of.std_error.get(n).copied().flatten().unwrap_or(f64::NAN);
        let mut values = Vec::new();
        for (a, row) in of.correlation.iter().enumerate() {
            values.extend(row.iter().enumerate().map(|(b, v)| v.unwrap_or(f64::NAN) * error(a) * error(b)));
        }
        rows(py, values, of.correlation.len()).map(Some)
    }

    /// Lowest cost after each generation, shape (generations,); empty without a population.
    #[getter]
    fn history<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array(py, self.found.history.clone())
    }

    /// The cost of the parameters in the chosen criterion.
    #[getter]
    fn cost(&self) -> f64 {
        self.found.cost
    }

    /// 100 (1 − ‖y − ŷ‖/‖y − mean y‖) of the current and of the speed.
    #[getter]
    fn fit_percent<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let fit = PyDict::new(py);
        fit.set_item("current", self.found.fit_percent[0])?;
        fit.set_item("speed", self.found.fit_percent[1])?;
        Ok(fit)
    }

    /// What the reader should know: texts.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.found.warnings.iter().map(motorfit::identify::Warning::text).collect()
    }

    /// The recordings that it was fitted to.
    #[getter]
    fn records(&self) -> Vec<crate::record::Record> {
        self.records.iter().cloned().map(crate::record::Record).collect()
    }

    /// Current ("current_A", A) and speed ("speed_rad_s", rad/s) of the model at the samples of each recording: a list of
    /// mappings of arrays of shape (samples,).
    fn modelled<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let list = PyList::empty(py);
        for [current, speed] in self.found.modelled(&self.records, &self.spec).raise(py)? {
            let signals = PyDict::new(py);
            signals.set_item("current_A", array(py, current))?;
            signals.set_item("speed_rad_s", array(py, speed))?;
            list.append(signals)?;
        }
        Ok(list)
    }

    /// All of it, as `motorfit identify --json` prints it.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("json")?.call_method1("loads", (&self.text,))
    }

    /// The same as text.
    fn to_json(&self) -> &str {
        &self.text
    }

    /// Measured signals against the model, of one recording.
    #[pyo3(signature = (recording=0))]
    fn plot_response(&self, py: Python<'_>, recording: isize) -> PyResult<Svg> {
        let mut all = self.found.modelled(&self.records, &self.spec).raise(py)?;
        let count = self.records.len();
        let recording =
            if recording < 0 { count.checked_add_signed(recording) } else { Some(recording.cast_unsigned()) };
        let Some((recording, record)) = recording.and_then(|n| Some((n, self.records.get(n)?))) else {
            let message = format!("there are {count} recordings, the first is 0");
            return Err(pyo3::exceptions::PyIndexError::new_err(message));
        };
        let models = [Modelled { name: "model".to_owned(), signals: all.swap_remove(recording) }];
        Ok(figures::responses("response", record, &models).into())
    }

    /// Correlations of the estimates; `None` without a polish.
    fn plot_correlation(&self) -> Option<Svg> {
        figures::correlations(&self.found).map(Svg::from)
    }

    /// Lowest cost after each generation; `None` without a population.
    fn plot_history(&self) -> Option<Svg> {
        figures::history(&self.found, &self.spec).map(Svg::from)
    }

    fn __repr__(&self) -> String {
        let one = |e: Estimated| {
            let Some(value) = e.value else { return format!("{} not identified", name_of(&e)) };
            let error = e.std_error.map_or(String::new(), |s| format!(" ± {}", motorfit::text::significant(s, 2)));
            format!("{} = {}{error} {}", name_of(&e), motorfit::text::significant(value, 6), e.parameter.unit())
        };
        let list: Vec<String> = self.found.estimates().into_iter().map(one).collect();
        format!("<Identification {}>", list.join(", "))
    }

    /// A table for notebooks.
    fn _repr_html_(&self) -> String {
        let significant = motorfit::text::significant;
        let row = |e: Estimated| {
            let value = e.value.map_or_else(|| "not identified".to_owned(), |value| significant(value, 6));
            let error = e.std_error.map_or(String::new(), |error| significant(error, 2));
            let interval = |[low, high]: [f64; 2]| format!("{} … {}", significant(low, 6), significant(high, 6));
            let interval = e.ci95.map_or(String::new(), interval);
            let (name, unit, what) = (name_of(&e), e.parameter.unit(), e.parameter.name());
            format!(
                "<tr><th>{name}</th><td>{value}</td><td>{error}</td><td>{interval}</td><td>{unit}</td><td>{what}</td></tr>"
            )
        };
        let rows: String = self.found.estimates().into_iter().map(row).collect();
        let heads =
            "<tr><th></th><th>value</th><th>standard error</th><th>95 % interval</th><th>unit</th><th></th></tr>";
        format!("<table><thead>{heads}</thead><tbody>{rows}</tbody></table>")
    }

    fn __reduce__(&self) -> PyResult<()> {
        let message =
            "an Identification does not leave its process; send what is needed of it: to_dict(), parameters, ...";
        Err(pyo3::exceptions::PyTypeError::new_err(message))
    }
}

/// Identifies one motor from a recording, or from several in one joint fit.
///
/// Parameters
/// ----------
/// records : Record or sequence of Record
/// validate : Record or sequence of Record
///     Recordings that are held out: simulated with what was found, without another fit.
/// progress : callable
///     Called with a `Progress` after each generation of a search, by the thread that calls this; its answer False ends the
///     search.
/// method : {"auto", "sm", "gwo", "jaya", "ga", "random"}
///     How the optimum is found; auto: Steiglitz-McBride, a population search where that cannot serve.
/// polish : {"lm", "none"}
///     How what was found is refined; lm gives the standard errors.
/// population, generations : int, default 100
///     Agents, and generations with the first population.
/// seed : int, default 1
/// set : str, sequence or mapping
///     Settings of the method, {"mutation": 0.1}.
#[doc = include_str!("docs/problem.txt")]
///
/// Returns
/// -------
/// Identification
///
/// Raises
/// ------
/// UsageError, DataError, NotIdentifiedError, DeviceError
///     What happened, with `remedy`.
#[pyfunction]
#[pyo3(signature = (records, *, validate=None, progress=None, **settings))]
pub fn identify(
    py: Python<'_>,
    records: &Bound<'_, PyAny>,
    validate: Option<&Bound<'_, PyAny>>,
    progress: Option<Py<PyAny>>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Identification> {
    let known: Vec<&str> = spec::PROBLEM.iter().chain(&spec::IDENTIFY).copied().collect();
    let keys = Keywords::new(py, settings, &known)?;
    let records = several(records)?;
    let held_out = validate.map(several).transpose()?.unwrap_or_default();
    let spec = spec::identify(&keys, spec::input_of(&records))?;
    let found = watched(py, progress, move |watch| {
        let found = run(&records, &held_out, &spec, watch);
        (records, spec, found)
    })?;
    let (records, spec, found) = found;
    let found = found.raise(py)?;
    let text = json(&IdentifyDocument::of(&records, &spec, &found));
    Ok(Identification { records, spec, found, text })
}

fn run(
    records: &[Record],
    held_out: &[Record],
    spec: &IdentifySpec,
    watch: &crate::progress::Watch,
) -> motorfit::Result<motorfit::identify::Identification> {
    let mut found = identify_with(records, spec, &mut |progress| watch.generation(progress))?;
    if !held_out.is_empty() {
        let all: Vec<&Record> = records.iter().chain(held_out).collect();
        found.repeatability = repeatability(&all, spec.model)?;
        found.validation = Some(validate(held_out, spec, &found)?);
    }
    Ok(found)
}
