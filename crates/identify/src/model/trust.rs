//! The level of trust in a result with a user's model.

use super::result::ModelIdentification;
use super::step_accuracy::{inaccuracy, shorter_steps};
use crate::trust_level::{Trust, TrustLevel, TrustReason};
use motorfit_core::numeric::upper_median;
use motorfit_core::setting::{Text, text};
use motorfit_core::text::{Shortest, counted, listed, significant};
use motorfit_evaluate::model::ModelProblem;
use motorfit_model::Model;

use TrustLevel::{Check, Poor};

/// Smallest acceptable fit of an output whose residuals are not noise \[%\].
const FIT_MIN: f64 = 80.0;
/// Smallest acceptable fit of the best output, also if the residuals are noise \[%\].
const FIT_OF_BEST_MIN: f64 = 30.0;

/// Number of samples up to which residuals are not tested for whiteness.
const SAMPLES_FEW: usize = 40;

/// Determines the level of trust in a result.
pub(super) fn trust(problem: &ModelProblem, found: &ModelIdentification, is_polished: bool) -> Trust {
    let model = problem.model();
    let mut all: Vec<(TrustLevel, TrustReason)> = Vec::new();
    let mut add = |level, code, message: Text| all.push((level, TrustReason { code, message }));
    let is_noise = is_noise(found);
    if let Some(message) = poor_fit(model, found, is_noise) {
        add(Poor, "poor_fit", message.into());
    }
    match found.verification.status {
        "search_stuck" => add(Poor, "search_stuck", "a better optimum is known".into()),
        "reference_failed" => {
            let (starts, arrivals) = (found.verification.starts, found.verification.arrivals);
            let message = format!("only {arrivals} of {starts} starts lead to the lowest optimum");
            add(Check, "search_inconclusive", message.into());
        }
        "not_applicable" if is_polished => add(Check, "not_verified", "no other search confirms the optimum".into()),
        _ => {}
    }
    if !is_polished {
        add(Check, "not_polished", "without a polish there are no standard errors".into());
    } else if !found.converged {
        add(Poor, "not_converged", "the refinement has not converged".into());
    }
    if (0..problem.recordings()).any(|n| problem.recording(n).effective_sample_ratio < 1.0) {
        let message = "the signals were filtered or resampled, which biases the estimates of nonlinear equations";
        add(Check, "filtered", message.into());
    }
    let outlying = outliers(problem, found);
    if let Some((message, _)) = &outlying {
        add(Check, "outliers", message.clone().into());
    }
    let most = found.fits.iter().flat_map(|fit| fit.simulated.first()).map(Vec::len).max().unwrap_or(0);
    if is_polished && most <= SAMPLES_FEW {
        add(Check, "few_samples", format!("{most} samples are too few to test the residuals").into());
    }
    let tested = found.fits.iter().flat_map(|fit| &fit.residuals).flatten().next().is_some();
    if is_polished && tested && !is_noise {
        add(Check, "residuals", "the residuals are not white, or depend on an input: the model lacks an effect".into());
    }
    if let Some(first) = found.combinations.first() {
        add(Check, "not_identifiable", first.clone().into());
    }
    let bound: Vec<&str> =
        found.estimates.iter().filter(|e| e.at_bound.is_some()).map(|estimate| estimate.name.as_str()).collect();
    if !bound.is_empty() {
        let verb = if bound.len() == 1 { "ended at a bound" } else { "ended at bounds" };
        add(Check, "at_bound", format!("{} {verb}", listed(&bound, "and")).into());
    }
    if found.method.is_rough {
        add(Check, "not_accurate", inaccuracy(problem).into());
    }
    all.sort_by_key(|(level, _)| std::cmp::Reverse(*level as u8));
    let level = all.first().map_or(TrustLevel::Good, |(level, _)| *level);
    let reasons: Vec<TrustReason> = all.into_iter().map(|(_, reason)| reason).collect();
    // Wrong samples spoil the fit and the tests of the residuals too.
    let next = reasons.first().map(|reason| match &outlying {
        Some((_, intervals)) => text!("Exclude the samples: " [Mask = "{intervals}"] "."),
        None if reason.code == "not_accurate" => shorter_steps(problem),
        None => next(found, reason.code),
    });
    Trust { level, reasons, next }
}

/// Residuals beyond this multiple of their median magnitude are outliers: ten standard deviations of Gaussian noise.
const OUTLIER: f64 = 15.0;

/// Largest number of intervals in a suggested mask.
const INTERVALS: usize = 10;

