//! Inspection of a recording: findings, and the parameters that it identifies.

use super::method::Method;
use super::pipeline::identify;
use super::result::Identification;
use super::spec::IdentifySpec;
use crate::analysis::{Characteristic, Characteristics, detect_intersample, record_warnings};
use crate::device::DeviceSpec;
use motorfit_core::setting::Text;
use motorfit_core::text::significant;
use motorfit_estimate::steiglitz_mcbride_resampled;
use motorfit_evaluate::Model;
use motorfit_motor::{Discretization, Parameter};
use motorfit_record::warning::Warning;
use motorfit_record::{Quantity, Record};

/// The inspection of a recording.
#[derive(Debug, Clone)]
pub struct Inspection<'a> {
    /// Inspected recording.
    pub record: &'a Record,
    /// Findings, the most important first.
    pub warnings: Vec<Warning>,
    /// Parameters that the recording identifies.
    pub identifiability: Identifiability,
}

/// The parameters that a recording identifies.
#[derive(Debug, Clone, PartialEq)]
pub enum Identifiability {
    /// The recording identifies all five parameters.
    Identifies {
        /// Relative standard errors of R, L, K, B and J; `None` for a parameter at a bound.
        relative_error: [Option<f64>; 5],
    },
    /// The recording does not identify all five parameters.
    Lacks {
        /// Reason why a parameter is not identifiable.
        message: Text,
        /// Remedy, or the characteristics that are identifiable.
        remedy: Text,
    },
}

impl Identifiability {
    /// Formats the relative standard errors \[%\]; `None` if not all five parameters are identified.
    #[must_use]
    pub fn errors(&self) -> Option<String> {
        let Self::Identifies { relative_error } = self else { return None };
        let error = |(p, e): (Parameter, &Option<f64>)| match e {
            Some(e) => format!("{} ± {} %", p.symbol(), significant(100.0 * e, 2)),
            None => format!("{} at a bound", p.symbol()),
        };
        Some(Parameter::ALL.into_iter().zip(relative_error).map(error).collect::<Vec<_>>().join(", "))
    }
}

/// Largest number of samples at which an inspection runs a population search.
const LENGTH_SEARCHED: usize = 50_000;

impl<'a> Inspection<'a> {
    /// Diagnoses the recording and identifies the motor with default settings on the CPU.
    #[must_use]
    pub fn of(record: &'a Record) -> Self {
        let mut spec = IdentifySpec { device: DeviceSpec::Cpu, ..IdentifySpec::default() };
        // A population search on a long recording would take too long for an inspection.
        if record.len() > LENGTH_SEARCHED && !has_resampled_estimate(record, spec.model) {
            spec.method = Method::SteiglitzMcBride;
        }
        if record.driver() == Quantity::Current {
            // A measured current is continuous between samples.
            spec.method = Method::Auto;
            spec.model.discretization = Discretization::Foh;
        }
        let mut warnings = record_warnings(record);
        let mut add = |warning: Option<Warning>| warnings.extend(warning);
        let identifiability = match identify(std::slice::from_ref(record), &spec) {
            Ok(found) if found.warnings.iter().any(|w| w.code == "channel_missing") => lacking(&found),
            Ok(found) => {
                add(found.warnings.iter().find(|warning| warning.code == "between_samples").cloned());
                let index = |p: Parameter| found.space.free().iter().position(|axis| axis.parameter == p);
                let error = |p: Parameter| found.uncertainty.as_ref()?.std_error[index(p)?];
                let relative = |p: Parameter| Some(error(p)? / found.parameters.get(p));
                Identifiability::Identifies { relative_error: Parameter::ALL.map(relative) }
            }
            Err(error) => {
                let between = detect_intersample(record, None, spec.model.discretization);
                add(between.ok().flatten().map(|between| between.warning(Quantity::Voltage)));
                Identifiability::Lacks { message: error.text(), remedy: error.hint().clone() }
            }
        };
        Self { record, warnings, identifiability }
    }
}

/// Returns true if a recording has an irregular clock and a Steiglitz–McBride estimate from a copy resampled at even steps.
fn has_resampled_estimate(record: &Record, model: Model) -> bool {
    !record.steps().step_index.is_empty() && matches!(steiglitz_mcbride_resampled(record, model), Ok(Ok(_)))
}

/// Returns the result for a recording that lacks a channel, with the identifiable characteristics and their relative standard
/// errors as the remedy.
fn lacking(found: &Identification) -> Identifiability {
    let warning = found.warnings.iter().find(|warning| warning.code == "channel_missing");
    let one = |(name, unit, c): (&str, &str, Option<Characteristic>)| {
        let c = c?;
        let error =
            c.std_error.map_or(String::new(), |e| format!(" ± {} %", significant(100.0 * e / c.value.abs(), 2)));
        Some(format!("{} {} {unit}{error}", name.replace('_', " "), significant(c.value, 4)))
    };
    let known: Vec<String> = Characteristics::named_of(found).into_iter().filter_map(one).collect();
    Identifiability::Lacks {
        message: warning.map_or_else(Text::default, |warning| warning.message.clone()),
        remedy: if known.is_empty() { Text::default() } else { format!("Identifiable: {}.", known.join(", ")).into() },
    }
}
