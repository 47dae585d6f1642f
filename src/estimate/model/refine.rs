//! Refinement of a model: the maximum-likelihood estimate with one unknown noise σ for each recording and output.

use super::covariance::{ModelUncertainty, uncertainty};
use super::descent::Descent;
use super::fit::{Fit, Normal};
use super::multistart::deviations;
use crate::evaluate::model::ModelProblem;
use crate::numeric::count;
use crate::{Error, Result};

/// Weights of the residuals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ModelWeights {
    /// The inverse variance of the residuals of each recording and output, estimated in rounds.
    #[default]
    MaximumLikelihood,
    /// The inverse variance of the measured signals.
    Signals,
}

/// Rounds of weights at most, and the relative change of σ that ends them.
const ROUNDS: usize = 30;
const SIGMA_CHANGE: f64 = 1e-7;
/// Simulations of a round at most.
const SIMULATIONS: usize = 60;
/// Simulations of a round at most for friction that sticks: descents that need more do not end.
const SIMULATIONS_STICKING: usize = 25;
/// Length of the last step \[standard errors\].
const STEP: f64 = 1e-6;
/// Smallest σ relative to the deviation of the signal: below, residuals are rounding errors.
const SIGMA_MIN: f64 = 1e-9;
/// Growth of the residuals of an output, against weights by the signals, at which maximum-likelihood weights sacrifice it.
const SACRIFICED: f64 = 3.0;

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
    let at = fit.at(start, initial);
    let Some(mut descent) = Descent::new(&fit, at, |normal| deviations(problem, normal)) else {
        let hint = "Start elsewhere, or narrow the bounds.";
        return Err(Error::not_identified("the model diverges at the start of the refinement", hint));
    };
    let scale = descent.sigma.clone();
    let simulations = if problem.model().reactions() > 0 { SIMULATIONS_STICKING } else { SIMULATIONS };
    let mut converged = descent.run(1e-6 * count(problem.counted()).sqrt(), 2 * simulations);
    let by_signals = descent.normal.rms();
    let floor = |normal: &Normal, freedom: f64| -> Vec<f64> {
        normal.rms().iter().zip(&scale).map(|(rms, scale)| (rms / freedom.sqrt()).max(SIGMA_MIN * scale)).collect()
    };
    let freedom = 1.0 - (count(fit.unknowns()) / count(problem.counted())).min(0.9);
    let before = (descent.at.clone(), descent.normal.clone());
    descent.sigma = floor(&descent.normal, freedom);
    if weights == ModelWeights::MaximumLikelihood {
        for _ in 0..ROUNDS {
            converged = descent.run(STEP, simulations);
            let sigma = floor(&descent.normal, freedom);
            let change = sigma.iter().zip(&descent.sigma).map(|(new, old)| (new / old - 1.0).abs()).fold(0.0, f64::max);
            descent.sigma = sigma;
            if change < SIGMA_CHANGE {
                break;
            }
        }
        let is_sacrificed = descent
            .normal
            .rms()
            .iter()
            .zip(&by_signals)
            .any(|(now, then)| *now > SACRIFICED * then + f64::MIN_POSITIVE);
        if is_sacrificed {
            // A model error would be moved to one output: the weights of the signals keep all outputs alike.
            (descent.at, descent.normal) = before;
            descent.sigma = floor(&descent.normal, freedom);
        }
    }
    Ok(finished(&fit, &descent, converged))
}

fn finished(fit: &Fit<'_>, descent: &Descent<'_>, converged: bool) -> ModelRefined {
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
        evaluations: descent.evaluations,
        uncertainty: uncertainty(fit, descent, &free),
    }
}
