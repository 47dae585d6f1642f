//! Conversion of keyword arguments to the library's settings. Names and value syntax are those of the command line.

use crate::errors::Raise as _;
use crate::throughput_profile::throughput_profile;
use motorfit::Error;
use motorfit::device::DeviceSpec;
use motorfit::identify::IdentifySpec;
use motorfit::named::Named;
use motorfit::record::Record;
use motorfit::setting::Setting;
use motorfit::settings::{self, DEVICE, Given, Kind, PROBLEM, READING, SEARCH, Value, row};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

/// Keyword arguments of a call.
pub struct Keywords<'a, 'py> {
    given: Option<&'a Bound<'py, PyDict>>,
    py: Python<'py>,
}

impl<'a, 'py> Keywords<'a, 'py> {
    /// Takes the keyword arguments of a call.
    ///
    /// # Errors
    /// Returns `TypeError` for a name that is not in `known`, with the nearest known name.
    pub fn new(py: Python<'py>, given: Option<&'a Bound<'py, PyDict>>, known: &[&str]) -> PyResult<Self> {
        for key in given.iter().flat_map(|given| given.keys()) {
            let key: String = key.extract()?;
            if !known.contains(&key.as_str()) {
                let near =
                    motorfit::text::nearest(&key, known).map_or(String::new(), |n| format!("; did you mean {n}?"));
                let of_reading = READING.iter().any(|setting| keyword(*setting) == key);
                let near = match of_reading {
                    true => format!(
                        "; {key} is a setting of reading: pass Record.from_file(path, {key}=…) or Record.from_columns(frame, {key}=…)"
                    ),
                    false => near,
                };
                return Err(PyTypeError::new_err(format!("there is no keyword argument {key}{near}")));
            }
        }
        Ok(Self { given, py })
    }

    fn get(&self, key: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        let value = self.given.map(|given| given.get_item(key)).transpose()?.flatten();
        Ok(value.filter(|value| !value.is_none()))
    }

    /// Returns the value of `key` as a `T`, if it is given and not `None`.
    pub fn value<T: for<'x> FromPyObject<'x, 'py, Error = PyErr>>(&self, key: &str) -> PyResult<Option<T>> {
        let wrong = |error: PyErr| PyTypeError::new_err(format!("{key}: {}", error.value(self.py)));
        self.get(key)?.map(|value| value.extract::<T>().map_err(wrong)).transpose()
    }

    /// Returns true if `key` is given and not `None`.
    pub fn has(&self, key: &str) -> bool {
        self.get(key).is_ok_and(|value| value.is_some())
    }

    /// Returns one or several sizes; `default` if `key` is not given.
    pub fn sizes(&self, key: &str, default: usize) -> PyResult<Vec<usize>> {
        let Some(value) = self.get(key)? else { return Ok(vec![default]) };
        match value.extract::<usize>() {
            Ok(size) => Ok(vec![size]),
            Err(_) => Ok(self.value(key)?.unwrap_or_default()),
        }
    }

    /// Returns the string of `key`, if it is given.
    pub fn text(&self, key: &str) -> PyResult<Option<String>> {
        self.value(key)
    }

    /// Returns the variant of `T` that `key` names, if it is given.
    pub fn choice<T: Named>(&self, key: &str) -> PyResult<Option<T>> {
        self.text(key)?.map(|text| T::named(key, &text)).transpose().raise(self.py)
    }

    /// Returns the given values of some settings, as the settings table declares their kinds.
    pub fn given(&self, settings: &[&[Setting]]) -> PyResult<Given> {
        let mut given = Given::default();
        for row in settings.concat().into_iter().filter_map(row) {
            let key = keyword(row.setting);
            let Some(found) = self.get(key)? else { continue };
            let value = match row.kind {
                Kind::Switch => self.value(key)?.map(Value::Switch),
                Kind::Number => self.value(key)?.map(Value::Number),
                Kind::Count => self.value(key)?.map(Value::Count),
                Kind::Choice(_) => self.text(key)?.map(Value::Text),
                Kind::Word if found.is_instance_of::<PyString>() => self.text(key)?.map(Value::Text),
                Kind::Word => Some(Value::Text(items(&found, key)?.join(","))),
                Kind::List => Some(Value::List(items(&found, key)?)),
            };
            value.into_iter().for_each(|value| given.put(row.setting, value));
        }
        Ok(given)
    }

    /// Returns the items of `key` in the syntax of the command line; empty if it is not given.
    pub fn items(&self, key: &str) -> PyResult<Vec<String>> {
        self.get(key)?.map_or_else(|| Ok(Vec::new()), |value| items(&value, key))
    }

    /// Returns groups of lists of `key` in the syntax of the command line: each mapping is a group, and a string or strings are one.
    pub fn groups(&self, key: &str) -> PyResult<Vec<Vec<String>>> {
        let Some(value) = self.get(key)? else { return Ok(Vec::new()) };
        if value.is_instance_of::<PyString>() || value.hasattr("items")? {
            return Ok(vec![vec![items(&value, key)?.join(",")]]);
        }
        let all: Vec<Bound<'_, PyAny>> = value.try_iter()?.collect::<PyResult<_>>()?;
        if all.iter().any(|one| !one.is_instance_of::<PyString>()) {
            return all.iter().map(|one| Ok(vec![items(one, key)?.join(",")])).collect();
        }
        Ok(vec![items(&value, key)?])
    }
}

