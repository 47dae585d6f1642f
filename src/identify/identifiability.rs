//! The inspection of a recording.

use super::method::Method;
use super::pipeline::identify;
use super::result::Identification;
use super::spec::IdentifySpec;
use crate::analysis::{Characteristic, Characteristics, detect_intersample, record_warnings};
use crate::device::DeviceSpec;
use crate::estimate::steiglitz_mcbride_resampled;
use crate::evaluate::Model;
use crate::motor::{Discretization, Parameter};
use crate::record::{Quantity, Record};
use crate::setting::Text;
use crate::text::significant;
use crate::warning::Warning;

/// A recording that was looked at.
#[derive(Debug, Clone)]
pub struct Inspection<'a> {
    /// The recording.
    pub record: &'a Record,
    /// Findings, the most important first.
    pub warnings: Vec<Warning>,
    /// The parameters that it identifies.
    pub identifiability: Identifiability,
}

/// Parameters that a recording identifies.
#[derive(Debug, Clone, PartialEq)]
pub enum Identifiability {
    /// All five parameters: their relative standard errors, as far as they are known.
    Identifies {
        /// In the order R, L, K, B, J.
        relative_error: [Option<f64>; 5],
    },
    /// Not all of them.
    Lacks {
        /// Why.
        message: Text,
        /// The remedy.
        remedy: Text,
    },
}

impl Identifiability {
    /// The relative standard errors in words; `None` where not all five parameters are identified.
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

/// The longest recording that an inspection searches.
const LENGTH_SEARCHED: usize = 50_000;

impl<'a> Inspection<'a> {
    /// Looks for what is odd, and identifies the motor with the usual settings for what that says of the recording.
    #[must_use]
    pub fn of(record: &'a Record) -> Self {
        let mut spec = IdentifySpec { device: DeviceSpec::Cpu, ..IdentifySpec::default() };
        // Where Steiglitz–McBride cannot serve, a search of a long recording takes longer than an inspection may.
        if record.len() > LENGTH_SEARCHED && !has_resampled_estimate(record, spec.model) {
            spec.method = Method::SteiglitzMcBride;
        }
        if record.driver() == Quantity::Current {
            // A current is sampled while it goes on; nothing is searched.
            spec.method = Method::Auto;
            spec.model.discretization = Discretization::Foh;
        }
        let mut warnings = record_warnings(record);
        let mut say = |warning: Option<Warning>| warnings.extend(warning);
        let identifiability = match identify(std::slice::from_ref(record), &spec) {
            Ok(found) if found.warnings.iter().any(|w| w.code == "channel_missing") => lacking(&found),
            Ok(found) => {
                say(found.warnings.iter().find(|warning| warning.code == "between_samples").cloned());
                let place = |p: Parameter| found.space.free().iter().position(|axis| axis.parameter == p);
                let error = |p: Parameter| found.uncertainty.as_ref()?.std_error[place(p)?];
                let relative = |p: Parameter| Some(error(p)? / found.parameters.get(p));
                Identifiability::Identifies { relative_error: Parameter::ALL.map(relative) }
            }
            Err(error) => {
                let between = detect_intersample(record, None, spec.model.discretization);
                say(between.ok().flatten().map(|between| between.warning(Quantity::Voltage)));
                Identifiability::Lacks { message: error.text(), remedy: error.hint().clone() }
            }
        };
        Self { record, warnings, identifiability }
    }
}

/// Returns whether a recording on an irregular clock has an estimate from copies at even steps.
fn has_resampled_estimate(record: &Record, model: Model) -> bool {
    !record.steps().step_index.is_empty() && matches!(steiglitz_mcbride_resampled(record, model), Ok(Ok(_)))
}

/// Returns the characteristics with their relative standard errors, where a channel is missing.
fn lacking(found: &Identification) -> Identifiability {
    let warning = found.warnings.iter().find(|warning| warning.code == "channel_missing");
    let one = |(name, unit, c): (&str, &str, Option<Characteristic>)| {
        let c = c?;
        let error =
            c.std_error.map_or(String::new(), |e| format!(" ± {} %", significant(100.0 * e / c.value.abs(), 2)));
        Some(format!("{} {} {unit}{error}", name.replace('_', " "), significant(c.value, 4)))
    };
    let told: Vec<String> = Characteristics::named_of(found).into_iter().filter_map(one).collect();
    Identifiability::Lacks {
        message: warning.map_or_else(Text::default, |warning| warning.message.clone()),
        remedy: if told.is_empty() { Text::default() } else { format!("Told are {}.", told.join(", ")).into() },
    }
}
