//! Refinement with steps so short that the estimates do not depend on them.

use motorfit_core::Result;
use motorfit_core::numeric::rms;
use motorfit_estimate::Refined;
use motorfit_estimate::model::refine_model;
use motorfit_evaluate::model::{ModelProblem, ModelSpace, StepChange};

/// Largest number of substeps of a refinement, and the largest change of an estimate by half the step, in standard errors.
const SUBSTEPS_MAX: usize = 16;
const CHANGE_MAX: f64 = 0.2;
/// Differences of the sum of squares within which estimates are of the same optimum: in units of σ², and as a part of the sum.
const SAME: f64 = 1e-3;
const SAME_PART: f64 = 1e-6;
/// Part of the residuals below which a difference by half the step is far from what the model leaves unexplained.
const OF_RESIDUALS: f64 = 0.1;
/// Ratio of the changes of two halvings of the step up to which estimates converge.
const CONVERGES: f64 = 0.6;

/// Fits the initial states, if they are estimated, to given values of the parameters, with steps that are short enough for them; returns
/// the number of substeps beside the fit.
pub(super) fn fitted_at(
    problem: &ModelProblem,
    start: &[f64],
    open: &[Vec<f64>],
    weights: &[Vec<f64>],
) -> Result<(usize, Refined)> {
    let mut there = problem.with_space(ModelSpace::all_fixed(&problem.space().values(start, 0)))?;
    let mut fitted = refine_model(&there, &[], open, Some(weights))?;
    while !there.method().is_exact() && 2 * there.method().substeps <= SUBSTEPS_MAX {
        let finer = there.with_substeps(2 * there.method().substeps)?;
        if !steps_matter(&there, &finer, &fitted) {
            break;
        }
        fitted = refine_model(&finer, &[], &fitted.initial, Some(weights))?;
        there = finer;
    }
    Ok((there.method().substeps, fitted))
}

/// Returns true if an estimate fits better, under the weights of the best one, by more than the accuracy of descents.
pub(super) fn is_better(other: &Refined, best: &Refined) -> bool {
    let [own, known] = [other, best].map(|of| of.weighted(&best.weights));
    own < known - SAME.max(SAME_PART * known)
}

/// Repeats a refinement with half the step until the estimates do not depend on it: an error of the integration that a search does not
/// see can be many standard errors. If they still change at the finest step, the method is marked as rough.
pub(super) fn with_fine_steps(mut problem: ModelProblem, mut refined: Refined) -> Result<(ModelProblem, Refined)> {
    let (mut before, mut change) = (f64::INFINITY, None);
    while !problem.method().is_exact() {
        if 2 * problem.method().substeps > SUBSTEPS_MAX {
            // After a search with the finest steps, estimates with twice the step show whether they are short enough.
            if before.is_finite() {
                return Ok((problem.with_rough_steps(true, change), refined));
            }
            let (agrees, change) = agrees_with_coarser(&problem, &refined)?;
            return Ok((problem.with_rough_steps(!agrees, change), refined));
        }
        let finer = problem.with_substeps(2 * problem.method().substeps)?;
        // Where friction sticks, the moments of rest can depend on the steps however short they are; shorter ones take long where the
        // equations are not affine.
        let takes_long = problem.model().reactions() > 0 && !problem.method().stiffness.is_affine;
        let is_enough = takes_long && !steps_matter(&problem, &finer, &refined);
        let next = refine_model(&finer, &refined.values, &refined.initial, None)?;
        change = largest_change(&next, &refined, [problem.method().substeps, finer.method().substeps]);
        let largest = change.map_or(0.0, |change| change.std_errors);
        (problem, refined) = (finer, next);
        if largest < CHANGE_MAX || is_enough && largest > CONVERGES * before {
            problem = problem.with_rough_steps(largest >= CHANGE_MAX, change);
            break;
        }
        before = largest;
    }
    Ok((problem, refined))
}

/// Returns true if the estimates with twice the step are the same, and their largest change beside it.
fn agrees_with_coarser(problem: &ModelProblem, refined: &Refined) -> Result<(bool, Option<StepChange>)> {
    let substeps = problem.method().substeps;
    let coarser = problem.with_substeps(substeps / 2)?;
    // With long steps a model may diverge.
    let other = refine_model(&coarser, &refined.values, &refined.initial, None).ok();
    let Some(other) = other else { return Ok((false, None)) };
    let change = largest_change(refined, &other, [substeps / 2, substeps]);
    Ok((change.is_none_or(|change| change.std_errors < CHANGE_MAX), change))
}

/// Returns the largest change of an estimate, in standard errors of the first; `None` if no parameter has one.
fn largest_change(of: &Refined, from: &Refined, substeps: [usize; 2]) -> Option<StepChange> {
    let changes = of.uncertainty.std_error.iter().zip(of.values.iter().zip(&from.values)).enumerate();
    let sized = changes.filter_map(|(axis, (error, (new, old)))| {
        let std_errors = (new - old).abs() / (*error)?;
        std_errors.is_finite().then_some(StepChange { axis, std_errors, substeps })
    });
    sized.max_by(|a, b| a.std_errors.total_cmp(&b.std_errors))
}

/// Returns true if half the step changes an output by more than a small part of its residuals.
fn steps_matter(problem: &ModelProblem, finer: &ModelProblem, refined: &Refined) -> bool {
    (0..problem.recordings()).any(|recording| {
        let initial = &refined.initial[recording];
        let [a, b] = [problem, finer].map(|of| of.simulate(&refined.values, recording, initial).outputs);
        let measured = &problem.recording(recording).measured;
        a.iter().zip(&b).zip(measured).zip(&refined.sigmas[recording]).any(|(((a, b), measured), residual)| {
            let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
            let size = rms(&difference);
            measured.is_some() && (size.is_nan() || size > OF_RESIDUALS * residual)
        })
    })
}
