//! The level of trust in a result: a statement on whether its standard errors can be trusted, with reasons and the next step.
//!
//! A result is `good` if the residuals pass their tests, residuals at the level of the noise or a conclusive search confirm the
//! optimum, and no finding about the recordings or the motor contradicts it. Each reason lowers the level to `check` or `poor`.

use super::result::Identification;
use super::spec::IdentifySpec;
use super::trust_level::{Trust, TrustLevel, TrustReason};
use super::verify::Status;
use crate::analysis::{EXPLAINED_MIN, ResidualTest, ResidualTests};
use motorfit_core::numeric::{chi_square_limit, peak};
use motorfit_core::setting::{Text, text};
use motorfit_motor::{Extension, Parameter, With};
use motorfit_record::warning::{Warning, name_of};
use motorfit_record::{Record, Severity};

use TrustLevel::{Check, Poor};

/// Warnings that are reasons, each with the level to which it lowers trust and a short description. Each code is also in
/// [`super::REASONS`].
const WARNINGS: [(&str, TrustLevel, &str); 21] = [
    ("sign_reversed", Poor, "a channel has the opposite sign"),
    ("units", Poor, "magnitudes are implausible in these units"),
    ("recordings_differ", Poor, "the recordings are not of one motor under one condition"),
    ("not_converged", Poor, "the refinement has not converged"),
    ("friction_differs", Check, "friction differs between the recordings"),
    ("model_incomplete", Check, "the residuals show an effect that the model lacks"),
    ("not_separated", Check, "another model fits the recordings equally well"),
    ("at_bound", Check, "a parameter ended at a bound"),
    ("late_voltage", Check, "the voltage is recorded late"),
    ("between_samples", Check, "the intersample behaviour of the voltage is not that of the discretization"),
    ("not_identifiable", Check, "not every parameter is identifiable"),
    ("few_samples", Check, "there are few samples"),
    ("averaged_sensor", Check, "a sensor averages over samples"),
    ("current_clipped", Check, "the current is clipped"),
    ("voltage_without_current", Check, "the voltage does not reach the motor"),
    ("motion_without_input", Check, "the motor moves without voltage"),
    ("speed_falls", Check, "the speed falls where the voltage rises"),
    ("outliers", Check, "single samples are far from their neighbours"),
    ("input_noise", Check, "the standard errors do not include the noise of the input"),
    ("initial_state", Check, "a recording does not start as assumed"),
    ("dead_time_long", Check, "the dead time is longer than is plausible for a motor"),
];

/// Determines the level of trust in a result from its fit, verification, residual tests and warnings, and from `evidence`.
pub(super) fn trust(records: &[Record], spec: &IdentifySpec, found: &Identification, evidence: &Evidence) -> Trust {
    let mut all: Vec<(TrustLevel, TrustReason)> = Vec::new();
    let mut add = |level, code, message: Text| all.push((level, TrustReason { code, message }));
    fits(records, found, &evidence.missed).into_iter().for_each(|(level, code, message)| add(level, code, message));
    let not_noise = residuals(&found.residual_tests);
    let is_noise = is_noise(&found.residual_tests, &evidence.missed);
    if let Some((level, code, message)) = search(found).filter(|(level, ..)| !is_noise || *level == Poor) {
        add(level, code, message.into());
    }
    if found.uncertainty.is_none() {
        add(Check, "not_polished", "without a polish there are no standard errors".into());
    }
    if let Some(message) = not_noise {
        add(Check, "residuals", message);
    }
    if let Some(message) = implausible(records, found) {
        add(Check, "implausible", message.into());
    }
    for (code, level, message) in WARNINGS {
        let given = |warning: &&Warning| warning.code == code && warning.severity == Severity::Report;
        if found.warnings.iter().any(|warning| given(&warning)) && !is_modelled(found, code) {
            add(level, code, message.into());
        }
    }
    all.sort_by_key(|(level, _)| std::cmp::Reverse(*level as u8));
    let level = all.first().map_or(TrustLevel::Good, |(level, _)| *level);
    let reasons: Vec<TrustReason> = all.into_iter().map(|(_, reason)| reason).collect();
    let next = (level != TrustLevel::Good).then(|| next(spec, found, (&reasons, evidence)));
    Trust { level, reasons, next }
}

/// Returns true if the residuals were tested and are noise, so that no other optimum can fit better.
pub(super) fn is_noise(tests: &[ResidualTests], missed: &[Missed]) -> bool {
    residuals(tests).is_none() && missed.is_empty() && !tests.is_empty()
}

/// Returns true if the model includes the effect that a warning is about.
fn is_modelled(found: &Identification, code: &str) -> bool {
    code == "averaged_sensor" && found.extensions().contains(&Extension::SensorAverage)
}

/// The evidence against a result besides its warnings.
pub(super) struct Evidence {
    /// Channels of recordings with residuals far above the noise.
    pub missed: Vec<Missed>,
    /// Extension that the residuals show and the model lacks.
    pub lacking: Option<Extension>,
}

/// A channel of a recording with residuals far above its noise.
#[derive(Debug, Clone, Copy)]
pub(super) struct Missed {
    pub recording: usize,
    pub channel: usize,
    /// Fit `100 (1 − ‖y − ŷ‖/‖y − mean y‖)` of the channel \[%\].
    pub fit_percent: f64,
}

/// Smallest acceptable fit of a channel whose residuals are far above the noise \[%\].
const FIT_MIN: f64 = 80.0;
/// Smallest acceptable fit of the best channel, also if the residuals are white \[%\].
const FIT_OF_BEST_MIN: f64 = 30.0;
/// Smallest acceptable fit of a channel of one recording whose residuals are far above the noise \[%\].
const FIT_OF_RECORDING_MIN: f64 = 50.0;

