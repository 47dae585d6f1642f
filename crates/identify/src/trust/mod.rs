//! The level of trust in a result: a statement on whether its standard errors can be trusted, with reasons and the next step.
//!
//! A result is `good` if the residuals pass their tests, residuals at the level of the noise or a conclusive search confirm the
//! optimum, and no finding about the recordings or the machine contradicts it. Each reason lowers the level to `check` or `poor`.
//! The rules are the same for the DC motor (`motor.rs`) and for users' models (`model/trust.rs`).

pub(super) mod motor;
mod next;
mod subject;
mod validation;

pub(super) use subject::Subject;
pub(super) use validation::judge_validation;

use crate::analysis::{EXPLAINED_MIN, ResidualTest};
use crate::result::Identification;
use crate::trust_level::{Trust, TrustLevel, TrustReason};
use motorfit_core::numeric::chi_square_limit;
use motorfit_core::setting::{Text, text};
use motorfit_core::text::listed;
use motorfit_estimate::Fitted;
use motorfit_record::warning::Warning;
use motorfit_record::{AssumedUnits, Severity};

use TrustLevel::{Check, Poor};

/// Warnings that are reasons, each with the level to which it lowers trust and a short description. Each code is also in
/// [`crate::REASONS`].
pub(super) const WARNINGS: [(&str, TrustLevel, &str); 23] = [
    ("sign_reversed", Poor, "a channel has the opposite sign"),
    ("units", Poor, "magnitudes are implausible in these units"),
    ("units_disagree", Poor, "the speed is not the derivative of the position"),
    ("recordings_differ", Poor, "the recordings are not of one motor under one condition"),
    ("not_converged", Poor, "the refinement has not converged"),
    ("position_ratio", Check, "the position is not that of the speed"),
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

/// A reason with its level.
pub(super) type Reason = (TrustLevel, &'static str, Text);

/// The facts about the result of an identification, of any machine.
pub(super) struct Facts<'a> {
    /// Parameters and combinations to which the level applies.
    pub subject: Subject,
    /// Units that no heading names.
    pub assumed: Option<AssumedUnits>,
    /// Names of the outputs in sentences, as `the current` or `x`.
    pub outputs: Vec<String>,
    /// Names of the recordings.
    pub recordings: Vec<String>,
    /// Fit of each output over all recordings \[%\].
    pub fit_percent: &'a [Option<f64>],
    /// Outputs of recordings with residuals far above the noise.
    pub missed: &'a [Missed],
    /// Tests of the residuals, shape `[recordings][outputs]`.
    pub tests: &'a [Vec<Option<ResidualTest>>],
    /// True if the result is refined.
    pub is_polished: bool,
    /// Reason from the search of the bounds.
    pub search: Option<Reason>,
    /// Warnings of the result.
    pub warnings: Vec<&'a Warning>,
    /// Further reasons.
    pub more: Vec<Reason>,
}

/// An output of a recording with residuals far above its noise.
#[derive(Debug, Clone, Copy)]
pub(super) struct Missed {
    pub recording: usize,
    pub output: usize,
    /// Fit `100 (1 − ‖y − ŷ‖/‖y − mean y‖)` of the output \[%\].
    pub fit_percent: f64,
}

/// Returns the outputs of recordings whose residuals, of standard deviations `sigmas`, are far above the noise.
pub(super) fn missed(problem: &dyn Fitted, sigmas: &[Vec<f64>]) -> Vec<Missed> {
    let of = |recording: usize, output: usize| {
        let sigma = *sigmas.get(recording)?.get(output)?;
        let fit_percent = 100.0 * (1.0 - sigma / problem.deviation((recording, output)));
        let is_far = problem.is_above_noise((recording, output), sigma) && fit_percent.is_finite();
        is_far.then_some(Missed { recording, output, fit_percent })
    };
    let outputs = problem.outputs();
    let all = (0..problem.recordings()).flat_map(|recording| (0..outputs).map(move |output| (recording, output)));
    all.filter_map(|(recording, output)| of(recording, output)).collect()
}

impl Facts<'_> {
    /// Returns the level of trust with its reasons, the most severe first, without the next step.
    pub fn trust(&self) -> Trust {
        let mut all = self.fits();
        all.extend(self.search.clone());
        if !self.is_polished {
            all.push((Check, "not_polished", "without a polish there are no standard errors".into()));
        }
        all.extend(residuals(self.tests, &self.outputs).map(|message| (Check, "residuals", message)));
        all.extend(self.subject.reason().filter(|_| self.is_polished));
        all.extend(self.assumed_units());
        all.extend(self.more.iter().cloned());
        for (code, level, message) in WARNINGS {
            let given = |warning: &&&Warning| warning.code == code && warning.severity == Severity::Report;
            if self.warnings.iter().any(|warning| given(&warning)) && all.iter().all(|(_, known, _)| *known != code) {
                all.push((level, code, message.into()));
            }
        }
        all.sort_by_key(|(level, ..)| std::cmp::Reverse(*level as u8));
        let level = all.first().map_or(TrustLevel::Good, |(level, ..)| *level);
        let reasons = all.into_iter().map(|(_, code, message)| TrustReason { code, message }).collect();
        let Subject { of, open, needs, .. } = self.subject.clone();
        Trust { level, of, open, needs, reasons, next: None }
    }

    /// Returns the reason that units are assumed: they scale estimates, and no residual shows it.
    fn assumed_units(&self) -> Option<Reason> {
        let AssumedUnits { listed, .. } = self.assumed.as_ref()?;
        Some((Check, "units_assumed", format!("units are assumed: {listed}").into()))
    }

    /// Returns the reasons from poor fits.
    fn fits(&self) -> Vec<Reason> {
        let mut reasons = Vec::new();
        let far = |output: usize| self.missed.iter().any(|of| of.output == output);
        let best = self.fit_percent.iter().flatten().copied().fold(f64::NEG_INFINITY, f64::max);
        let is_poor = |output: usize, fit: f64| best < FIT_OF_BEST_MIN || (fit < FIT_MIN && far(output));
        let poor = |output: usize| self.fit_percent[output].filter(|fit| is_poor(output, *fit));
        let list: Vec<String> = (0..self.outputs.len())
            .filter_map(|output| Some(format!("{:.0} % of {}", poor(output)?.max(0.0), self.outputs[output])))
            .collect();
        if !list.is_empty() {
            reasons.push((Poor, "poor_fit", text!(("the model fits only {}", list.join(", ")))));
        }
        let worst = self.missed.iter().filter(|of| of.fit_percent < FIT_OF_RECORDING_MIN && self.recordings.len() > 1);
        if let Some(worst) = worst.min_by(|a, b| a.fit_percent.total_cmp(&b.fit_percent)) {
            let (name, record) = (&self.outputs[worst.output], &self.recordings[worst.recording]);
            reasons.push((Poor, "recording_missed", text!(("the model does not fit {name} of {record}"))));
        }
        reasons
    }
}

