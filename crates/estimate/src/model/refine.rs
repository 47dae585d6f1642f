//! Refinement of a model: the maximum-likelihood estimate with one unknown noise σ for each recording and output.

use super::covariance::{ModelUncertainty, uncertainty};
use super::descent::{Descent, Weights};
use super::fit::{Fit, Normal};
use super::search::NOISY;
use motorfit_core::numeric::{count, noise_sigma};
use motorfit_core::{Error, Result};
use motorfit_evaluate::model::ModelProblem;

/// Weights of the residuals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ModelWeights {
    /// The inverse variance of the residuals of each recording and output, estimated with the parameters.
    #[default]
    MaximumLikelihood,
    /// The inverse variance of the measured signals.
    Signals,
}

/// Simulations of a descent at most.
const SIMULATIONS: usize = 120;
/// The same for the maximum of the likelihood from residuals far above the noise.
const SIMULATIONS_FAR: usize = 12;
/// Part of the cost below which the gain of such a descent with the weights of the signals ends it: errors of a model are correlated, and
/// standard errors are far wider than those of white noise.
const STALLED: f64 = 1e-4;
/// Gain of the deviance below which a descent with friction that sticks ends: a tenth of a standard error.
const STALLED_DEVIANCE: f64 = 1e-2;
/// Length of the last step \[standard errors\].
const STEP: f64 = 1e-6;
/// Smallest σ relative to the deviation of the signal: below, residuals are rounding errors.
const SIGMA_MIN: f64 = 1e-9;

/// A refined estimate of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelRefined {
    /// Values of the free parameters.
    pub values: Vec<f64>,
    /// Initial values of the open states of each recording, in their units.
    pub initial: Vec<Vec<f64>>,
    /// Root mean square of the residuals of each recording and output; `None` for an output that was not measured.
    pub residual_rms: Vec<Vec<Option<f64>>>,
    /// Standard deviation that each output was weighted by.
    pub sigma: Vec<Vec<Option<f64>>>,
    /// Weights of the residuals: those of the signals too where residuals are far above the noise.
    pub weights: ModelWeights,
    /// Bound that each free parameter ended at.
    pub at_bound: Vec<Option<&'static str>>,
    /// True if the descent converged.
    pub converged: bool,
    /// Number of simulations with derivatives.
    pub evaluations: usize,
    /// Standard errors and what follows from them.
    pub uncertainty: ModelUncertainty,
}

/// Refines the values of the free parameters from a start; `initial` are those of the open states of each recording.
///
/// # Errors
/// Returns `Usage` if there is not one finite value for each free parameter and open state, and `NotIdentified` if the model diverges at
/// the start.
pub fn refine_model(
    problem: &ModelProblem,
    start: &[f64],
    initial: &[Vec<f64>],
    (estimates_initial, weights): (bool, ModelWeights),
) -> Result<ModelRefined> {
    let fit = Fit { problem, estimates_initial };
    fit.check(start, initial)?;
    let (descent, least) = begun(&fit, start, initial)?;
    let (descent, converged) = by_signals(&fit, descent);
    Ok(match weights {
        ModelWeights::Signals => finished(&fit, &descent, (converged, weights)),
        ModelWeights::MaximumLikelihood => maximum_likelihood(&fit, descent, least, converged),
    })
}

/// Refines values that are near an optimum: that of the signals' weights, or an estimate with other steps or of a model that is
/// contained. [`refine_model`] first descends with the weights of the signals, which leads away from the likeliest values.
///
/// # Errors
/// Returns the errors of [`refine_model`].
pub fn refine_model_near(
    problem: &ModelProblem,
    start: &[f64],
    initial: &[Vec<f64>],
    estimates_initial: bool,
) -> Result<ModelRefined> {
    let fit = Fit { problem, estimates_initial };
    fit.check(start, initial)?;
    let (descent, least) = begun(&fit, start, initial)?;
    let (descent, converged) =
        if is_far(problem, &descent.normal) { by_signals(&fit, descent) } else { (descent, true) };
    Ok(maximum_likelihood(&fit, descent, least, converged))
}

