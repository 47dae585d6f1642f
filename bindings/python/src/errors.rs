//! The library's errors as exceptions, one class for each kind.

use motorfit::setting::{Command, Form, Reference, Setting};
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
    let (message, hint) = (error.spelled(keyword), error.hint().spelled(keyword));
    let made = || py.import("motorfit._errors")?.getattr(name)?.call1((&message, &hint));
    match made() {
        Ok(exception) => PyErr::from_value(exception),
        // The package without its Python half.
        Err(_) => PyRuntimeError::new_err(format!("{message}\n{hint}")),
    }
}

/// Spells a reference as a keyword argument with its value, or as a function: `with_="load"`.
pub fn keyword(reference: &Reference) -> String {
    match reference {
        Reference::Setting(setting, value) => {
            let name = if *setting == Setting::With { "with_" } else { setting.name() };
            match (setting.form(), value) {
                (_, None) => name.to_owned(),
                (Form::Number, Some(value)) => format!("{name}={value}"),
                (_, Some(value)) => format!("{name}=\"{value}\""),
            }
        }
        Reference::Command(command) => match command {
            Command::Identify => "motorfit.identify",
            Command::Devices => "motorfit.devices()",
            Command::PlanSweep => "Sweep.plan(study, out)",
            Command::RunSweep => "Sweep.run()",
            _ => "motorfit",
        }
        .to_owned(),
    }
}