/// Returns a description of the samples of an output that are far from the model, and the mask that excludes them; `None` if there are
/// none. A model that lacks an effect has many large residuals, not a few.
fn outliers(problem: &ModelProblem, found: &ModelIdentification) -> Option<(String, String)> {
    for (n, fit) in found.fits.iter().enumerate() {
        let recording = problem.recording(n);
        let outputs = problem.model().outputs().iter().enumerate();
        for (((number, output), simulated), measured) in outputs.zip(&fit.simulated).zip(&recording.measured) {
            let Some(measured) = measured else { continue };
            let size = |k: usize| (measured[k] - simulated[k]).abs();
            let counting: Vec<usize> = (0..measured.len()).filter(|k| recording.counts(number, *k)).collect();
            let median = upper_median(&mut counting.iter().map(|k| size(*k)).collect::<Vec<f64>>());
            let far: Vec<usize> = counting.iter().copied().filter(|k| size(*k) > OUTLIER * median).collect();
            let Some(&first) = far.first().filter(|_| median > 0.0 && far.len() <= measured.len() / 50) else {
                continue;
            };
            let time = |k: usize| Shortest(recording.time_s[k]);
            // Half a step around a run of samples, so that the interval is not empty.
            let margin = |k: usize| 0.5 * recording.step(k);
            let bound = |seconds: f64| Shortest(significant(seconds, 9).parse().unwrap_or(seconds)).to_string();
            let samples = counted(far.len(), "sample");
            let verb = if far.len() == 1 { "is" } else { "are" };
            let message =
                format!("{samples} of {} {verb} far from the model, the first at {} s", output.name, time(first));
            let runs = far.chunk_by(|a, b| a + 1 == *b).take(INTERVALS);
            let interval = |run: &[usize]| {
                let (first, last) = (run[0], run[run.len() - 1]);
                let ends = [recording.time_s[first] - margin(first), recording.time_s[last] + margin(last)];
                ends.map(bound).join(":")
            };
            return Some((message, runs.map(interval).collect::<Vec<_>>().join(",")));
        }
    }
    None
}

/// Returns true if the residuals were tested and are noise.
fn is_noise(found: &ModelIdentification) -> bool {
    let tests: Vec<_> = found.fits.iter().flat_map(|fit| &fit.residuals).flatten().collect();
    let passes = |test: &&crate::analysis::ResidualTest| {
        test.whiteness.is_white && test.voltage.is_none_or(|input| input.is_independent)
    };
    !tests.is_empty() && tests.iter().all(passes)
}

fn poor_fit(model: &Model, found: &ModelIdentification, is_noise: bool) -> Option<String> {
    let best = found.fit_percent.iter().flatten().copied().fold(f64::NEG_INFINITY, f64::max);
    let is_poor = |fit: f64| best < FIT_OF_BEST_MIN || (fit < FIT_MIN && !is_noise);
    let outputs = model.outputs().iter().zip(&found.fit_percent);
    let poor: Vec<String> = outputs
        .filter_map(|(output, fit)| Some((output, (*fit)?)))
        .filter(|(_, fit)| is_poor(*fit))
        .map(|(output, fit)| format!("{:.0} % of {}", fit.max(0.0), output.name))
        .collect();
    (!poor.is_empty()).then(|| {
        let poor: Vec<&str> = poor.iter().map(String::as_str).collect();
        format!("the model explains only {}", listed(&poor, "and"))
    })
}

/// Returns the next step for the first reason.
fn next(found: &ModelIdentification, code: &str) -> Text {
    match code {
        "poor_fit" | "residuals" => {
            "Add the effect that the model lacks, or check units and signs of the signals.".into()
        }
        "not_verified" => "Let the search run to its end.".into(),
        "search_stuck" | "search_inconclusive" => text!("Narrow the " [Bounds] ", or try another " [Seed] "."),
        "not_polished" => text!("Leave out " [Polish = "none"] "."),
        "not_converged" => "Check the bounds, or fix parameters that the recordings hardly show.".into(),
        "not_identifiable" => match found.estimates.iter().find(|e| !e.fixed && e.value.is_none()) {
            Some(first) => {
                text!("Fix one of them, as " [Fix = "{}=VALUE", first.name] ", or write the combination as one parameter.")
            }
            None => "Write the combination as one parameter.".into(),
        },
        "at_bound" => match found.estimates.iter().find(|e| e.at_bound.is_some()) {
            Some(first) => {
                text!("Widen its bounds, as " [Bounds = "{}=MIN:MAX", first.name] ", if other values are plausible.")
            }
            None => text!("Widen the " [Bounds] "."),
        },
        "filtered" => text!("Fit the recording without " [Rate] ", " [Decimate] " and " [Filter] "."),
        _ => "Record longer, or at a higher rate.".into(),
    }
}
