//! `Identification`: the result of `identify`.

use crate::answers::{Answer, ResultData, given, result};
use crate::arrays::{array, rows};
use crate::errors::{Raise as _, codes, warnings};
use crate::figure::Svg;
use motorfit::identify::{IdentifySpec, ParameterEstimate};
use motorfit::record::{Record, Severity};
use motorfit::report::figures;
use motorfit::report::{identify_document, json};
use motorfit::text::significant;
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// Result in the process that computed it, with its JSON document.
struct Found {
    records: Vec<Record>,
    spec: IdentifySpec,
    found: motorfit::identify::Identification,
    text: String,
}

result! {
    /// Result of an identification, in SI units: R in ohm, L in H, K in V·s/rad, B in N·m·s/rad, J in kg·m². It can be pickled.
    Identification of Found;
    properties {
        /// Value of each parameter, by symbol; nan if it is not identifiable.
        parameters = |of, py| of.by_name(py, |e| e.value.unwrap_or(f64::NAN));
        /// Standard error of each parameter; nan if it is fixed, at a bound or not identifiable, and with `polish="none"`.
        std_errors = |of, py| of.by_name(py, |e| e.std_error.unwrap_or(f64::NAN));
        /// 95 % confidence interval (low, high) of each parameter; (nan, nan) where there is no standard error.
        ci95 = |of, py| of.by_name(py, |e| e.ci95.map_or((f64::NAN, f64::NAN), |[low, high]| (low, high)));
        /// Names of the free parameters, in the order of the rows of `covariance` and `correlation`.
        free = |of, py| given(py, of.free());
        /// Correlation matrix of the estimates of the free parameters, shape (p, p), nan where undefined; `None` with
        /// `polish="none"`.
        correlation = |of, py| of.table(py, |_, _| 1.0);
        /// Covariance matrix of the estimates of the free parameters, shape (p, p), in SI units, nan where undefined; `None`
        /// with `polish="none"`.
        covariance = |of, py| of.table(py, |a, b| a * b);
        /// Lowest cost after each generation, shape (generations,); empty without a population search.
        history = |of, py| given(py, array(py, of.found.history.clone()));
        /// Cost of the parameters in the chosen criterion.
        cost = |of, py| given(py, of.found.cost);
        /// Fit 100 (1 − ‖y − ŷ‖/‖y − mean y‖) of "current" and "speed" [%]; nan for a channel that was not measured.
        fit_percent = Found::fit_percent;
        /// Level of trust in the result: "good", "check" or "poor".
        trust = |of, py| given(py, of.found.trust.level.name());
        /// Warnings, which the call issued as Python warnings too: a list of `MotorfitWarning`.
        warnings = |of, py| given(py, warnings(py, &of.found.warnings, Severity::Report)?);
        /// Remarks, which need no action: a list of `MotorfitWarning`.
        remarks = |of, py| given(py, warnings(py, &of.found.warnings, Severity::Mention)?);
        /// Recordings that the model was fitted to.
        records = |of, py| given(py, of.records.iter().cloned().map(crate::record::Record).collect::<Vec<_>>());
    }
    methods {
        /// Returns the simulated signals of each recording: a list of mappings with the keys "current_A" [A] and "speed_rad_s"
        /// [rad/s], arrays of shape (samples,).
        modelled = Found::modelled;
        /// Returns the document of `to_dict` as JSON text.
        to_json = |of, py| given(py, of.text.as_str());
        /// Draws the correlation matrix of the estimates; `None` with `polish="none"`.
        plot_correlation = |of, py| given(py, figures::correlations(&of.found).map(Svg::from));
        /// Draws the lowest cost after each generation; `None` without a population search.
        plot_history = |of, py| given(py, figures::history(&of.found, &of.spec).map(Svg::from));
        __repr__ = |of, py| given(py, of.repr());
        /// Returns an HTML table of the parameters for notebooks.
        _repr_html_ = |of, py| given(py, of.html());
    }
    own {
        /// Returns the complete result, as `motorfit identify --json` prints it.
        fn to_dict<'py>(&self, py: Python<'py>) -> Answer<'py> {
            py.import("json")?.call_method1("loads", (self.answer(py, "to_json")?,))
        }

        /// Draws the measured and the simulated signals of one recording.
        ///
        /// Parameters
        /// ----------
        /// recording : int, default 0
        ///     Index of the recording; negative values count from the end.
        ///
        /// Returns
        /// -------
        /// Svg
        ///
        /// Raises
        /// ------
        /// IndexError
        ///     If there is no such recording.
        #[pyo3(signature = (recording=0))]
        fn plot_response(&self, py: Python<'_>, recording: isize) -> PyResult<Svg> {
            let (records, modelled) = (self.answer(py, "records")?, self.answer(py, "modelled")?);
            let count = records.len()?;
            let at = if recording < 0 { count.checked_add_signed(recording) } else { Some(recording.cast_unsigned()) };
            let Some(at) = at.filter(|at| *at < count) else {
                return Err(PyIndexError::new_err(format!("there are {count} recordings, numbered from 0")));
            };
            let signals = modelled.get_item(at)?;
            let signal = |of: &str| crate::arrays::signal(&signals.get_item(of)?, of);
            let signals = [signal("current_A")?, signal("speed_rad_s")?];
            let record = records.get_item(at)?.cast_into::<crate::record::Record>().map_err(PyErr::from)?;
            Ok(figures::responses("response", &record.get().0, "model", &signals).into())
        }
    }
}

