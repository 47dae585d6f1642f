//! What a recording can and cannot identify, as an inspection tells it.

use super::device::DeviceSpec;
use super::identify;
use super::spec::IdentifySpec;
use crate::motor::Parameter;
use crate::record::Record;

/// What a recording can identify.
#[derive(Debug, Clone, PartialEq)]
pub enum Outlook {
    /// All five parameters: their relative standard errors, as far as they are known.
    Identifies {
        /// In the order R, L, K, B, J.
        relative_error: [Option<f64>; 5],
    },
    /// Not all of them.
    Lacks {
        /// Why.
        message: String,
        /// What to do.
        remedy: String,
    },
}

/// Identifies the motor of a recording without any flag and keeps what that says of the recording.
#[must_use]
pub fn outlook(record: &Record) -> Outlook {
    let spec = IdentifySpec { device: DeviceSpec::Cpu, ..IdentifySpec::default() };
    match identify(std::slice::from_ref(record), &spec) {
        Ok(found) => {
            let place = |p: Parameter| found.space.free().iter().position(|axis| axis.parameter == p);
            let error = |p: Parameter| found.uncertainty.as_ref()?.std_error[place(p)?];
            Outlook::Identifies { relative_error: Parameter::ALL.map(|p| Some(error(p)? / found.parameters.get(p))) }
        }
        Err(error) => Outlook::Lacks { message: error.to_string(), remedy: error.remedy().to_owned() },
    }
}