/// Begins a descent with the weights of the signals; returns the smallest σ of each block beside it.
fn begun<'a>(fit: &'a Fit<'a>, values: &[f64], initial: &[Vec<f64>]) -> Result<(Descent<'a>, Vec<f64>)> {
    let descent = Descent::new(fit, fit.at(values, initial), |normal| fit.deviations(normal));
    let descent = descent.ok_or_else(|| {
        let hint = "Start elsewhere, or narrow the bounds.";
        Error::not_identified("the model diverges at the start of the refinement", hint)
    })?;
    let least = descent.sigma.iter().map(|scale| SIGMA_MIN * scale).collect();
    Ok((descent, least))
}

/// Descends with the weights of the signals; returns true if the descent converged.
fn by_signals<'a>(fit: &Fit<'_>, mut descent: Descent<'a>) -> (Descent<'a>, bool) {
    let has_stick = fit.problem.model().reactions() > 0;
    descent.stall = has_stick.then_some(STALLED);
    let converged = descent.run(1e-6 * count(fit.problem.counted()).sqrt(), SIMULATIONS);
    (descent, converged)
}

/// Descends to the maximum of the likelihood from an optimum of the signals' weights, if its residuals are noise. Residuals far above the
/// noise are a model error, which maximum likelihood would move to one output or recording: one that is fitted badly gets a smaller
/// weight, and is fitted worse.
fn maximum_likelihood(fit: &Fit<'_>, mut descent: Descent<'_>, least: Vec<f64>, converged: bool) -> ModelRefined {
    let before = (descent.at.clone(), descent.normal.clone(), descent.sigma.clone());
    // The noise of one output may move the parameters so that others leave more than theirs: a few steps show it.
    let tried = if is_far(fit.problem, &descent.normal) { SIMULATIONS_FAR } else { SIMULATIONS };
    descent.weigh(Weights::Estimated { least, freedom: freedom(fit) });
    let has_stick = fit.problem.model().reactions() > 0;
    descent.stall = has_stick.then_some(STALLED_DEVIANCE);
    let mut is_at_maximum = descent.run(STEP, tried);
    let mut is_error = is_far(fit.problem, &descent.normal);
    if !is_at_maximum && !is_error && tried < SIMULATIONS {
        is_at_maximum = descent.run(STEP, SIMULATIONS);
        is_error = is_far(fit.problem, &descent.normal);
    }
    if is_error {
        (descent.at, descent.normal, descent.sigma) = before;
        descent.weigh(Weights::Given);
        return finished(fit, &descent, (converged, ModelWeights::Signals));
    }
    finished(fit, &descent, (is_at_maximum, ModelWeights::MaximumLikelihood))
}

/// Returns true if the residuals of a recording and output are far above its noise.
fn is_far(problem: &ModelProblem, normal: &Normal) -> bool {
    normal.blocks.iter().zip(normal.rms()).any(|(block, rms)| {
        let measured = problem.recording(block.recording).measured[block.output].as_deref();
        rms > NOISY * noise_sigma(measured.unwrap_or_default())
    })
}

/// Returns the degrees of freedom of the residuals, as a part of their number.
fn freedom(fit: &Fit<'_>) -> f64 {
    1.0 - (count(fit.unknowns()) / count(fit.problem.counted())).min(0.9)
}

fn finished(fit: &Fit<'_>, descent: &Descent<'_>, (converged, weights): (bool, ModelWeights)) -> ModelRefined {
    let problem = fit.problem;
    let outputs = problem.model().outputs().len();
    let mut residual_rms = vec![vec![None; outputs]; problem.recordings()];
    let mut sigma = residual_rms.clone();
    for ((block, rms), own) in descent.normal.blocks.iter().zip(descent.normal.rms()).zip(&descent.sigma) {
        residual_rms[block.recording][block.output] = Some(rms);
        sigma[block.recording][block.output] = Some(*own);
    }
    let free = descent.free();
    ModelRefined {
        values: fit.values(&descent.at),
        initial: (0..problem.recordings()).map(|n| fit.initial(&descent.at, n)).collect(),
        residual_rms,
        sigma,
        at_bound: (0..fit.axes()).map(|n| if free.contains(&n) { None } else { descent.bound(n) }).collect(),
        converged,
        weights,
        evaluations: descent.evaluations,
        uncertainty: uncertainty(fit, descent, &free, weights == ModelWeights::MaximumLikelihood),
    }
}