impl Identification {
    /// Wraps the result of an identification of `records` by `spec`.
    pub fn new(records: Vec<Record>, spec: IdentifySpec, found: motorfit::identify::Identification) -> Self {
        let text = json(&identify_document(&records, &spec, &found));
        Self(ResultData::Native(Found { records, spec, found, text }))
    }
}

impl Found {
    fn by_name<'py, T: IntoPyObject<'py>>(&self, py: Python<'py>, of: impl Fn(&ParameterEstimate) -> T) -> Answer<'py> {
        let values = PyDict::new(py);
        for estimated in self.found.estimates() {
            values.set_item(name_of(&estimated), of(&estimated))?;
        }
        Ok(values.into_any())
    }

    fn free(&self) -> Vec<String> {
        self.found.space.free().iter().map(|axis| axis.scope.name(axis.parameter)).collect()
    }

    /// Returns the correlation matrix, each element multiplied by `by` of the two standard errors.
    fn table<'py>(&self, py: Python<'py>, by: impl Fn(f64, f64) -> f64) -> Answer<'py> {
        let Some(of) = &self.found.uncertainty else { return given(py, py.None()) };
        let error = |n: usize| of.std_error.get(n).copied().flatten().unwrap_or(f64::NAN);
        let mut values = Vec::new();
        for (a, row) in of.correlation.iter().enumerate() {
            values.extend(row.iter().enumerate().map(|(b, v)| v.unwrap_or(f64::NAN) * by(error(a), error(b))));
        }
        given(py, rows(py, values, of.correlation.len())?)
    }

    fn fit_percent<'py>(&self, py: Python<'py>) -> Answer<'py> {
        let fit = PyDict::new(py);
        for (channel, percent) in ["current", "speed"].into_iter().zip(self.found.fit_percent) {
            fit.set_item(channel, percent.unwrap_or(f64::NAN))?;
        }
        Ok(fit.into_any())
    }

    fn modelled<'py>(&self, py: Python<'py>) -> Answer<'py> {
        let list = PyList::empty(py);
        for [current, speed] in self.found.modelled(&self.records).raise(py)? {
            let signals = PyDict::new(py);
            signals.set_item("current_A", array(py, current))?;
            signals.set_item("speed_rad_s", array(py, speed))?;
            list.append(signals)?;
        }
        Ok(list.into_any())
    }

    fn repr(&self) -> String {
        let one = |e: ParameterEstimate| {
            let Some(value) = e.value else { return format!("{} not identified", name_of(&e)) };
            let error = e.std_error.map_or(String::new(), |s| format!(" ± {}", significant(s, 2)));
            format!("{} = {}{error} {}", name_of(&e), significant(value, 6), e.parameter.unit())
        };
        let list: Vec<String> = self.found.estimates().into_iter().map(one).collect();
        let (trust, codes) = (self.found.trust.level.name(), codes(&self.found.warnings));
        format!("<Identification {}; trust {trust}{codes}>", list.join(", "))
    }

    fn html(&self) -> String {
        let row = |e: ParameterEstimate| {
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
}

fn name_of(estimated: &ParameterEstimate) -> String {
    estimated.scope.name(estimated.parameter)
}
