//! Keyword arguments as the library's settings: the names and the forms of the command line's flags.

use crate::errors::Raise as _;
use crate::paces::paces;
use motorfit::criterion::Criterion;
use motorfit::evaluate::Model;
use motorfit::identify::{DeviceSpec, IdentifySpec, Method, With, values};
use motorfit::motor::{Discretization, Input, Space};
use motorfit::named::Named;
use motorfit::record::{Quantity, Record};
use motorfit::setting::Setting;
use motorfit::{Error, Result};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

/// The most threads.
const THREADS_MAX: usize = 1024;

/// Settings by their names.
pub struct Keywords<'a, 'py> {
    given: Option<&'a Bound<'py, PyDict>>,
    py: Python<'py>,
}

impl<'a, 'py> Keywords<'a, 'py> {
    /// Those given; a name that is not among `known` is an error.
    pub fn new(py: Python<'py>, given: Option<&'a Bound<'py, PyDict>>, known: &[&str]) -> PyResult<Self> {
        for key in given.iter().flat_map(|given| given.keys()) {
            let key: String = key.extract()?;
            if !known.contains(&key.as_str()) {
                let near =
                    motorfit::text::nearest(&key, known).map_or(String::new(), |n| format!("; did you mean {n}?"));
                return Err(PyTypeError::new_err(format!("there is no keyword argument {key}{near}")));
            }
        }
        Ok(Self { given, py })
    }

    fn get(&self, key: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        let value = self.given.map(|given| given.get_item(key)).transpose()?.flatten();
        Ok(value.filter(|value| !value.is_none()))
    }

    /// A value of a type.
    pub fn value<T: for<'x> FromPyObject<'x, 'py, Error = PyErr>>(&self, key: &str) -> PyResult<Option<T>> {
        let wrong = |error: PyErr| PyTypeError::new_err(format!("{key}: {}", error.value(self.py)));
        self.get(key)?.map(|value| value.extract::<T>().map_err(wrong)).transpose()
    }

    /// Whether it is given.
    pub fn has(&self, key: &str) -> bool {
        self.get(key).is_ok_and(|value| value.is_some())
    }

    /// One size, or several.
    pub fn sizes(&self, key: &str, usual: usize) -> PyResult<Vec<usize>> {
        let Some(value) = self.get(key)? else { return Ok(vec![usual]) };
        match value.extract::<usize>() {
            Ok(size) => Ok(vec![size]),
            Err(_) => Ok(self.value(key)?.unwrap_or_default()),
        }
    }

    /// A text.
    pub fn text(&self, key: &str) -> PyResult<Option<String>> {
        self.value(key)
    }

    /// The row of a table by its name.
    pub fn choice<T: Named>(&self, key: &str) -> PyResult<Option<T>> {
        self.text(key)?.map(|text| T::named(key, &text)).transpose().raise(self.py)
    }

    /// A list as the command line has it: a text with commas, a sequence of texts, or a mapping of names to a number or
    /// to a pair of bounds.
    pub fn items(&self, key: &str) -> PyResult<Vec<String>> {
        self.get(key)?.map_or_else(|| Ok(Vec::new()), |value| items(&value, key))
    }
}

/// A list in one of its forms; `key` names it in errors.
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
                    "{key}: {name} is {}: neither a number, a pair of numbers nor a text",
                    repr(&value)
                ))
            })?;
            list.push(format!("{name}={text}"));
        }
        return Ok(list);
    }
    let wrong = |_| PyTypeError::new_err(format!("{key}: give a text, a sequence of texts, or a mapping"));
    value.extract().map_err(wrong)
}

/// A value of a mapping: a number, a text, or any pair of numbers.
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

/// What Python shows of a value, in short.
fn repr(value: &Bound<'_, PyAny>) -> String {
    let text = value.repr().map_or_else(|_| String::new(), |text| text.to_string());
    motorfit::text::excerpt(&text)
}

/// What drives the motor in recordings.
pub fn input_of(records: &[Record]) -> Input {
    let by_current = records.iter().all(|record| record.driver() == Quantity::Current);
    if by_current { Input::Current } else { Input::Voltage }
}

