//! Stage 4, refine: refines the best start to the maximum-likelihood estimate. A population search runs if it is requested, or
//! if no start leads to a fit.

use super::bic::is_far;
use super::method::{Method, Polish};
use super::prepare::Prepared;
use super::search::{SearchResult, evaluated, population, taken};
use super::spec::IdentifySpec;
use super::start::Start;
use crate::analysis::fit_percent;
use motorfit_core::Result;
use motorfit_estimate::{Estimate, Refined, SmFailure, best_start, coordinate_searched, delay_starts, refine_on};
use motorfit_evaluate::Problem;
use motorfit_motor::{Axis, Space};
use motorfit_optimize::Progress;
use std::ops::ControlFlow;
use std::sync::Arc;

/// An observer that is called after each generation and may end the search.
pub(super) type Observer<'a> = dyn FnMut(&Progress) -> ControlFlow<()> + Send + 'a;

/// A first optimum with its refinement.
pub(super) struct Fit {
    pub found: SearchResult,
    /// Problem of the search.
    pub problem: Arc<Problem>,
    pub refined: Refined,
    /// Space of the refinement, with widened bounds.
    pub space: Space,
}

impl Fit {
    /// Returns R, L, K, B and J of the first recording.
    pub(super) fn motor(&self) -> [f64; 5] {
        self.space.parameters(&self.refined.values, 0).to_array()
    }

    /// Returns true if a parameter of the motor is at a bound, or the fit of some channel is below 50 %.
    fn is_poor(&self, prepared: &Prepared<'_>) -> bool {
        let fit = fit_percent(prepared.records, &self.refined);
        // A parameter of an extension at a bound without effect does not indicate a wrong optimum.
        let sides = self.space.free().iter().zip(&self.refined.at_bound);
        let stuck = sides.filter(|(axis, _)| !axis.parameter.is_extension()).any(|(_, side)| side.is_some());
        stuck || fit.iter().flatten().any(|percent| *percent < 50.0)
    }

    /// Returns `other`, which comes from a population search, if its sum of squares in units of `sigma` is lower by more than the
    /// tolerance: an optimum that both reach is that of the estimate.
    fn or_lower(mut self, other: Self, sigma: &[Vec<f64>]) -> Self {
        /// Relative difference of sums of squares at the same optimum, after refinements from two starts.
        const SAME: f64 = 1e-6;
        self.found.has_population = true;
        if other.refined.weighted(sigma) < (1.0 - SAME) * self.refined.weighted(sigma) { other } else { self }
    }
}

/// Fits a model from its starts, or uses the `optimum` of the model selection if there is one.
///
/// # Errors
/// Propagates the errors of the search and the refinement.
pub(super) fn fit(
    prepared: &Prepared<'_>,
    start: &Start,
    model: &Space,
    optimum: Option<Refined>,
    observe: &mut Observer<'_>,
) -> Result<Fit> {
    if !prepared.is_linear() {
        return match optimum.filter(|_| !prepared.spec.method.is_search() && prepared.spec.is_polished()) {
            Some(refined) => {
                let (problem, space) = (prepared.searched(model.clone()), model.clone());
                let found = evaluated(&problem, &prepared.spec, refined.values.clone())?;
                Ok(Fit { found, problem, refined, space })
            }
            None => from_motors(prepared, &start.motors, model, observe),
        };
    }
    let fit = from_estimate(prepared, &start.estimate, model, observe)?;
    if prepared.spec.method != Method::Auto || start.estimate.is_err() || !fit.is_poor(prepared) {
        return Ok(fit);
    }
    // If the estimate leads to a poor fit, a population search may find a better optimum.
    let other = from_estimate(prepared, &Err(SmFailure::PoorFit), &prepared.spec.space, observe)?;
    let sigma = fit.refined.weights.clone();
    Ok(fit.or_lower(other, &sigma))
}

/// Fits the linear motor from its Steiglitz–McBride estimate, or from a population search if that is requested or there is no
/// estimate.
fn from_estimate(
    prepared: &Prepared<'_>,
    estimate: &std::result::Result<Estimate, SmFailure>,
    space: &Space,
    observe: &mut Observer<'_>,
) -> Result<Fit> {
    let spec = prepared.spec.as_ref();
    let problem = prepared.searched(space.clone());
    let found = match (spec.method, estimate) {
        (Method::SteiglitzMcBride, Err(failure)) => return Err((*failure).into()),
        (Method::Auto | Method::SteiglitzMcBride, Ok(estimate)) => taken(estimate, spec, &problem)?,
        _ => population(&problem, spec, observe)?,
    };
    from_search(prepared, &problem, found, Vec::new())
}

