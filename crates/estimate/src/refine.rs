//! Refinement: output-error Levenberg–Marquardt in the coordinates of the parameters, within the bounds of the space.
//!
//! The cost is the weighted sum of squares `Σ_r Σ_c Σ_n e²/σ_rc²` over recordings and channels, which is twice the negative
//! log-likelihood of white Gaussian noise of known σ up to a constant. If σ is not given, it is estimated from the residuals in
//! rounds of reweighting until it converges; the fixed point is the maximum-likelihood estimate, unless a model error would
//! sacrifice a channel, where balanced weights are kept ([`super::weights`]).

use super::descent::Descent;
use super::ended::STEP_MAX_ROUND;
use super::fit::Fit;
use super::refined::{Refined, STEP_MAX};
use super::weights::first_sigma;
use motorfit_core::setting::text;
use motorfit_core::text::counted;
use motorfit_core::{Error, Result};
use motorfit_evaluate::criterion::{Criterion, Norm, Scale};
use motorfit_evaluate::{Model, Problem};
use motorfit_motor::Space;
use motorfit_record::Record;

/// Options of a refinement.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RefineOptions {
    /// The simulation model.
    pub model: Model,
    /// Noise σ of current \[A\] and speed \[rad/s\] of each recording; `None` estimates it from the residuals.
    pub sigma: Option<Vec<Vec<f64>>>,
}

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
pub fn refine_on(problem: &Problem, start: &[f64], sigma: Option<&[Vec<f64>]>) -> Result<Refined> {
    check_plain(problem)?;
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

/// Effort of a refinement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Effort {
    /// Ends at a hundredth of a standard error, under the initial weights.
    Rough,
    /// Ends at 1e-6 standard errors, under weights from the residuals unless σ is given.
    Thorough,
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
    sigma: Option<&[Vec<f64>]>,
    effort: Effort,
) -> Result<Refined> {
    check_count(problem, start)?;
    sigma.map_or(Ok(()), |sigma| check_sigma(problem, sigma))?;
    let fit = Fit::new(problem);
    let mut axes = problem.space().free().iter().zip(start);
    if let Some((axis, value)) = axes.find(|(axis, value)| !axis.parameter.admits(**value)) {
        let parameter = axis.parameter;
        let message =
            format!("found {value:?} as the start of {}, expected a {} value", parameter.symbol(), parameter.domain());
        return Err(Error::usage(message, "Give one value per free parameter, positive for R, L, K, B and J."));
    }
    let first = sigma.map_or_else(|| first_sigma(&fit), <[_]>::to_vec);
    let Some(search) = Descent::new(&fit, &fit.start(start), &first) else {
        return Err(Error::not_identified(
            "the simulated motor diverges at the start of the refinement",
            text!("Start elsewhere, or use " [Discretization = "zoh"] ", which is stable for every motor."),
        ));
    };
    Ok(match (effort, sigma) {
        (Effort::Thorough, None) => {
            let (search, converged) = search.weighed();
            search.finish(converged, true)
        }
        (Effort::Thorough, Some(_)) => under(search, STEP_MAX, true),
        (Effort::Rough, _) => under(search.at_most(EVALUATIONS_ROUGH), STEP_MAX_ROUND, false),
    })
}

/// Descends under the present weights.
fn under(mut search: Descent<'_>, tolerance: f64, is_tested: bool) -> Refined {
    let converged = search.run(tolerance);
    search.finish(converged, is_tested)
}

/// Returns an error if there is not one pair of standard deviations for each recording.
pub(super) fn check_sigma(problem: &Problem, sigma: &[Vec<f64>]) -> Result<()> {
    let recordings = problem.signals().len();
    if sigma.len() != recordings {
        let message =
            format!("found {} of σ, expected {recordings}, one for each recording", counted(sigma.len(), "pair"));
        return Err(Error::usage(message, "Give one pair for each recording, in the order of the recordings."));
    }
    if let Some(wrong) = sigma.iter().find(|of| of.len() != 2) {
        let message = format!("found {} of σ for a recording, expected 2", counted(wrong.len(), "value"));
        return Err(Error::usage(message, "Give the standard deviations of current and speed."));
    }
    Ok(())
}
