//! A continuous law of a controller in the equations, where the law may be sampled.
//!
//! A law that is held for a period T acts as a continuous one with less damping, by about half of its gain times T. The residuals remain white,
//! so that no test shows it: the law sampled at the samples of the recording is fitted beside it.

use super::result::ModelIdentification;
use crate::trust_level::{TrustLevel, TrustReason};
use motorfit_core::numeric::count;
use motorfit_core::setting::Text;
use motorfit_core::text::significant;
use motorfit_estimate::Refined;
use motorfit_estimate::model::refine_model;
use motorfit_evaluate::model::{ModelProblem, ModelSettings};
use motorfit_record::Severity;
use motorfit_record::warning::Warning;

/// Difference of the deviances up to which the sampled form explains as much: that of two models of equal size with a likelihood ratio of 20.
const AS_GOOD: f64 = 6.0;
/// Change of an estimate from which the forms differ, in standard errors.
const CHANGE_MIN: f64 = 0.5;

/// Adds a remark where the equations have a continuous law, and a reason against trust where the law fits as well if it is sampled, with other
/// estimates.
pub(super) fn add_sampled_law(problem: &ModelProblem, result: &mut ModelIdentification, refined: Option<&Refined>) {
    if !problem.model().has_continuous_law() {
        return;
    }
    let remedy = "write hold(…, PERIOD) around it, or record the voltage and make it the input";
    let message =
        format!("the control law is taken as continuous; if it is sampled, its hold biases damping: {remedy}");
    let mut remark = Warning::new("continuous_law", message);
    remark.severity = Severity::Mention;
    result.warnings.push(remark);
    let Some(refined) = refined.filter(|_| result.trust.level != TrustLevel::Poor) else { return };
    let Some((name, change)) = changed_if_sampled(problem, refined) else { return };
    let change = significant(change, 2);
    let message = format!(
        "sampled with the recording, the control law fits as well, and {name} changes by {change} standard errors"
    );
    let trust = &mut result.trust;
    trust.level = TrustLevel::Check;
    trust.reasons.push(TrustReason { code: "sampled_law", message: message.into() });
    let next = "If the law is sampled, write hold(…, PERIOD) around it, or record the voltage and make it the input.";
    trust.next.get_or_insert_with(|| Text::from(next));
}

/// Returns `Σ n ln σ²` over the outputs of the recordings.
fn deviance(problem: &ModelProblem, refined: &Refined) -> f64 {
    let of = |(recording, sigmas): (usize, &Vec<f64>)| {
        let own = problem.recording(recording);
        let measured = sigmas.iter().enumerate().filter(|(output, _)| own.measured[*output].is_some());
        measured.map(|(output, sigma)| 2.0 * count(own.count(output)) * sigma.ln()).sum::<f64>()
    };
    refined.sigmas.iter().enumerate().map(of).sum()
}

/// Returns the parameter that changes most if the law is sampled with the recordings, in standard errors; `None` if the recordings contradict
/// that, have different clocks, or no parameter changes.
fn changed_if_sampled(problem: &ModelProblem, refined: &Refined) -> Option<(String, f64)> {
    let recordings: Vec<_> = (0..problem.recordings()).map(|n| problem.recording(n).clone()).collect();
    let period_s = recordings.first()?.regular_step_s()?;
    let is_same = |step: Option<f64>| step.is_some_and(|step| (step / period_s - 1.0).abs() < 1e-6);
    if !recordings.iter().all(|recording| is_same(recording.regular_step_s())) {
        return None;
    }
    let model = problem.model().with_sampled_laws(period_s)?;
    let method = Some((problem.method().method, problem.method().substeps));
    let settings = ModelSettings { method, ..problem.settings() };
    let sampled = ModelProblem::new(&model, problem.space().clone(), recordings, settings).ok()?;
    let other = refine_model(&sampled, &refined.values, &refined.initial, None).ok()?;
    let gap = deviance(&sampled, &other) - deviance(problem, refined);
    if gap.is_nan() || gap > AS_GOOD {
        return None;
    }
    let changes = other.values.iter().zip(&refined.values).zip(&refined.uncertainty.std_error).enumerate();
    let changes = changes.filter_map(|(n, ((new, old), error))| Some((n, (new - old).abs() / (*error)?)));
    let (axis, change) = changes.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, change)| *change > CHANGE_MIN)?;
    let parameter = problem.space().free.get(axis)?.parameter;
    Some((problem.model().parameters().get(parameter)?.name.clone(), change))
}