/// Largest number of candidate-steps of a population search that was not requested, about one second.
const AFFORDABLE: usize = 1_000_000_000;

/// Fits a model from initial estimates of the motor: the parameters of extensions start from grids along their axes, and the
/// best start is refined. A population search runs instead if it is requested or there is no polish, and afterwards if the fit
/// is poor, or if its residuals are far above the noise and the search is affordable.
fn from_motors(prepared: &Prepared<'_>, motors: &[[f64; 5]], space: &Space, observe: &mut Observer<'_>) -> Result<Fit> {
    let spec = prepared.spec.as_ref();
    let problem = prepared.searched(space.clone());
    let mut searched = |starts: Vec<Vec<f64>>| -> Result<Fit> {
        from_search(prepared, &problem, population(&problem, spec, observe)?, starts)
    };
    if spec.method.is_search() || spec.polish == Polish::None {
        return searched(Vec::new());
    }
    let starts = delay_starts(&problem, motors)?;
    let found = evaluated(&problem, spec, starts.first().cloned().unwrap_or_default())?;
    let fit = from_starts(prepared, &problem, found, &starts)?;
    if spec.method == Method::SteiglitzMcBride {
        return Ok(fit);
    }
    let affordable = problem.active().saturating_mul(spec.population * spec.generations) <= AFFORDABLE;
    let doubtful = affordable && is_far(problem.as_ref(), &fit.refined);
    if !doubtful && !fit.is_poor(prepared) {
        return Ok(fit);
    }
    Ok(fit.or_lower(searched(starts)?, prepared.deviations()))
}

/// Refines the best of the optimum of a search, of the starts for delays that follow from it, and of `others`. The linear motor
/// is refined from the optimum only.
pub(super) fn from_search(
    prepared: &Prepared<'_>,
    problem: &Arc<Problem>,
    found: SearchResult,
    others: Vec<Vec<f64>>,
) -> Result<Fit> {
    if prepared.is_linear() {
        let (refined, space) = refine_widening(prepared.plain(), &prepared.spec, problem.space(), &found.values)?;
        return Ok(Fit { found, problem: problem.clone(), refined, space });
    }
    let own = std::iter::once(found.values.clone()).chain(coordinate_searched(problem, &found.values)?);
    let starts: Vec<Vec<f64>> = own.chain(others).collect();
    from_starts(prepared, problem, found, &starts)
}

/// Refines the best of several starts.
fn from_starts(
    prepared: &Prepared<'_>,
    problem: &Arc<Problem>,
    found: SearchResult,
    starts: &[Vec<f64>],
) -> Result<Fit> {
    let plain = prepared.fitted(problem.space());
    let rough = best_start(&plain, starts, prepared.deviations());
    let values = rough.map_or_else(|| found.values.clone(), |rough| rough.values);
    let (refined, space) = refine_widening(&plain, &prepared.spec, problem.space(), &values)?;
    Ok(Fit { found, problem: problem.clone(), refined, space })
}

/// Largest number of times that automatic bounds are widened because the refinement ends at them.
const WIDENINGS: usize = 4;

/// Refines `values`, widens automatic bounds at which the refinement ends, and returns the refinement with its space. `plain`
/// is the problem of a fit.
pub(super) fn refine_widening(
    plain: &Problem,
    spec: &IdentifySpec,
    space: &Space,
    values: &[f64],
) -> Result<(Refined, Space)> {
    let mut space = space.clone();
    let mut refined = refine_on(&plain.with_space(space.clone()), values, None)?;
    let widens = spec.polish == Polish::LevenbergMarquardt;
    for _ in 0..if widens { WIDENINGS } else { 0 } {
        let wider = |(axis, side): (&Axis, &Option<&str>)| match side {
            Some("min") if spec.auto_bounds.contains(&axis.parameter) => Axis { min: 0.1 * axis.min, ..*axis },
            Some(_) if spec.auto_bounds.contains(&axis.parameter) => Axis { max: 10.0 * axis.max, ..*axis },
            _ => *axis,
        };
        let free: Vec<Axis> = space.free().iter().zip(&refined.at_bound).map(wider).collect();
        if free == space.free() {
            break;
        }
        space = Space::new(free, space.fixed().to_vec())?;
        refined = refine_on(&plain.with_space(space.clone()), &refined.values, None)?;
    }
    Ok((refined, space))
}
