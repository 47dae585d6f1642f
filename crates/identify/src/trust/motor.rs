//! The level of trust in a result of the DC motor.

use super::next::next_step;
use super::{Facts, Missed, Reason, Subject, is_noise};
use crate::estimates::ParameterEstimate;
use crate::result::Identification;
use crate::spec::IdentifySpec;
use crate::trust_level::{Trust, TrustLevel};
use crate::verify::Status;
use motorfit_core::numeric::peak;
use motorfit_motor::{Extension, Input, Parameter};
use motorfit_record::warning::{Warning, name_of};
use motorfit_record::{AssumedUnits, Record};

use TrustLevel::{Check, Poor};

/// Names of the outputs in sentences.
pub(crate) const OUTPUTS: [&str; 2] = ["the current", "the speed"];

/// Determines the level of trust in a result from its fit, verification, residual tests and warnings. `missed` are
/// channels of recordings with residuals far above the noise.
pub(crate) fn trust(records: &[Record], spec: &IdentifySpec, found: &Identification, missed: &[Missed]) -> Trust {
    let is_noise = is_noise(&found.residual_tests, missed);
    // Without a voltage no fixed parameter makes R and L identifiable.
    let is_given = |e: &ParameterEstimate| e.fixed && Parameter::ALL.iter().any(|p| p.symbol() == e.name);
    let is_asked = found.input == Input::Voltage && found.estimates.iter().any(is_given);
    let facts = Facts {
        subject: Subject::new(found, is_asked),
        assumed: records.iter().find_map(AssumedUnits::of_motor),
        outputs: OUTPUTS.map(str::to_owned).to_vec(),
        recordings: records.iter().map(name_of).collect(),
        fit_percent: &found.fit_percent,
        missed,
        tests: &found.residual_tests,
        is_polished: found.uncertainty.is_some(),
        search: search(found).filter(|(level, ..)| !is_noise || *level == Poor),
        warnings: found.warnings.iter().filter(|warning| !is_modelled(found, warning)).collect(),
        more: implausible(records, found).map(|message| (Check, "implausible", message.into())).into_iter().collect(),
    };
    let trust = facts.trust();
    let next = || next_step(records, (spec, found), &trust);
    let next = (trust.level != TrustLevel::Good).then(next);
    Trust { next, ..trust }
}

/// Returns true if the model includes the effect that a warning is about.
fn is_modelled(found: &Identification, warning: &Warning) -> bool {
    warning.code == "averaged_sensor" && found.extensions().contains(&Extension::SensorAverage)
}

/// Returns the reason from the verification of the search.
fn search(found: &Identification) -> Option<Reason> {
    let check = &found.verification;
    match check.status {
        Status::Agrees => None,
        Status::SearchStuck if check.refined_agrees && found.uncertainty.is_some() => None,
        Status::SearchStuck => Some((Poor, "search_stuck", "a better optimum is known".into())),
        Status::ReferenceFailed => Some((Check, "search_inconclusive", "the global search is inconclusive".into())),
        Status::NotApplicable => Some((Check, "not_verified", "no global search confirms the optimum".into())),
    }
}

/// Largest plausible current \[A\].
const CURRENT_MAX: f64 = 200.0;
/// Largest plausible speed \[rad/s\].
const SPEED_MAX: f64 = 20_000.0;
/// Range of plausible electrical time constants \[s\].
const ELECTRICAL_S: [f64; 2] = [1e-7, 0.5];
/// Range of plausible mechanical time constants \[s\].
const MECHANICAL_S: [f64; 2] = [1e-5, 60.0];

/// Returns the largest magnitude of a signal without excluded samples.
fn counting_peak(record: &Record, channel: usize, signal: &[f64]) -> f64 {
    let counting = record.counting();
    if counting.is_empty() {
        return peak(signal);
    }
    let counts = signal.iter().zip(&counting).filter(|(_, counts)| counts[channel]);
    counts.fold(0.0, |largest: f64, (value, _)| largest.max(value.abs()))
}

/// Describes a magnitude that is implausible for a motor, which suggests a wrong unit; `None` if there is none.
fn implausible(records: &[Record], found: &Identification) -> Option<String> {
    let motor = &found.parameters;
    let is_identified = |p: &[Parameter]| p.iter().all(|p| !found.unidentified.iter().any(|(of, _)| of == p));
    let largest = |channel: usize| {
        let signals = records.iter().filter_map(|record| Some((record, record.measured()[channel]?)));
        signals.map(|(record, signal)| counting_peak(record, channel, signal)).fold(0.0, f64::max)
    };
    let outside = |[low, high]: [f64; 2], value: f64| value < low || value > high;
    if largest(0) > CURRENT_MAX {
        return Some(format!("a current of {:.0} A is implausible", largest(0)));
    }
    if largest(1) > SPEED_MAX {
        return Some(format!("a speed of {:.0} rad/s is implausible", largest(1)));
    }
    let electrical = motor.l / motor.r;
    if is_identified(&[Parameter::L, Parameter::R]) && outside(ELECTRICAL_S, electrical) {
        return Some(format!("an electrical time constant of {electrical:.2e} s is implausible"));
    }
    let mechanical = motor.r * motor.j / (motor.k * motor.k + motor.r * motor.b);
    if is_identified(&[Parameter::R, Parameter::K, Parameter::J]) && outside(MECHANICAL_S, mechanical) {
        return Some(format!("a mechanical time constant of {mechanical:.2e} s is implausible"));
    }
    None
}
