//! Warnings about recordings of the DC motor and the spec, and about the result of a fit.

use super::estimates::ParameterEstimate;
use super::missing_channel::missing_channel;
use super::normalized::NormalizedModel;
use super::result::Identification;
use super::result_warnings::{at_bound, of_fit};
use super::spec::IdentifySpec;
use crate::analysis::{Characteristics, warnings_of_records};
use motorfit_core::numeric::peak;
use motorfit_core::setting::{Text, text};
use motorfit_core::text::{engineering, significant};
use motorfit_core::{Error, ErrorKind};
use motorfit_estimate::SmFailure;
use motorfit_evaluate::Initial;
use motorfit_motor::{Input, Parameter};
use motorfit_record::Record;
use motorfit_record::warning::Warning;

/// Number of samples below which 95 % intervals covered only 81 to 90 % in simulations.
const SAMPLES_FEW: usize = 12;

/// Returns the warnings about recordings under a spec.
pub(super) fn of_recordings(records: &[Record], spec: &IdentifySpec) -> Vec<Warning> {
    as_taken(&warnings_of_records(records), records, spec)
}

/// Returns the warnings about recordings under a spec, with their `diagnosis` computed before.
pub(super) fn as_taken(diagnosis: &[Warning], records: &[Record], spec: &IdentifySpec) -> Vec<Warning> {
    let mut warnings = diagnosis.to_vec();
    let samples: usize = records.iter().map(Record::len).sum();
    if samples < SAMPLES_FEW {
        let message =
            format!("{samples} samples: with fewer than {SAMPLES_FEW} the confidence intervals are too narrow");
        warnings.push(Warning::new("few_samples", message));
    }
    warnings.extend(
        missing_channel(records, spec)
            .map(|(what, remedy)| Warning::new("channel_missing", what.and("; ").and(remedy))),
    );
    let moves_at_start = |signal: &[f64]| signal[0].abs() > 0.05 * peak(signal);
    if spec.model.initial == Initial::Zero && records.iter().flat_map(Record::measured).flatten().any(moves_at_start) {
        let what = "a recording does not start at rest, as ";
        let message = text!("{what}" [Initial = "zero"] " assumes; use " [Initial = "free"]);
        warnings.push(Warning::new("initial_state", message));
    }
    warnings
}

/// Puts the warning of the normalized model first, in place of others with the same code.
pub(super) fn with_normalized(mut warnings: Vec<Warning>, model: Option<&NormalizedModel>) -> Vec<Warning> {
    if let Some(model) = model {
        warnings.retain(|warning| warning.code != model.warning.code);
        warnings.insert(0, model.warning.clone());
    }
    warnings
}

/// Largest number of findings that are named before the hint of an error.
const FINDINGS_MAX: usize = 2;

/// Adds findings about the recordings before the hint of a `NotIdentified` error.
pub(super) fn with_findings(error: Error, of_recordings: &[Warning]) -> Error {
    let message = error.message().to_string();
    let is_new = |warning: &&Warning| warning.can_cause_poor_fit() && warning.message.to_string() != message;
    let found: Vec<&Warning> = of_recordings.iter().filter(is_new).take(FINDINGS_MAX).collect();
    if found.is_empty() || error.kind() != ErrorKind::NotIdentified {
        return error;
    }
    let mut first = Text::from("First check the findings in the recording: ");
    for warning in found {
        let remedy = warning.remedy.clone().unwrap_or_default();
        // A remedy that ends in a command has no full stop, which would be copied with it.
        let end = if remedy.to_string().ends_with(|c: char| c.is_alphanumeric()) { "; " } else { " " };
        first = first.and(&warning.message).and(". ").and(remedy).and(end);
    }
    error.with_hint_prefix(&first.and("Otherwise:"))
}

/// Returns the warnings about a result of the DC motor.
pub(super) fn of_result(found: &Identification, failure: Option<SmFailure>) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if found.searched.is_fallback && found.input == Input::Voltage {
        let why = failure.unwrap_or(SmFailure::PoorFit).message();
        let message = format!("Steiglitz–McBride is not applicable: {why}; a multistart was used instead");
        warnings.push(Warning::new("sm_failed", message));
    }
    for parameter in Parameter::ALL.into_iter().chain(Parameter::EXTENSIONS) {
        let Some(side) = found.at_bound(parameter) else { continue };
        warnings.push(at_bound(parameter.symbol(), side, is_idle(found, parameter, side)));
    }
    warnings.extend(of_fit(found));
    warnings
}

/// Returns true if a parameter of an extension ended at the bound at which it has no effect.
fn is_idle(found: &Identification, parameter: Parameter, side: &str) -> bool {
    let Some(axis) = found.space.free().iter().find(|axis| axis.parameter == parameter) else { return false };
    axis.range().is_idle(if side == "min" { axis.min } else { axis.max })
}

/// Largest plausible ratio of the dead time to the time constant of the motor.
const DEAD_TIME_MAX: f64 = 3.0;

/// Returns the warning about a dead time that is implausibly long for the motor.
pub(super) fn long_dead_time(found: &Identification) -> Option<Warning> {
    let constant = Characteristics::of(found)?.time_constant.value;
    let long = |e: &&ParameterEstimate| {
        e.name == Parameter::DeadTime.symbol() && e.value.is_some_and(|td| td > DEAD_TIME_MAX * constant)
    };
    let dead_time = found.estimates.iter().find(long)?.value?;
    let times = significant(dead_time / constant, 2);
    let [dead_time, constant] = [dead_time, constant].map(|seconds| engineering(seconds, "s", 3));
    let message = format!(
        "the dead time, {dead_time}, is {times} times the motor's time constant ({constant}): possible causes are \
         clocks that are not aligned and a recording that begins before the drive acts"
    );
    Some(Warning::new("dead_time_long", message))
}
