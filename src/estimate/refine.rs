//! Refinement: output-error Levenberg–Marquardt in the logarithms of the parameters, within the bounds of the space.
//!
//! The cost is the weighted sum of squares `Σ_r Σ_c Σ_n e²/σ_rc²` over recordings and channels, the negative
//! log likelihood of white normal noise. Where σ is not given it is that of the residuals, in rounds of reweighting until it
//! stands; the fixed point is the
//! maximum-likelihood estimate.

use super::descent::{Search, Weighting};
use super::normal::Fit;
use super::refined::{EVALUATIONS_MAX, Refined, SMALLEST, STEP_MAX};
use crate::criterion::{Criterion, Norm, Scale};
use crate::evaluate::{Model, Problem, Signals};
use crate::motor::Space;
use crate::record::Record;
use crate::text::counted;
use crate::{Error, Result};

/// Options of a refinement.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RefineOptions {
    /// The simulation model.
    pub model: Model,
    /// σ of the noise of current \[A\] and speed \[rad/s\] of each recording; `None` takes that of the residuals.
    pub sigma: Option<Vec<[f64; 2]>>,
}

/// A round of weights before the last ends when its step is shorter than this many standard errors.
const STEP_MAX_ROUND: f64 = 1e-2;
/// Rounds of weights, and the change of σ that ends them.
const ROUNDS_MAX: usize = 30;
const SIGMA_CHANGE: f64 = 1e-6;
/// Simulations of a rough refinement at most.
const EVALUATIONS_ROUGH: usize = 50;
/// Refines the parameters `start` (one value per free axis of `space`) on one or more recordings.
///
/// # Errors
/// `Usage` when `start` does not fit the space or is not positive and finite; `NotIdentified` when the motor diverges
/// there, or nothing is measured.
pub fn refine(records: &[Record], space: &Space, start: &[f64], options: &RefineOptions) -> Result<Refined> {
    refine_on(&fit_problem(records, space, options.model)?, start, options.sigma.as_deref())
}

/// Like [`refine`], on a problem that [`fit_problem`] has made, so that many refinements need one.
///
/// # Errors
/// As [`refine`], and `Usage` when the problem has another criterion.
pub fn refine_on(problem: &Problem, start: &[f64], sigma: Option<&[[f64; 2]]>) -> Result<Refined> {
    check_plain(problem)?;
    if sigma.is_some_and(|sigma| sigma.len() != problem.signals().len()) {
        return Err(Error::usage("σ is not given for each recording", "Give one pair for each, in their order."));
    }
    refine_problem(problem, start, sigma, Effort::Thorough)
}

/// The problem of a fit: every error counts alike until it is divided by σ.
///
/// # Errors
/// As [`Problem::new`].
pub fn fit_problem(records: &[Record], space: &Space, model: Model) -> Result<Problem> {
    Problem::new(records, model, space.clone(), plain())
}

pub(super) fn check_plain(problem: &Problem) -> Result<()> {
    if *problem.criterion() == plain() {
        return Ok(());
    }
    Err(Error::usage("the problem weighs its errors, which an estimate does itself", "Make it with fit_problem."))
}

/// Sums of squares, each channel as it is.
pub(super) fn plain() -> Criterion {
    Criterion { norm: Norm::Euclidean, scale: Scale::None, ..Criterion::default() }
}

/// σ to begin with: what a recording itself shows, but no less than a ten-thousandth of the signal; 1 for a channel not
/// measured.
pub(super) fn first_sigma(signals: &Signals) -> [f64; 2] {
    [0, 1].map(|channel| {
        if !signals.has(channel) {
            return 1.0;
        }
        signals.noise(channel).max(1e-4 * signals.rms(channel)).max(SMALLEST)
    })
}

/// The effort of a refinement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Effort {
    /// To a hundredth of a standard error under the weights that it begins with.
    Rough,
    /// As far as numbers go, under the weights of what is left.
    Thorough,
}

/// Descends in rounds of weights until they stand; returns whether the last has come to its end.
fn rounds(search: &mut Search<'_>, by: Weighting) -> bool {
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

/// Refuses values that are not as many as free parameters.
pub(super) fn check_count(problem: &Problem, values: &[f64]) -> Result<()> {
    let (found, free) = (values.len(), problem.space().free().len());
    if found == free {
        return Ok(());
    }
    let message = format!("found {}, expected {free}, one for each free parameter", counted(found, "value"));
    Err(Error::usage(message, "Give them in the order of the space."))
}

/// Like [`refine`].
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
    let mut search = Search::new(
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
            // With simulations of its own: what the balanced rounds took is not missing here.
            let mut likeliest = search.clone().at_most(EVALUATIONS_MAX);
            let ended = rounds(&mut likeliest, Weighting::Likeliest);
            if !likeliest.sacrifices(&search) {
                (search, converged) = (likeliest, ended);
            }
        }
    }
    Ok(search.finish(converged, thorough))
}