/// Converts a list to items in the syntax of the command line: a string with commas, a sequence of strings, or a mapping of
/// names to numbers, strings or pairs of bounds. `key` names the argument in errors.
pub fn items(value: &Bound<'_, PyAny>, key: &str) -> PyResult<Vec<String>> {
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(text.to_str()?.split(',').map(str::to_owned).filter(|item| !item.trim().is_empty()).collect());
    }
    if value.hasattr("items")? {
        let mut list = Vec::new();
        for pair in value.call_method0("items")?.try_iter()? {
            let (name, value): (String, Bound<'_, PyAny>) = pair?.extract()?;
            let text = item(&value).map_err(|_| {
                PyTypeError::new_err(format!(
                    "{key}: {name} is {}; give a number, a pair of numbers or a string",
                    repr(&value)
                ))
            })?;
            list.push(format!("{name}={text}"));
        }
        return Ok(list);
    }
    let wrong = |_| PyTypeError::new_err(format!("{key}: give a string, a sequence of strings, or a mapping"));
    value.extract().map_err(wrong)
}

/// Spells a value of a mapping: a number, a string, or a pair of numbers as `LOW:HIGH`.
fn item(value: &Bound<'_, PyAny>) -> PyResult<String> {
    if let Ok(number) = value.extract::<f64>() {
        return Ok(number.to_string());
    }
    if let Ok(text) = value.extract::<String>() {
        return Ok(text);
    }
    let ends: Vec<f64> = value.try_iter()?.map(|end| end?.extract::<f64>()).collect::<PyResult<_>>()?;
    match ends[..] {
        [low, high] => Ok(format!("{low}:{high}")),
        _ => Err(PyTypeError::new_err("not a pair")),
    }
}

/// Returns the `repr` of a value, shortened.
fn repr(value: &Bound<'_, PyAny>) -> String {
    let text = value.repr().map_or_else(|_| String::new(), |text| text.to_string());
    motorfit::text::excerpt(&text)
}

/// Returns the keyword argument of a setting.
pub fn keyword(setting: Setting) -> &'static str {
    // `with` is a reserved word of Python.
    if setting == Setting::With { "with_" } else { setting.name() }
}

/// Returns the keyword arguments of groups of settings.
pub fn keywords(settings: &[&[Setting]]) -> Vec<&'static str> {
    settings.concat().into_iter().map(keyword).collect()
}

/// Reads the settings of a problem. A current input has a first-order hold by default.
pub fn problem(keys: &Keywords<'_, '_>, records: &[Record]) -> PyResult<IdentifySpec> {
    let given = keys.given(&[&PROBLEM, &DEVICE])?;
    let spec = settings::problem(&given).map_err(Error::from).raise(keys.py)?;
    Ok(measured(settings::with_intersample_of(spec, &given, records)))
}

/// Reads all settings of an identification.
pub fn identify(keys: &Keywords<'_, '_>, records: &[Record]) -> PyResult<IdentifySpec> {
    let given = keys.given(&[&SEARCH, &PROBLEM, &DEVICE])?;
    let spec = settings::identify(&given).map_err(Error::from).raise(keys.py)?;
    Ok(measured(settings::with_intersample_of(spec, &given, records)))
}

/// Reads the settings of the device.
pub fn device(keys: &Keywords<'_, '_>) -> PyResult<IdentifySpec> {
    Ok(measured(settings::device(&keys.given(&[&DEVICE])?).map_err(Error::from).raise(keys.py)?))
}

fn measured(spec: IdentifySpec) -> IdentifySpec {
    let throughput_profile = if spec.device == DeviceSpec::Auto { throughput_profile() } else { None };
    IdentifySpec { throughput_profile, ..spec }
}