/// Sets the level of trust of a result. The warning that the model does not fit says not to use the parameters, so it goes where the level
/// is not poor: there noise limits the fit.
pub(super) fn set<M>(found: &mut Identification<M>, trust: Trust) {
    found.trust = trust;
    if found.trust.level != Poor {
        found.warnings.retain(|warning| warning.code != "poor_fit");
    }
}

/// Returns true if the residuals were tested and are noise, so that no other optimum can fit better.
pub(super) fn is_noise(tests: &[Vec<Option<ResidualTest>>], missed: &[Missed]) -> bool {
    residuals(tests, &[]).is_none() && missed.is_empty() && !tests.is_empty()
}

/// Smallest acceptable fit of an output whose residuals are far above the noise \[%\].
const FIT_MIN: f64 = 80.0;
/// Smallest acceptable fit of the best output, also if the residuals are white \[%\].
const FIT_OF_BEST_MIN: f64 = 30.0;
/// Smallest acceptable fit of an output of one recording whose residuals are far above the noise \[%\].
const FIT_OF_RECORDING_MIN: f64 = 50.0;

/// Smallest correlation of residuals at lag 1 that matters.
const CORRELATION_MIN: f64 = 0.02;
/// Degrees of freedom of the whiteness test.
const LAGS: usize = 20;

/// Describes the residuals that are not noise; `None` if all are. The significance level is 1e-4, so that joint fits of many
/// recordings raise few false alarms.
fn residuals(tests: &[Vec<Option<ResidualTest>>], names: &[String]) -> Option<Text> {
    let coloured = |test: &ResidualTest| {
        test.whiteness.statistic > chi_square_limit(LAGS) && test.whiteness.lag1.abs() > CORRELATION_MIN
    };
    let follows =
        |test: &ResidualTest| test.voltage.is_some_and(|v| !v.is_independent && v.explained_percent >= EXPLAINED_MIN);
    let outputs = tests.iter().map(Vec::len).max().unwrap_or(0);
    let of = |verdict: &dyn Fn(&ResidualTest) -> bool| {
        let bad = |output: usize| tests.iter().any(|of| of.get(output).and_then(Option::as_ref).is_some_and(verdict));
        let name = |output: usize| names.get(output).map_or("", |name| name.trim_start_matches("the "));
        let list: Vec<&str> = (0..outputs).filter(|output| bad(*output)).map(name).collect();
        (!list.is_empty()).then(|| listed(&list, "and"))
    };
    let parts = [
        of(&coloured).map(|list| format!("the residuals of {list} are autocorrelated")),
        of(&follows).map(|list| format!("the residuals of {list} are correlated with the input")),
    ];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    (!parts.is_empty()).then(|| parts.join("; ").into())
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