/// What evaluation and identification share.
pub const PROBLEM: [&str; 13] = [
    "criterion",
    "scale",
    "noise",
    "time_origin",
    "discretization",
    "initial",
    "bounds",
    "fix",
    "with_",
    "per_recording",
    "device",
    "precision",
    "threads",
];

/// The settings of a problem. A motor whose input is the `current` takes it as lines between samples.
pub fn problem(keys: &Keywords<'_, '_>, input: Input) -> PyResult<IdentifySpec> {
    let py = keys.py;
    let held = if input == Input::Current { Discretization::Foh } else { Discretization::Zoh };
    let (bounds, fix) = (keys.items("bounds")?, keys.items("fix")?);
    let with = With::parse(&keys.items("with_")?).raise(py)?;
    let space = if with == With::default() { Space::table2_with } else { Space::table2_to_extend };
    let limits = values::bounds(&bounds).raise(py)?;
    let fixed = values::parameters(&fix, Setting::Fix).raise(py)?;
    let noise = Some(keys.items("noise")?.join(",")).filter(|noise| !noise.is_empty());
    let noise = noise.map(|text| values::noise(&text)).transpose().raise(py)?;
    Ok(IdentifySpec {
        criterion: Criterion {
            norm: keys.choice("criterion")?.unwrap_or_default(),
            scale: keys.choice("scale")?.unwrap_or_default(),
            time_origin_s: keys.value("time_origin")?,
            noise: noise.unwrap_or_default(),
        },
        model: Model {
            discretization: keys.choice("discretization")?.unwrap_or(held),
            initial: keys.choice("initial")?.unwrap_or_default(),
        },
        space: space(&limits, &fixed).raise(py)?,
        auto_bounds: values::auto_bounds(&bounds).raise(py)?,
        with,
        per_recording: values::named(&keys.items("per_recording")?, Setting::PerRecording).raise(py)?,
        ..device(keys)?
    })
}

/// What evaluates.
pub fn device(keys: &Keywords<'_, '_>) -> PyResult<IdentifySpec> {
    let device = keys.text("device")?.map_or(Ok(DeviceSpec::default()), |text| text.parse()).raise(keys.py)?;
    let threads = keys.value("threads")?;
    check_threads(threads).raise(keys.py)?;
    Ok(IdentifySpec {
        paces: if device == DeviceSpec::Auto { paces() } else { None },
        device,
        precision: keys.choice("precision")?.unwrap_or_default(),
        threads,
        ..IdentifySpec::default()
    })
}

/// So many threads may be asked for.
pub fn check_threads(threads: Option<usize>) -> Result<()> {
    match threads.filter(|threads| !(1..=THREADS_MAX).contains(threads)) {
        Some(threads) => {
            let remedy = format!("Give 1 to {THREADS_MAX}, or leave it out for all.");
            Err(Error::usage(format!("threads is {threads}"), remedy))
        }
        None => Ok(()),
    }
}

/// The settings of a method.
pub fn method(py: Python<'_>, name: &str, settings: &[String]) -> PyResult<Method> {
    let mut method = Method::named("method", name).raise(py)?;
    for item in settings {
        let (key, value) = values::pair(item, Setting::Set, "mutation=0.1").raise(py)?;
        method.set(key.strip_prefix(&format!("{name}.")).unwrap_or(key), value).raise(py)?;
    }
    Ok(method)
}

/// The settings of an identification beside those of its problem.
pub const IDENTIFY: [&str; 6] = ["method", "polish", "population", "generations", "seed", "set"];

/// All settings of an identification.
pub fn identify(keys: &Keywords<'_, '_>, input: Input) -> PyResult<IdentifySpec> {
    let usual = IdentifySpec::default();
    let name = keys.text("method")?.unwrap_or_else(|| usual.method.name().to_owned());
    Ok(IdentifySpec {
        method: method(keys.py, &name, &keys.items("set")?)?,
        polish: keys.choice("polish")?.unwrap_or_default(),
        population: keys.value("population")?.unwrap_or(usual.population),
        generations: keys.value("generations")?.unwrap_or(usual.generations),
        seed: keys.value("seed")?.unwrap_or(usual.seed),
        ..problem(keys, input)?
    })
}
