//! Conversion of the library's errors to exceptions, one class for each kind, and of its warnings to Python warnings; settings
//! are spelled as keyword arguments.

use motorfit::file::with_similar_name;
use motorfit::identify::TrustReason;
use motorfit::record::Severity;
use motorfit::setting::{Command, Form, Reference, Setting};
use motorfit::warning::Warning;
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
    let class = |name: &str| py.import(MODULE)?.getattr(name);
    let missing = error.path().filter(|path| error.kind() == ErrorKind::Data && !path.exists());
    let made = match missing {
        Some(path) => {
            class("MissingFileError").and_then(|class| class.call1((&message, &hint, path.to_string_lossy())))
        }
        None => class(name).and_then(|class| class.call1((&message, &hint))),
    };
    match made {
        Ok(exception) => PyErr::from_value(exception),
        // The compiled module was imported without the package's Python files.
        Err(_) => PyRuntimeError::new_err(format!("{message}\n{hint}")),
    }
}

/// Module of the exceptions and warnings.
const MODULE: &str = "motorfit._errors";

/// Returns the warnings of one severity as instances of `MotorfitWarning`.
pub fn warnings<'py>(py: Python<'py>, list: &[Warning], severity: Severity) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let class = py.import(MODULE)?.getattr("MotorfitWarning")?;
    let of = list.iter().filter(|warning| warning.severity == severity);
    of.map(|warning| class.call1((warning.spelled(keyword), warning.code))).collect()
}

/// Returns the reasons for a level of trust as instances of `MotorfitWarning`.
pub fn reasons<'py>(py: Python<'py>, list: &[TrustReason]) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let class = py.import(MODULE)?.getattr("MotorfitWarning")?;
    list.iter().map(|reason| class.call1((reason.message.spelled(keyword), reason.code))).collect()
}

/// Returns the codes of the reported warnings for a `repr`, "; warnings: a, b"; empty without warnings.
pub fn codes(list: &[Warning]) -> String {
    let of = list.iter().filter(|warning| warning.severity == Severity::Report);
    let codes = of.map(|warning| warning.code).collect::<Vec<_>>().join(", ");
    if codes.is_empty() { codes } else { format!("; warnings: {codes}") }
}

/// Issues the reported warnings as Python warnings at the line that called into this module.
///
/// # Errors
/// Returns the warning as an exception if a filter of the user makes it one.
pub fn warn(py: Python<'_>, list: &[Warning]) -> PyResult<()> {
    let issue = py.import("warnings")?.getattr("warn")?;
    warnings(py, list, Severity::Report)?.into_iter().try_for_each(|warning| issue.call1((warning,)).map(drop))
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
            Command::Inspect => "Record.findings()",
            Command::Devices => "motorfit.devices()",
            Command::PlanSweep => "Sweep.plan(study, out)",
            Command::RunSweep => "Sweep.run()",
        }
        .to_owned(),
    }
}
