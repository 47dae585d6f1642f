//! Contents of files for simulators: an identified machine.

use motorfit_core::text::Shortest;
use motorfit_core::{Error, Result};
use motorfit_identify::{Identification, ParameterEstimate};
use motorfit_model::{Model, Role};
use motorfit_record::Record;
use serde::Serialize;

/// A parameter of an identified machine.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExportedParameter {
    /// Symbol.
    pub symbol: String,
    /// Description.
    pub name: String,
    /// Value in the unit; `None` if it is not identifiable.
    pub value: Option<f64>,
    /// Unit.
    pub unit: String,
    /// Standard error.
    pub std_error: Option<f64>,
    /// 95 % confidence interval.
    pub ci95: Option<[f64; 2]>,
}

impl From<&ParameterEstimate> for ExportedParameter {
    fn from(e: &ParameterEstimate) -> Self {
        let name = if e.description.is_empty() { &e.name } else { &e.description };
        let (symbol, name, unit) = (e.name.clone(), name.clone(), e.unit.clone());
        Self { symbol, name, value: e.value, unit, std_error: e.std_error, ci95: e.ci95 }
    }
}

/// Returns the estimates of a machine; of parameters of single recordings those of the first.
pub(super) fn first_estimates<M>(found: &Identification<M>) -> Vec<&ParameterEstimate> {
    found.estimates.iter().filter(|e| e.recording.is_none_or(|n| n == 0)).collect()
}

/// An identified machine as simulators need it.
#[derive(Debug, Clone)]
pub struct Exported {
    /// Title.
    pub title: String,
    /// Equations.
    pub model: Model,
    /// Values of the parameters of the model, in their units.
    pub values: Vec<f64>,
    /// Initial values of the states that are measured or free, in their units.
    pub initial: Vec<f64>,
    /// Roles of values in simulators, in SI units.
    pub roles: Vec<(Role, f64)>,
    /// Parameters with their errors.
    pub parameters: Vec<ExportedParameter>,
    /// Effects that the roles do not hold, as `dead time, td = 0.004 s`.
    pub not_held: Vec<String>,
    /// Effects that the equations do not hold either.
    pub not_in_equations: Vec<String>,
    /// Files of the recordings with their SHA-256 digests.
    pub records: Vec<(String, Option<String>)>,
    /// Level of trust.
    pub trust: &'static str,
    /// Largest magnitude of the voltage in the recordings \[V\]; `None` if no input is a voltage.
    pub voltage: Option<f64>,
    /// Sampling period of the recordings \[s\].
    pub period_s: f64,
}

impl Exported {
    /// Returns the value of a role; `None` if the machine does not have it, or it is not identifiable.
    pub(super) fn role(&self, role: Role) -> Option<f64> {
        self.roles.iter().find(|(of, value)| *of == role && value.is_finite()).map(|(_, value)| *value)
    }

    /// Returns an error if the machine has one of the roles but it is not identifiable: without it the file would be of another machine.
    pub(super) fn check(&self, roles: &[Role]) -> Result<()> {
        match self.roles.iter().find(|(role, value)| roles.contains(role) && !value.is_finite()) {
            Some((role, _)) => Err(not_identifiable(role.name())),
            None => Ok(()),
        }
    }

    /// Returns the value of a role that must be there.
    pub(super) fn needed(&self, role: Role) -> Result<f64> {
        self.check(&[role])?;
        self.role(role).ok_or_else(|| {
            let name = role.name();
            let hint = format!("Give the model a section [export] with {name} = \"…\", in {}.", role.unit());
            Error::usage(format!("the model names no {name} for simulators"), hint)
        })
    }

    /// Returns lines that say where the file comes from, without two hyphens in a row.
    pub(super) fn origin(&self) -> Vec<String> {
        let mut lines = vec![format!("{}, identified by motorfit {}.", self.title, env!("CARGO_PKG_VERSION"))];
        for (path, digest) in &self.records {
            lines.push(match digest {
                Some(digest) => format!("Recording: {path}, sha256 {digest}."),
                None => format!("Recording: {path}."),
            });
        }
        lines.push(format!("Trust in the result: {}. SI units.", self.trust));
        let error = |of: &ExportedParameter| {
            let value =
                of.value.map_or_else(|| "not identifiable".to_owned(), |value| format!("{value:.6e} {}", of.unit));
            let error = of.std_error.map_or_else(String::new, |error| format!(" ± {error:.1e}"));
            format!("{} ({}) = {value}{error}", of.symbol, of.name)
        };
        lines.extend(self.parameters.iter().map(error));
        lines.into_iter().map(|line| line.replace("--", "- -")).collect()
    }
}

/// Returns the error of a value that the format needs and the recordings do not identify.
pub(super) fn not_identifiable(name: &str) -> Error {
    let hint = "Record what is missing, or export as json, which holds what was found.";
    Error::not_identified(format!("{name}, which the format needs, is not identifiable from the recordings"), hint)
}

/// Describes an effect of a machine by its parameter.
pub(super) fn effect(of: &ExportedParameter) -> String {
    let value =
        of.value.map_or_else(|| "not identifiable".to_owned(), |value| format!("{} {}", Shortest(value), of.unit));
    format!("{}, {} = {value}", of.name, of.symbol)
}

/// Returns the files of recordings with their digests.
pub(super) fn files(records: &[Record]) -> Vec<(String, Option<String>)> {
    let file = |record: &Record| {
        let name = record.source().file_name().unwrap_or_else(|| "made in memory".to_owned());
        (motorfit_core::text::printable(&name), record.source().sha256.clone())
    };
    records.iter().map(file).collect()
}

/// Escapes text for XML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Returns lines as a comment in XML.
pub(super) fn comment(lines: &[String]) -> String {
    format!("<!-- {} -->\n", lines.iter().map(|line| escaped(line)).collect::<Vec<_>>().join("\n     "))
}
