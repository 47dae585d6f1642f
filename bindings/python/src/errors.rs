//! The library's errors as exceptions, one class for each kind.

use motorfit::{Error, ErrorKind};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// Turns results of the library into those of Python.
pub trait Raise<T> {
    /// The value, or its error raised.
    fn raise(self, py: Python<'_>) -> PyResult<T>;
}

impl<T> Raise<T> for motorfit::Result<T> {
    fn raise(self, py: Python<'_>) -> PyResult<T> {
        self.map_err(|error| exception(py, &error))
    }
}

/// The exception of an error.
pub fn exception(py: Python<'_>, error: &Error) -> PyErr {
    let name = match error.kind() {
        ErrorKind::Usage => "UsageError",
        ErrorKind::Data => "DataError",
        ErrorKind::NotIdentified => "NotIdentifiedError",
        ErrorKind::Device => "DeviceError",
        _ => "MotorfitError",
    };
    let made = || {
        py.import("motorfit._errors")?.getattr(name)?.call1((keywords(&error.to_string()), keywords(&error.remedy())))
    };
    match made() {
        Ok(exception) => PyErr::from_value(exception),
        // The package without its Python half.
        Err(_) => PyRuntimeError::new_err(format!("{error}\n{}", error.remedy())),
    }
}

/// The library speaks of flags; here they are keywords: `--time-origin` is `time_origin`, `--with` is `with_`.
fn keywords(text: &str) -> String {
    let mut parts = text.split("--");
    let mut all = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let is_of_name = |c: char| c.is_ascii_lowercase() || c == '-';
        let end = part.find(|c| !is_of_name(c)).unwrap_or(part.len());
        let (name, rest) = part.split_at(end);
        if name.is_empty() || all.ends_with(|c: char| c.is_alphanumeric() || c == '-') {
            all = all + "--" + part;
        } else {
            let name = name.replace('-', "_");
            all = all + &name + if name == "with" { "_" } else { "" } + rest;
        }
    }
    all
}
