//! Conversion of the library's errors to exceptions: one class for each kind, settings spelled as keyword arguments.

use motorfit::file::with_similar_name;
use motorfit::setting::{Command, Form, Reference, Setting};
use motorfit::{Error, ErrorKind};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// Conversion of a library result to a `PyResult`.
pub trait Raise<T> {
    /// Returns the value, or the error as an exception.
    fn raise(self, py: Python<'_>) -> PyResult<T>;
}

impl<T> Raise<T> for motorfit::Result<T> {
    fn raise(self, py: Python<'_>) -> PyResult<T> {
        self.map_err(|error| exception(py, &error))
    }
}

/// Returns the exception of an error: an instance of a class of `motorfit._errors`.
pub fn exception(py: Python<'_>, error: &Error) -> PyErr {
    let name = match error.kind() {
        ErrorKind::Usage => "UsageError",
        ErrorKind::Data => "DataError",
        ErrorKind::NotIdentified => "NotIdentifiedError",
        ErrorKind::Device => "DeviceError",
        _ => "MotorfitError",
    };
    let error = with_similar_name(error.clone());
    let (message, hint) = (error.spelled(keyword), error.hint().spelled(keyword));
    let made = || py.import("motorfit._errors")?.getattr(name)?.call1((&message, &hint));
    match made() {
        Ok(exception) => PyErr::from_value(exception),
        // The compiled module was imported without the package's Python files.
        Err(_) => PyRuntimeError::new_err(format!("{message}\n{hint}")),
    }
}

/// Spells a reference in a message as a keyword argument, `with_="load"`, or as a function.
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
