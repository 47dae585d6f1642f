//! Refinement of a model: the maximum-likelihood estimate with one unknown noise σ for each recording and output.

use super::covariance::{ModelUncertainty, uncertainty};
use super::descent::{Descent, Stall, Weights};
use super::fit::Fit;
use super::multistart::{STALLED, deviations};
use crate::evaluate::model::ModelProblem;
use crate::numeric::count;
use crate::{Error, Result};

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
/// Gain of the deviance below which a descent with friction that sticks ends: a tenth of a standard error.
const STALLED_DEVIANCE: f64 = 1e-2;
/// Length of the last step \[standard errors\].
const STEP: f64 = 1e-6;
/// Smallest σ relative to the deviation of the signal: below, residuals are rounding errors.
const SIGMA_MIN: f64 = 1e-9;
/// Growth of the residuals of an output, against weights by the signals, at which maximum-likelihood weights sacrifice it.
const SACRIFICED: f64 = 3.0;
/// The same where the residuals of another output almost vanish: no noise was ever that small.
const SACRIFICED_FOR: [f64; 2] = [1.2, 1e-3];

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
    /// Weights of the residuals; those of the signals too where maximum likelihood would have sacrificed an output.
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
    let mut descent = begun(&fit, start, initial)?;
    let has_stick = problem.model().reactions() > 0;
    descent.stall = has_stick.then_some(Stall { relative: STALLED, absolute: 0.0 });
    let least: Vec<f64> = descent.sigma.iter().map(|scale| SIGMA_MIN * scale).collect();
    let converged = descent.run(1e-6 * count(problem.counted()).sqrt(), SIMULATIONS);
    let freedom = freedom(&fit);
    let estimated = || Weights::Estimated { least: least.clone(), freedom };
    if weights == ModelWeights::Signals {
        descent.weigh(estimated());
        return Ok(finished(&fit, &descent, (converged, weights)));
    }
    let (by_signals, before) = (descent.normal.rms(), (descent.at.clone(), descent.normal.clone()));
    let converged = likeliest(&mut descent, problem, estimated());
    let now = descent.normal.rms();
    if is_sacrificed(&by_signals, &now) {
        // A model error would be moved to one output: the weights of the signals keep all outputs alike.
        (descent.at, descent.normal) = before;
        descent.weigh(estimated());
        return Ok(finished(&fit, &descent, (converged, ModelWeights::Signals)));
    }
    Ok(finished(&fit, &descent, (converged, weights)))
}

/// Returns true if the residuals of an output have grown for those of another one.
fn is_sacrificed(then: &[f64], now: &[f64]) -> bool {
    let any = |is: &dyn Fn(f64, f64) -> bool| now.iter().zip(then).any(|(now, then)| is(*now, *then));
    let grows = |factor: f64| any(&|now, then| now > factor * then + f64::MIN_POSITIVE);
    let [growth, rest] = SACRIFICED_FOR;
    grows(SACRIFICED) || (grows(growth) && any(&|now, then| now < rest * then))
}

/// Refines an estimate further on a problem with other steps.
///
/// # Errors
/// Returns the errors of [`refine_model`].
pub fn refine_model_again(
    problem: &ModelProblem,
    before: &ModelRefined,
    estimates_initial: bool,
) -> Result<ModelRefined> {
    let ModelRefined { values, initial, weights, .. } = before;
    if *weights == ModelWeights::Signals {
        return refine_model(problem, values, initial, (estimates_initial, *weights));
    }
    let fit = Fit { problem, estimates_initial };
    fit.check(values, initial)?;
    let mut descent = begun(&fit, values, initial)?;
    let least = descent.sigma.iter().map(|scale| SIGMA_MIN * scale).collect();
    let converged = likeliest(&mut descent, problem, Weights::Estimated { least, freedom: freedom(&fit) });
    Ok(finished(&fit, &descent, (converged, *weights)))
}

/// Begins a descent with the weights of the signals.
fn begun<'a>(fit: &'a Fit<'a>, values: &[f64], initial: &[Vec<f64>]) -> Result<Descent<'a>> {
    Descent::new(fit, fit.at(values, initial), |normal| deviations(fit.problem, normal)).ok_or_else(|| {
        let hint = "Start elsewhere, or narrow the bounds.";
        Error::not_identified("the model diverges at the start of the refinement", hint)
    })
}

/// Descends to the maximum of the likelihood.
fn likeliest(descent: &mut Descent<'_>, problem: &ModelProblem, weights: Weights) -> bool {
    descent.weigh(weights);
    let has_stick = problem.model().reactions() > 0;
    descent.stall = has_stick.then_some(Stall { relative: 0.0, absolute: STALLED_DEVIANCE });
    descent.run(STEP, SIMULATIONS)
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
        uncertainty: uncertainty(fit, descent, &free),
    }
}
