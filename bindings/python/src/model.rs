//! `Model`: the equations of a machine. Its methods are in `model_methods`.

use crate::arrays::signal;
use crate::errors::Raise as _;
use crate::reading::several_with;
use crate::spec::{Keywords, keywords};
use motorfit::Error;
use motorfit::evaluate::model::ModelRecording;
use motorfit::model::{InitialState, ModelState};
use motorfit::record::{Reading, Record};
use motorfit::setting::Setting;
use motorfit::settings::{self, READING};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use std::path::PathBuf;

/// Differential equations of a machine, from a text in TOML (see the documentation of own models), immutable.
///
/// Parameters
/// ----------
/// source : str, PathLike or mapping
///     Text of a model (with line breaks), path of a file, name of a built-in model such as "pmsm", or nested mappings with the
///     sections of the text.
///
/// Raises
/// ------
/// DataError
///     If the model is wrong, with line and column.
///
/// Examples
/// --------
/// >>> machine = motorfit.Model("pmsm")
/// >>> machine.parameters
/// ['R', 'Ld', 'Lq', 'psi', 'B', 'J']
///
/// Notes
/// -----
/// Models can be pickled.
#[pyclass(frozen, module = "motorfit")]
#[derive(Clone)]
pub struct Model(pub motorfit::model::Model);

impl Model {
    /// Makes a model of an argument: a model, its text, path or name, or a mapping.
    pub fn of(source: &Bound<'_, PyAny>) -> PyResult<Self> {
        let py = source.py();
        if let Ok(model) = source.cast::<Self>() {
            return Ok(model.get().clone());
        }
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

    /// Reads the options of a recording file.
    pub fn reading(&self, py: Python<'_>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Reading> {
        let known: [&[Setting]; 2] = [&READING, &[Setting::Discretization]];
        let keys = Keywords::new(py, options, &keywords(&known))?;
        settings::model_reading(&keys.given(&known)?, &self.0).map_err(Error::from).raise(py)
    }

    /// Returns the recordings of an argument with the signals of the model.
    pub fn recordings(&self, given: &Bound<'_, PyAny>) -> PyResult<(Vec<Record>, Vec<ModelRecording>)> {
        let py = given.py();
        let records = several_with(given, &self.reading(py, None)?)?;
        let of = |record| ModelRecording::new(&self.0, record);
        let recordings = records.iter().map(of).collect::<motorfit::Result<Vec<_>>>().raise(py)?;
        Ok((records, recordings))
    }

    /// Returns the values of all parameters, in their order.
    pub fn values(&self, given: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
        let py = given.py();
        let mut values: Vec<Option<f64>> = self.0.parameters().iter().map(|of| of.value).collect();
        let names: Vec<String> = self.0.parameters().iter().map(|of| of.name.clone()).collect();
        for (name, value) in numbers(given, "parameters")? {
            let at = position(py, &names, &name, "parameters")?;
            values[at] = Some(value);
        }
        let missing: Vec<&str> =
            names.iter().zip(&values).filter(|(_, value)| value.is_none()).map(|(name, _)| name.as_str()).collect();
        if !missing.is_empty() {
            let message = format!("parameters lacks {}", missing.join(", "));
            return Err(Error::usage(message, "Give a value for each of them, in the units of the model.")).raise(py);
        }
        Ok(values.into_iter().flatten().collect())
    }

    /// Returns a recording with the given inputs and without measurements.
    pub fn recording(&self, time_s: Vec<f64>, given: &Bound<'_, PyAny>) -> PyResult<ModelRecording> {
        let py = given.py();
        let names: Vec<String> = self.0.inputs().iter().map(|of| of.name.clone()).collect();
        let mut inputs: Vec<Option<Vec<f64>>> =
            self.0.inputs().iter().map(|of| of.default.map(|value| vec![value; time_s.len()])).collect();
        for (name, values) in pairs(given, "inputs")? {
            let at = position(py, &names, &name, "inputs")?;
            inputs[at] = Some(signal(&values, &name)?);
        }
        let wrong = names.iter().zip(&inputs).find(|(_, input)| input.as_ref().map(Vec::len) != Some(time_s.len()));
        if let Some((name, input)) = wrong {
            let message = match input {
                None => format!("inputs lacks {name}"),
                Some(values) => format!("the input {name} has {} values for {} times", values.len(), time_s.len()),
            };
            return Err(Error::usage(message, "Give every input one value for each time.")).raise(py);
        }
        let inputs = inputs.into_iter().flatten().collect();
        ModelRecording::to_simulate(&self.0, time_s, inputs).raise(py)
    }

    /// Returns the initial values of the states that are measured or free, 0 where none is given.
    pub fn open(&self, given: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<f64>> {
        let is_open = |of: &&ModelState| !matches!(of.initial, InitialState::Given(_));
        let names: Vec<String> = self.0.states().iter().filter(is_open).map(|of| of.name.clone()).collect();
        let mut open = vec![0.0; names.len()];
        if let Some(given) = given {
            for (name, value) in numbers(given, "initial")? {
                let at = position(given.py(), &names, &name, "initial")?;
                open[at] = value;
            }
        }
        Ok(open)
    }
}

/// Returns the items of a mapping of names.
fn pairs<'py>(given: &Bound<'py, PyAny>, what: &str) -> PyResult<Vec<(String, Bound<'py, PyAny>)>> {
    if !given.hasattr("items")? {
        return Err(PyTypeError::new_err(format!("{what}: give a mapping of names to values")));
    }
    given.call_method0("items")?.try_iter()?.map(|pair| pair?.extract()).collect()
}

/// Returns the items of a mapping of names to numbers.
fn numbers(given: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec<(String, f64)>> {
    let number = |(name, value): (String, Bound<'_, PyAny>)| match value.extract::<f64>() {
        Ok(number) => Ok((name, number)),
        Err(_) => Err(PyTypeError::new_err(format!("{what}: {name} is no number"))),
    };
    pairs(given, what)?.into_iter().map(number).collect()
}

fn position(py: Python<'_>, names: &[String], name: &str, what: &str) -> PyResult<usize> {
    let at = names.iter().position(|own| own == name);
    at.ok_or_else(|| Error::usage(format!("{what}: there is no {name}"), format!("There are {}.", names.join(", "))))
        .raise(py)
}
