//! The Python methods of `Model`. They have a file of their own because their results refer to `Model`.

use crate::arrays::{array, signal};
use crate::compare::compare_model;
use crate::comparison::Comparison;
use crate::errors::{Raise as _, warn};
use crate::model::Model;
use crate::model_identification::ModelIdentification;
use crate::pool::on_all;
use crate::progress::watched;
use crate::reading::records_of;
use crate::record::Record;
use crate::spec::{Keywords, keywords};
use motorfit::Error;
use motorfit::device::with_threads;
use motorfit::evaluate::model::{ModelProblem, ModelSettings, ModelSpace};
use motorfit::identify::model::{ModelProgress, hold_out_model, identify_model};
use motorfit::model::{BuiltIn, ShaderPrecision};
use motorfit::named::Named as _;
use motorfit::optimize::Progress;
use motorfit::setting::Setting;
use motorfit::settings::{self, DEVICE, PROBLEM, SEARCH, Value};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use std::path::PathBuf;

#[pymethods]
impl Model {
    #[new]
    fn new(source: &Bound<'_, PyAny>) -> PyResult<Self> {
        let py = source.py();
        if let Ok(text) = source.cast::<PyString>()
            && text.to_str()?.contains('\n')
        {
            return motorfit::model::Model::parse(text.to_str()?).map(Self).raise(py);
        }
        if source.is_instance_of::<PyString>() || source.hasattr("__fspath__")? {
            let path: PathBuf = source.extract()?;
            return motorfit::model::Model::open(&path).map(Self).raise(py);
        }
        if source.hasattr("items")? {
            let text: String = py.import("motorfit._model")?.call_method1("to_toml", (source,))?.extract()?;
            return motorfit::model::Model::parse(&text).map(Self).raise(py);
        }
        Err(PyTypeError::new_err("give the text, the path or the name of a model, or a mapping"))
    }

