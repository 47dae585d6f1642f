//! Refinement of a model.

use super::fitted::check;
use crate::descent::Descent;
use crate::ended::STALLED;
use crate::fit::Fit;
use crate::fitted::{Fitted as _, Sigma};
use crate::refined::{Refined, STEP_MAX};
use crate::sandwich::robust;
use crate::weights::first_sigma;
use motorfit_core::{Error, Result};
use motorfit_evaluate::model::ModelProblem;

/// Refines the values of the free parameters from a start; `initial` are those of the open states of each recording. The residuals are
/// weighted by `sigma`, a standard deviation for each recording and output; `None` estimates the weights, as for the DC motor. Standard
/// errors hold for correlated residuals.
///
/// # Errors
/// Returns `Usage` if there is not one finite value for each free parameter and open state, or one positive σ for each recording and
/// output, and `NotIdentified` if the model diverges at the start.
pub fn refine_model(
    problem: &ModelProblem,
    start: &[f64],
    initial: &[Vec<f64>],
    sigma: Option<&[Vec<f64>]>,
) -> Result<Refined> {
    check(problem, start, initial)?;
    if let Some(sigma) = sigma {
        check_sigma(problem, sigma)?;
    }
    let fit = Fit::new(problem);
    let first: Sigma = sigma.map_or_else(|| first_sigma(&fit), <[_]>::to_vec);
    let mut search = Descent::new(&fit, &fit.at(start, initial), &first).ok_or_else(|| {
        let hint = "Start elsewhere, or narrow the bounds.";
        Error::not_identified("the model diverges at the start of the refinement", hint)
    })?;
    search.stall = problem.has_kinks().then_some(STALLED);
    let (search, converged) = match sigma {
        None => search.weighed(),
        Some(_) => {
            let converged = search.run(STEP_MAX);
            (search, converged)
        }
    };
    let mut ended = search.finish(converged, true);
    ended.uncertainty = robust(&fit, &ended);
    Ok(ended)
}

/// Marks the parameters of a model with friction that sticks, or with corners such as those of a limit, as not identified where the
/// likelihood leaves them open on one side.
pub fn open_flat(problem: &ModelProblem, refined: &mut Refined) {
    if problem.model().reactions() > 0 || problem.model().has_corners() {
        crate::flat::open_flat(problem, refined);
    }
}

pub(super) fn check_sigma(problem: &ModelProblem, sigma: &[Vec<f64>]) -> Result<()> {
    let fits = sigma.len() == problem.recordings() && sigma.iter().all(|of| of.len() == problem.outputs());
    if fits && sigma.iter().flatten().all(|sigma| sigma.is_finite() && *sigma > 0.0) {
        return Ok(());
    }
    let message = format!("standard deviations of {} recordings", sigma.len());
    let (outputs, recordings) = (problem.outputs(), problem.recordings());
    let hint = format!(
        "Give {outputs} positive ones for each of {recordings} recordings; 1 for an output that was not measured."
    );
    Err(Error::usage(message, hint))
}

/// Returns the standard deviation of each output of each recording, by which a search weights residuals so that all outputs count alike.
#[doc(hidden)]
#[must_use]
pub fn signal_sigma(problem: &ModelProblem) -> Sigma {
    crate::weights::deviations(&Fit::new(problem))
}
