//! Refinement with steps so short that the estimates do not depend on them.

use motorfit_core::Result;
use motorfit_core::numeric::{count, rms, standard_deviation};
use motorfit_estimate::model::{ModelRefined, ModelWeights, refine_model, refine_model_near};
use motorfit_evaluate::model::{ModelProblem, ModelSettings, ModelSpace};

/// Largest number of substeps of a refinement, and the largest change of an estimate by half the step, in standard errors.
const SUBSTEPS_MAX: usize = 16;
const CHANGE_MAX: f64 = 0.2;
/// Differences within which estimates are of the same optimum: a part of the sum of squares, and a difference of the deviance.
const SAME_SQUARES: f64 = 1e-6;
const SAME_DEVIANCE: f64 = 1e-3;
/// Part of the residuals below which a difference by half the step is far from what the model leaves unexplained.
const OF_RESIDUALS: f64 = 0.1;
/// Ratio of the changes of two halvings of the step up to which estimates converge.
const CONVERGES: f64 = 0.6;

/// Returns the best estimate that descents from given values of the parameters find, if it is better than the one found, so that a model
/// that contains another one and starts at its estimates explains no less; beside it the problem with other steps, if it needs them.
pub(super) fn better_than(
    problem: &ModelProblem,
    found: &ModelRefined,
    given: &[Vec<f64>],
    estimates_initial: bool,
) -> Option<(Option<ModelProblem>, ModelRefined)> {
    let mut best: Option<(Option<ModelProblem>, ModelRefined)> = None;
    for start in given {
        let (own, known) = match &best {
            Some((finer, better)) => (finer.as_ref().unwrap_or(problem), better),
            None => (problem, found),
        };
        if let Some((finer, better)) = better_from(own, known, start, estimates_initial) {
            let before = best.and_then(|(finer, _)| finer);
            best = Some((finer.or(before), better));
        }
    }
    best
}

/// Returns the estimate from a start if it is better, beside the problem with steps that are short enough for the start, if others are.
/// The initial states are fitted to the start first. With parameters of single recordings, which a start does not have, the steps remain.
fn better_from(
    problem: &ModelProblem,
    best: &ModelRefined,
    start: &[f64],
    estimates_initial: bool,
) -> Option<(Option<ModelProblem>, ModelRefined)> {
    let mut initial = problem.open_initials();
    if problem.space().free.iter().any(|axis| axis.recording.is_some()) {
        let other = refined_as(problem, (start, &initial), estimates_initial, best.weights).ok()?;
        return is_better(problem, &other, best).then_some((None, other));
    }
    // A start from which the model diverges is no better.
    let (substeps, mut fitted) = fitted_at(problem, start, (&initial, estimates_initial), best.weights).ok()?;
    let finer = match substeps == problem.method().substeps {
        true => None,
        false => Some(problem.with_substeps(substeps).ok()?),
    };
    let same = finer.as_ref().unwrap_or(problem);
    let best = match finer {
        Some(_) => &refined_as(same, (&best.values, &best.initial), estimates_initial, best.weights).ok()?,
        None => best,
    };
    if finer.is_some() && fitted.weights != best.weights {
        (_, fitted) = fitted_at(same, start, (&initial, estimates_initial), best.weights).ok()?;
    }
    if !is_better(same, &fitted, best) {
        return None;
    }
    initial.clone_from(&fitted.initial);
    let other = refined_as(same, (start, &initial), estimates_initial, best.weights).ok()?;
    let is_better = is_better(same, &other, best);
    is_better.then_some((finer, other))
}

/// Fits the initial states, if they are estimated, to given values of the parameters, with steps that are short enough for them; returns
/// the number of substeps beside the fit.
fn fitted_at(
    problem: &ModelProblem,
    start: &[f64],
    (open, estimates_initial): (&[Vec<f64>], bool),
    weights: ModelWeights,
) -> Result<(usize, ModelRefined)> {
    let mut there = with_fixed(problem, start)?;
    let mut fitted = refine_model(&there, &[], open, (estimates_initial, weights))?;
    while !there.method().is_exact() && 2 * there.method().substeps <= SUBSTEPS_MAX {
        let finer = there.with_substeps(2 * there.method().substeps)?;
        if !steps_matter(&there, &finer, &fitted) {
            break;
        }
        fitted = refine_model(&finer, &[], &fitted.initial, (estimates_initial, weights))?;
        there = finer;
    }
    Ok((there.method().substeps, fitted))
}

/// Refines values that are near an optimum of the given weights.
fn refined_as(
    problem: &ModelProblem,
    (values, initial): (&[f64], &[Vec<f64>]),
    estimates_initial: bool,
    weights: ModelWeights,
) -> Result<ModelRefined> {
    match weights {
        ModelWeights::Signals => refine_model(problem, values, initial, (estimates_initial, weights)),
        ModelWeights::MaximumLikelihood => refine_model_near(problem, values, initial, estimates_initial),
    }
}

/// Returns the problem with all parameters fixed at values of the free ones.
fn with_fixed(problem: &ModelProblem, free: &[f64]) -> Result<ModelProblem> {
    let space = ModelSpace::all_fixed(&problem.space().values(free, 0));
    let recordings = (0..problem.recordings()).map(|n| problem.recording(n).clone()).collect();
    let method = Some((problem.method().method, problem.method().substeps));
    let settings = ModelSettings { method, ..problem.settings() };
    ModelProblem::new(problem.model(), space, recordings, settings)
}

