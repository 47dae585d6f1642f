//! Refinement: output-error Levenberg–Marquardt in the coordinates of the parameters, within the bounds of the space.
//!
//! The cost is the weighted sum of squares `Σ_r Σ_c Σ_n e²/σ_rc²` over recordings and channels, which is twice the negative
//! log-likelihood of white Gaussian noise of known σ up to a constant. If σ is not given, it is estimated from the residuals in
//! rounds of reweighting until it converges; the fixed point is the maximum-likelihood estimate, unless a model error would
//! sacrifice a channel, where balanced weights are kept ([`super::weights`]).

use super::descent::{Descent, Weighting};
use super::normal::Fit;
use super::refined::{EVALUATIONS_MAX, Refined, SMALLEST, STEP_MAX};
use motorfit_core::text::counted;
use motorfit_core::{Error, Result};
use motorfit_evaluate::criterion::{Criterion, Norm, Scale};
use motorfit_evaluate::{Model, Problem, Signals};
use motorfit_motor::Space;
use motorfit_record::Record;

/// Options of a refinement.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RefineOptions {
    /// The simulation model.
    pub model: Model,
    /// Noise σ of current \[A\] and speed \[rad/s\] of each recording; `None` estimates it from the residuals.
    pub sigma: Option<Vec<[f64; 2]>>,
}

/// Length of a step \[standard errors\] that ends every round of weights but the last.
const STEP_MAX_ROUND: f64 = 1e-2;
/// Largest number of rounds of weights.
const ROUNDS_MAX: usize = 30;
/// Relative change of σ that ends the rounds.
const SIGMA_CHANGE: f64 = 1e-6;
/// Largest number of simulations of a rough refinement.
const EVALUATIONS_ROUGH: usize = 50;

/// Refines the parameters `start` (one value for each free parameter of `space`) on one or more recordings.
///
/// # Errors
/// Returns `Usage` if `start` does not fit the space or has a value outside the domain of its parameter; `NotIdentified` if the
/// motor diverges there, or nothing is measured.
pub fn refine(records: &[Record], space: &Space, start: &[f64], options: &RefineOptions) -> Result<Refined> {
    refine_on(&fit_problem(records, space, options.model)?, start, options.sigma.as_deref())
}

/// Refines like [`refine`] on a problem made by [`fit_problem`], which many refinements can share.
///
/// # Errors
/// Returns the errors of [`refine`], and `Usage` if the problem has another criterion or the number of σ pairs differs from
/// that of the recordings.
pub fn refine_on(problem: &Problem, start: &[f64], sigma: Option<&[[f64; 2]]>) -> Result<Refined> {
    check_plain(problem)?;
    if sigma.is_some_and(|sigma| sigma.len() != problem.signals().len()) {
        return Err(Error::usage(
            "the number of σ pairs differs from that of the recordings",
            "Give one pair for each recording.",
        ));
    }
    refine_problem(problem, start, sigma, Effort::Thorough)
}

/// Makes the problem of a fit, whose criterion is the unweighted sum of squares; a fit divides the errors by σ itself.
///
/// # Errors
/// Propagates the errors of [`Problem::new`].
pub fn fit_problem(records: &[Record], space: &Space, model: Model) -> Result<Problem> {
    Problem::new(records, model, space.clone(), plain())
}

pub(super) fn check_plain(problem: &Problem) -> Result<()> {
    if *problem.criterion() == plain() {
        return Ok(());
    }
    Err(Error::usage(
        "the criterion of the problem weights errors, which the estimator does itself",
        "Make the problem with fit_problem.",
    ))
}

/// Returns the criterion of the unweighted sum of squares.
pub(super) fn plain() -> Criterion {
    Criterion { norm: Norm::Euclidean, scale: Scale::None, ..Criterion::default() }
}

/// Returns the initial σ of each channel: the noise estimated from the recording, at least 1e-4 of the signal's rms; 1 for
/// a channel that was not measured.
pub(super) fn first_sigma(signals: &Signals) -> [f64; 2] {
    [0, 1].map(|channel| {
        if !signals.has(channel) {
            return 1.0;
        }
        signals.noise(channel).max(1e-4 * signals.rms(channel)).max(SMALLEST)
    })
}

/// Effort of a refinement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Effort {
    /// Ends at a hundredth of a standard error, under the initial weights.
    Rough,
    /// Ends at 1e-6 standard errors, under weights from the residuals unless σ is given.
    Thorough,
}

/// Descends in rounds of weights until they converge; returns true if the descent of the last round converged.
fn rounds(search: &mut Descent<'_>, by: Weighting) -> bool {
    let mut converged = false;
    for _ in 0..ROUNDS_MAX {
        let last = search.reweight(by) < SIGMA_CHANGE;
        converged = search.run(if last { STEP_MAX } else { STEP_MAX_ROUND });
        if last {
            break;
        }
    }
    converged
}

/// Returns an error if the number of values is not that of the free parameters.
pub(super) fn check_count(problem: &Problem, values: &[f64]) -> Result<()> {
    let (found, free) = (values.len(), problem.space().free().len());
    if found == free {
        return Ok(());
    }
    let message = format!("found {}, expected {free}, one for each free parameter", counted(found, "value"));
    Err(Error::usage(message, "Give them in the order of the space."))
}

/// Refines `start` on a problem; without `sigma` the weights are estimated in a thorough refinement.
pub(super) fn refine_problem(
    problem: &Problem,
    start: &[f64],
    sigma: Option<&[[f64; 2]]>,
    effort: Effort,
) -> Result<Refined> {
    check_count(problem, start)?;
    let fit = Fit::new(problem);
    let mut axes = problem.space().free().iter().zip(start);
    if let Some((axis, value)) = axes.find(|(axis, value)| !axis.parameter.admits(**value)) {
        let parameter = axis.parameter;
        let message =
            format!("found {value:?} as the start of {}, expected a {} value", parameter.symbol(), parameter.domain());
        return Err(Error::usage(message, "Give one value per free parameter, positive for R, L, K, B and J."));
    }
    let thorough = effort == Effort::Thorough;
    let mut search = Descent::new(
        &fit,
        start,
        sigma.map_or_else(|| problem.signals().iter().map(|s| first_sigma(s)).collect(), <[_]>::to_vec),
    )?;
    if !thorough {
        search = search.at_most(EVALUATIONS_ROUGH);
    }
    let is_weighed = thorough && sigma.is_none();
    if is_weighed {
        search.begin();
    }
    let mut converged = search.run(if thorough && !is_weighed { STEP_MAX } else { STEP_MAX_ROUND });
    if is_weighed {
        converged = rounds(&mut search, Weighting::Balanced);
        if search.is_far() {
            // The maximum-likelihood rounds have a budget of their own, whatever the balanced rounds used.
            let mut maximum_likelihood = search.clone().at_most(EVALUATIONS_MAX);
            let ended = rounds(&mut maximum_likelihood, Weighting::MaximumLikelihood);
            if !maximum_likelihood.sacrifices(&search) {
                (search, converged) = (maximum_likelihood, ended);
            }
        }
    }
    Ok(search.finish(converged, thorough))
}