    /// Names of the built-in models.
    #[staticmethod]
    fn built_in() -> Vec<&'static str> {
        BuiltIn::ALL.iter().map(|of| of.name()).collect()
    }

    /// Name of the model.
    #[getter]
    fn name(&self) -> &str {
        self.0.name()
    }

    /// Text of the model, in TOML.
    #[getter]
    fn text(&self) -> &str {
        self.0.text()
    }

    /// Names of the parameters, in the order of their definition.
    #[getter]
    fn parameters(&self) -> Vec<String> {
        self.0.parameters().iter().map(|of| of.name.clone()).collect()
    }

    /// Bounds (min, max) of each parameter, in its unit.
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let bounds = PyDict::new(py);
        for of in self.0.parameters() {
            bounds.set_item(&of.name, (of.min, of.max))?;
        }
        Ok(bounds)
    }

    /// Unit of each input, state, output and parameter, as written in the model.
    #[getter]
    fn units<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let units = PyDict::new(py);
        let inputs = self.0.inputs().iter().map(|of| (&of.name, &of.unit));
        let states = self.0.states().iter().map(|of| (&of.name, &of.unit));
        let outputs = self.0.outputs().iter().map(|of| (&of.name, &of.unit));
        let parameters = self.0.parameters().iter().map(|of| (&of.name, &of.unit));
        for (name, unit) in inputs.chain(states).chain(outputs).chain(parameters) {
            units.set_item(name, &unit.text)?;
        }
        Ok(units)
    }

    /// Names of the inputs.
    #[getter]
    fn inputs(&self) -> Vec<String> {
        self.0.inputs().iter().map(|of| of.name.clone()).collect()
    }

    /// Names of the states.
    #[getter]
    fn states(&self) -> Vec<String> {
        self.0.states().iter().map(|of| of.name.clone()).collect()
    }

    /// Names of the outputs.
    #[getter]
    fn outputs(&self) -> Vec<String> {
        self.0.outputs().iter().map(|of| of.name.clone()).collect()
    }

    #[doc = concat!("read($self, source, *, ", include_str!("signatures/reading.txt"), ")\n--\n")]
    /// Reads recordings with the signals of the model.
    ///
    /// Parameters
    /// ----------
    /// source : str, PathLike, open file, mapping or frame
    ///     Recording file, or a table of columns.
    /// columns, rate, sheet, bad_rows, gaps, drop_repeats, crop, offset, mask, decimate, filter, discretization
    ///     As for `motorfit.read`; columns names signals of the model, as "vq=uq:V,w=speed:rpm".
    ///
    /// Returns
    /// -------
    /// list of Record
    ///
    /// Raises
    /// ------
    /// UsageError, DataError
    ///     If an option is wrong, or the source cannot be read.
    #[pyo3(signature = (source, **options), text_signature = None)]
    fn read(
        &self,
        py: Python<'_>,
        source: &Bound<'_, PyAny>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Vec<Record>> {
        let reading = self.reading(py, options)?;
        let Some(records) = records_of(source, &reading)? else {
            return Err(PyTypeError::new_err("give a path, an open file or a table of columns"));
        };
        Ok(records.into_iter().map(Record).collect())
    }

    /// Simulates the machine.
    ///
    /// Parameters
    /// ----------
    /// parameters : mapping
    ///     Value of each parameter in its unit; those that the model gives a value may be left out.
    /// inputs : mapping
    ///     Values of each input in its unit, arrays of shape (n,); those with a default may be left out.
    /// time : array_like, shape (n,)
    ///     Times of the samples [s]; inputs are constant between them.
    /// initial : mapping, optional
    ///     Initial values of states that are measured or free, in their units, by default 0.
    ///
    /// Returns
    /// -------
    /// dict
    ///     Outputs, arrays of shape (n,).
    ///
    /// Raises
    /// ------
    /// UsageError, DataError, NotIdentifiedError
    ///     If a name or a length is wrong, or the machine grows without limit.
    #[pyo3(signature = (parameters, inputs, *, time, initial=None))]
    fn simulate<'py>(
        &self,
        parameters: &Bound<'py, PyAny>,
        inputs: &Bound<'py, PyAny>,
        time: &Bound<'py, PyAny>,
        initial: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let py = parameters.py();
        let time_s = signal(time, "time")?;
        let values = self.values(parameters)?;
        let recording = self.recording(time_s, inputs)?;
        let open = self.open(initial)?;
        let model = self.0.clone();
        let outputs = on_all(py, move || {
            let space = ModelSpace::all_fixed(&values);
            let problem = ModelProblem::new(&model, space, vec![recording], ModelSettings::default())?;
            Ok(problem.simulate(&[], 0, &open).outputs)
        })?
        .raise(py)?;
        if outputs.iter().flatten().any(|value| !value.is_finite()) {
            let error = Error::not_identified(
                "the simulated machine grows without limit",
                "Check the parameters and their units.",
            );
            return Err(error).raise(py);
        }
        let found = PyDict::new(py);
        for (output, values) in self.0.outputs().iter().zip(outputs) {
            found.set_item(&output.name, array(py, values))?;
        }
        Ok(found)
    }

    #[doc = concat!(
        "identify($self, records, *, validate=None, progress=None, start=None, ", include_str!("signatures/search.txt"), ", ",
        include_str!("signatures/problem.txt"), ")\n--\n"
    )]
    /// Identifies the parameters of the machine from a recording, or from several recordings by a joint fit.
    ///
    /// Parameters
    /// ----------
    /// records : Record or sequence of Record
    ///     Recordings that `read` returned, or paths and frames, which are read.
    /// validate : Record or sequence of Record, optional
    ///     Held-out recordings, simulated with the estimated parameters without another fit.
    /// progress : callable, optional
    ///     Called with a `Progress` after each generation, or each round of starts, in the calling thread. The search ends when it
    ///     returns False.
    /// start : str, mapping or sequence of these, optional
    ///     Values of parameters in their units from which one more descent begins, such as those found for a model that this one
    ///     contains. Other parameters begin at their usual value, or in the middle of their bounds. Each mapping of a sequence is a
    ///     start; a string that gives a name again begins another start, others add to the last one.
    #[doc = include_str!("docs/identify.txt")]
    #[doc = include_str!("docs/problem.txt")]
    ///
    /// Returns
    /// -------
    /// ModelIdentification
    ///     Estimates, standard errors and diagnostics, in the units of the parameters.
    ///
    /// Raises
    /// ------
    /// UsageError, DataError, NotIdentifiedError, DeviceError
    ///     If a setting is wrong, a recording cannot be used, the machine grows without limit, or the device is not available.
    ///
    /// Warns
    /// -----
    /// MotorfitWarning
    ///     For each entry of `warnings` of the result.
    #[pyo3(signature = (records, *, validate=None, progress=None, **settings), text_signature = None)]
    fn identify(
        &self,
        records: &Bound<'_, PyAny>,
        validate: Option<&Bound<'_, PyAny>>,
        progress: Option<Py<PyAny>>,
        settings: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<ModelIdentification> {
        let py = records.py();
        let keys = Keywords::new(py, settings, &keywords(&[&SEARCH, &PROBLEM, &DEVICE, &[Setting::Start]]))?;
        let mut given = keys.given(&[&SEARCH, &PROBLEM, &DEVICE])?;
        let mut spec = settings::model_spec(&given).map_err(Error::from).raise(py)?;
        for start in keys.groups("start")? {
            given.put(Setting::Start, Value::List(start));
            spec.starts.extend(settings::model_spec(&given).map_err(Error::from).raise(py)?.starts);
        }
        let threads = given.count(Setting::Threads);
        let (records, recordings) = self.recordings(records)?;
        let held_out = validate.map(|of| self.recordings(of)).transpose()?.map_or_else(Vec::new, |(_, of)| of);
        let model = self.0.clone();
        let (spec, found) = watched(py, progress, move |watch| {
            let mut look = |of: ModelProgress| {
                let (generation, generations) = (of.done, of.of);
                watch.generation(&Progress { generation, generations, evaluations: 0, cost: f64::NAN })
            };
            let found = with_threads(threads, || {
                let mut found = identify_model(&model, &recordings, &spec, &mut look)?;
                // With the generic terms of the result.
                let own = found.model.clone();
                hold_out_model(&own, &mut found, &recordings, &held_out, &spec)?;
                Ok(found)
            });
            (spec, found)
        })?;
        let found = found.raise(py)?;
        warn(py, &found.warnings)?;
        let model = found.model.clone();
        Ok(ModelIdentification::new(records, model, &spec, found))
    }

    /// Compares searches on recordings of the machine under equal budgets.
    ///
    /// Parameters
    /// ----------
    /// records : Record or sequence of Record
    ///     Recordings that `read` returned, or paths and frames, which are read.
    /// progress : callable, optional
    ///     Called with a `Progress` after each generation, in the calling thread. The comparison ends when it returns False.
    /// methods : str or sequence, default "gwo,jaya,ga"
    ///     Searches among gwo, jaya, ga, pso, de, lshade, cmaes, abc, cuckoo, random.
    /// bounds : str, sequence or mapping
    ///     Bounds that replace those of the model, in the units of the parameters.
    /// fix : str, sequence or mapping
    ///     Fixed parameters in their units.
    /// discretization : {"zoh", "foh"}, default "zoh"
    ///     Inputs between samples: held, or linear.
    /// runs, criteria, population, generations, set, transform, seed, target
    ///     As for `motorfit.compare`.
    /// device, precision, threads
    ///     As for `identify`.
    ///
    /// Returns
    /// -------
    /// Comparison
    ///     One block for each setting, with the parameters of the model in their units.
    ///
    /// Raises
    /// ------
    /// UsageError, DataError, DeviceError
    ///     If a setting is wrong or does not suit a model, or a recording cannot be used.
    ///
    /// Warns
    /// -----
    /// MotorfitWarning
    ///     For each entry of `warnings` of the result.
    #[pyo3(signature = (records, *, progress=None, **settings))]
    #[pyo3(
        text_signature = "($self, records, *, progress=None, methods='gwo,jaya,ga', runs=50, criteria='nrmse:std', population=100, \
        generations=100, set=None, transform=None, seed=1, target=None, bounds=None, fix=None, discretization=None, device='auto', \
        precision='auto', threads=None)"
    )]
    fn compare(
        &self,
        records: &Bound<'_, PyAny>,
        progress: Option<Py<PyAny>>,
        settings: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Comparison> {
        compare_model(self, records, progress, settings)
    }

    /// Returns the WGSL compute shader of the model.
    ///
    /// Parameters
    /// ----------
    /// precision : {"f64", "f32"}, default "f64"
    ///     Floating-point type of the shader.
    #[pyo3(signature = (precision="f64"))]
    fn wgsl(&self, py: Python<'_>, precision: &str) -> PyResult<String> {
        let precision = ShaderPrecision::named("precision", precision).raise(py)?;
        self.0.wgsl(precision).raise(py)
    }

    fn __repr__(&self) -> String {
        format!("<Model {}: {}>", self.0.name(), self.parameters().join(", "))
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0.text() == other.0.text()
    }

    fn __hash__(&self) -> u64 {
        use std::hash::{DefaultHasher, Hash as _, Hasher as _};
        let mut hasher = DefaultHasher::new();
        self.0.text().hash(&mut hasher);
        hasher.finish()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        Ok((slf.as_any().get_type().into_any(), (slf.get().0.text().to_owned(),)))
    }
}