/// Returns true if an estimate with the same weights fits better by more than the accuracy of descents.
fn is_better(problem: &ModelProblem, other: &ModelRefined, best: &ModelRefined) -> bool {
    let [own, known] = [other, best].map(|of| objective(problem, of));
    let margin = if best.weights == ModelWeights::Signals { SAME_SQUARES * known } else { SAME_DEVIANCE };
    other.weights == best.weights && own < known - margin
}

/// Returns what the weights of an estimate minimize: `Σ n ln σ²`, or the sum of squares relative to the signals.
fn objective(problem: &ModelProblem, refined: &ModelRefined) -> f64 {
    if refined.weights == ModelWeights::Signals {
        return squares(problem, refined);
    }
    deviance(problem, refined)
}

/// Returns `Σ n ln σ²` over the outputs of the recordings.
pub(super) fn deviance(problem: &ModelProblem, refined: &ModelRefined) -> f64 {
    let of = |(recording, rms): (usize, &Vec<Option<f64>>)| {
        let own = problem.recording(recording);
        let one = |(output, rms): (usize, &Option<f64>)| Some(2.0 * count(own.count(output)) * (*rms)?.ln());
        rms.iter().enumerate().filter_map(one).sum::<f64>()
    };
    refined.residual_rms.iter().enumerate().map(of).sum()
}

/// Returns the sum of squares, each output divided by the standard deviation of its signal.
pub(super) fn squares(problem: &ModelProblem, refined: &ModelRefined) -> f64 {
    let mut total = 0.0;
    for (recording, rms) in refined.residual_rms.iter().enumerate() {
        for (output, rms) in rms.iter().enumerate() {
            let signal = problem.recording(recording).counted(output).unwrap_or_default();
            let scale = standard_deviation(&signal);
            total += rms.filter(|_| scale > 0.0).map_or(0.0, |rms| (rms / scale).powi(2) * count(signal.len()));
        }
    }
    total
}

/// Repeats a refinement with half the step until the estimates do not depend on it: an error of the integration that a search does not
/// see can be many standard errors. If they still change at the finest step, the method is marked as rough.
pub(super) fn with_fine_steps(
    mut problem: ModelProblem,
    mut refined: ModelRefined,
    estimates_initial: bool,
) -> Result<(ModelProblem, ModelRefined)> {
    let mut before = f64::INFINITY;
    while !problem.method().is_exact() {
        if 2 * problem.method().substeps > SUBSTEPS_MAX {
            // After a search with the finest steps, estimates with twice the step show whether they are short enough.
            let is_rough = before.is_finite() || !agrees_with_coarser(&problem, &refined, estimates_initial)?;
            return Ok((problem.with_rough_steps(is_rough), refined));
        }
        let finer = problem.with_substeps(2 * problem.method().substeps)?;
        // Where friction sticks, the moments of rest can depend on the steps however short they are; shorter ones take long where the
        // equations are not affine.
        let takes_long = problem.model().reactions() > 0 && !problem.method().stiffness.is_affine;
        let is_enough = takes_long && !steps_matter(&problem, &finer, &refined);
        let ModelRefined { values, initial, weights, .. } = &refined;
        let next = refined_as(&finer, (values, initial), estimates_initial, *weights)?;
        let largest = largest_change(&next, &refined);
        (problem, refined) = (finer, next);
        if largest < CHANGE_MAX || is_enough && largest > CONVERGES * before {
            problem = problem.with_rough_steps(largest >= CHANGE_MAX);
            break;
        }
        before = largest;
    }
    Ok((problem, refined))
}

/// Returns true if the estimates with twice the step are the same.
fn agrees_with_coarser(problem: &ModelProblem, refined: &ModelRefined, estimates_initial: bool) -> Result<bool> {
    let coarser = problem.with_substeps(problem.method().substeps / 2)?;
    let ModelRefined { values, initial, weights, .. } = refined;
    // With long steps a model may diverge.
    let other = refined_as(&coarser, (values, initial), estimates_initial, *weights).ok();
    Ok(other.is_some_and(|other| largest_change(refined, &other) < CHANGE_MAX))
}

/// Returns the largest change of an estimate, in standard errors of the first.
fn largest_change(of: &ModelRefined, from: &ModelRefined) -> f64 {
    let changes = of.uncertainty.std_error.iter().zip(of.values.iter().zip(&from.values));
    changes.filter_map(|(error, (new, old))| Some((new - old).abs() / (*error)?)).fold(0.0, f64::max)
}

/// Returns true if half the step changes an output by more than a small part of its residuals.
fn steps_matter(problem: &ModelProblem, finer: &ModelProblem, refined: &ModelRefined) -> bool {
    (0..problem.recordings()).any(|recording| {
        let initial = &refined.initial[recording];
        let [a, b] = [problem, finer].map(|of| of.simulate(&refined.values, recording, initial).outputs);
        let residuals = &refined.residual_rms[recording];
        a.iter().zip(&b).zip(residuals).any(|((a, b), residual)| {
            let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
            let size = rms(&difference);
            residual.is_some_and(|residual| size.is_nan() || size > OF_RESIDUALS * residual)
        })
    })
}