/// Returns the reasons from poor fits.
fn fits(records: &[Record], found: &Identification, missed: &[Missed]) -> Vec<(TrustLevel, &'static str, Text)> {
    let mut reasons = Vec::new();
    let far = |channel: usize| missed.iter().any(|of| of.channel == channel);
    let names = ["current", "speed"];
    let best = found.fit_percent.iter().flatten().copied().fold(f64::NEG_INFINITY, f64::max);
    let is_poor = |channel: usize, fit: f64| best < FIT_OF_BEST_MIN || (fit < FIT_MIN && far(channel));
    let poor = |channel: usize| found.fit_percent[channel].filter(|fit| is_poor(channel, *fit));
    let list: Vec<String> = (0..2)
        .filter_map(|channel| Some(format!("{:.0} % of the {}", poor(channel)?.max(0.0), names[channel])))
        .collect();
    if !list.is_empty() {
        reasons.push((Poor, "poor_fit", text!(("the model fits only {}", list.join(", ")))));
    }
    let worst = missed.iter().filter(|of| of.fit_percent < FIT_OF_RECORDING_MIN && records.len() > 1);
    if let Some(worst) = worst.min_by(|a, b| a.fit_percent.total_cmp(&b.fit_percent)) {
        let (name, record) = (names[worst.channel], name_of(&records[worst.recording]));
        reasons.push((Poor, "recording_missed", text!(("the model does not fit the {name} of {record}"))));
    }
    reasons
}

/// Returns the reason from the verification of the search.
fn search(found: &Identification) -> Option<(TrustLevel, &'static str, &'static str)> {
    let check = &found.verification;
    match check.status {
        Status::Agrees => None,
        Status::SearchStuck if check.refined_agrees && found.uncertainty.is_some() => None,
        Status::SearchStuck => Some((Poor, "search_stuck", "a better optimum is known")),
        Status::ReferenceFailed => Some((Check, "search_inconclusive", "the global search is inconclusive")),
        Status::NotApplicable => Some((Check, "not_verified", "no global search confirms the optimum")),
    }
}

/// Smallest correlation of residuals at lag 1 that matters.
const CORRELATION_MIN: f64 = 0.02;
/// Degrees of freedom of the whiteness test.
const LAGS: usize = 20;

/// Describes the residuals that are not noise; `None` if all are. The significance level is 1e-4, so that joint fits of many
/// recordings raise few false alarms.
fn residuals(tests: &[ResidualTests]) -> Option<Text> {
    let coloured = |test: &ResidualTest| {
        test.whiteness.statistic > chi_square_limit(LAGS) && test.whiteness.lag1.abs() > CORRELATION_MIN
    };
    let follows =
        |test: &ResidualTest| test.voltage.is_some_and(|v| !v.is_independent && v.explained_percent >= EXPLAINED_MIN);
    let of = |verdict: &dyn Fn(&ResidualTest) -> bool| {
        let bad = |channel: usize| tests.iter().any(|of| of[channel].as_ref().is_some_and(verdict));
        let list: Vec<&str> =
            ["current", "speed"].into_iter().enumerate().filter(|(n, _)| bad(*n)).map(|(_, name)| name).collect();
        (!list.is_empty()).then(|| list.join(" and "))
    };
    let parts = [
        of(&coloured).map(|list| format!("the residuals of {list} are autocorrelated")),
        of(&follows).map(|list| format!("the residuals of {list} are correlated with the input")),
    ];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    (!parts.is_empty()).then(|| parts.join("; ").into())
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

/// Returns the next step for the most severe reasons.
fn next(spec: &IdentifySpec, found: &Identification, (reasons, evidence): (&[TrustReason], &Evidence)) -> Text {
    let has = |codes: &[&str]| reasons.iter().any(|reason| codes.contains(&reason.code));
    if has(&["between_samples"]) && found.input == motorfit_motor::Input::Voltage {
        let better = if found.model.discretization == motorfit_motor::Discretization::Foh { "zoh" } else { "foh" };
        return text!([Discretization = "{better}"]);
    }
    if has(&["sign_reversed", "units", "implausible"]) {
        return text!([Command::Inspect]);
    }
    if has(&["poor_fit", "recording_missed", "residuals", "averaged_sensor", "model_incomplete", "late_voltage"])
        && spec.with != With::Auto
    {
        return text!([With = "auto"]);
    }
    if let Some(lacking) = evidence.lacking {
        let list: Vec<&str> = found.extensions().into_iter().chain([lacking]).map(Extension::name).collect();
        return text!([With = "{}", list.join(",")]);
    }
    if has(&["at_bound"]) && Parameter::ALL.iter().any(|p| !spec.auto_bounds.contains(p)) {
        return text!([Bounds = "auto"]);
    }
    if has(&["search_stuck", "search_inconclusive", "not_verified"]) && spec.method.is_search() {
        return text!([Method = "auto"]);
    }
    if has(&["not_verified", "not_polished"]) && !spec.is_polished() {
        return text!([Polish = "lm"]);
    }
    text!([Command::Inspect])
}

#[cfg(test)]
mod tests {
    use super::WARNINGS;
    use crate::REASONS;

    #[test]
    fn every_warning_that_is_a_reason_is_described() {
        for (code, ..) in WARNINGS {
            assert!(REASONS.iter().any(|(known, _)| *known == code), "{code} is not in the table of reasons");
        }
    }
}
