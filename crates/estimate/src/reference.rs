//! Global reference: the lowest weighted sum of squares that a search over the complete box finds.

use super::fit::Fit;
use super::multistart::{ARRIVALS, Ends, multistart};
use super::projection;
use super::projection_grid::{Basin, basins};
use super::refine::{Effort, check_count, check_sigma, refine_problem};
use super::refined::Refined;
use super::starts::best_start;
use motorfit_core::{Error, Result};
use motorfit_evaluate::Problem;
use motorfit_motor::Axis;

/// Method of a global search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ReferenceKind {
    /// Variable projection of the linear motor on a two-dimensional grid, with each basin refined.
    VariableProjection,
    /// Multistart: refinements from points spread over the box.
    MultiStart,
}

/// The best fit within the bounds that a global search found.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// The method of the search.
    pub kind: ReferenceKind,
    /// The refined estimate.
    pub refined: Refined,
    /// Number of starts; of basins for variable projection, refined or not.
    pub starts: usize,
    /// Number of refinements that ended in this optimum; 1 for variable projection.
    pub arrivals: usize,
}

impl Reference {
    /// Returns true if there is evidence that no other optimum is lower: variable projection covers the complete box, and a
    /// multistart must have reached the optimum at least three times.
    #[must_use]
    pub fn is_conclusive(&self) -> bool {
        self.kind == ReferenceKind::VariableProjection || self.arrivals >= ARRIVALS
    }
}

/// Largest number of basins that are refined.
const BASINS: usize = 4;

/// Searches the complete box of a problem for the lowest sum of squares weighted by `sigma`, one pair of standard
/// deviations \[A, rad/s\] for each recording. The problem must be made by [`super::fit_problem`].
///
/// # Errors
/// Returns the errors of [`super::refine`]; `Usage` if a σ is not positive and finite, the number of pairs differs from
/// that of the recordings, or no parameter is free; `NotIdentified` if the motor diverges everywhere.
pub fn global_reference(problem: &Problem, sigma: &[Vec<f64>]) -> Result<Reference> {
    check_positive(problem, sigma)?;
    search(problem, sigma, None)
}

/// Searches the complete box like [`global_reference`], given a fit under the weights `sigma`. The basin of the fit, and basins
/// whose estimated lowest cost is above that of the fit, are not refined.
///
/// # Errors
/// Returns the errors of [`global_reference`].
pub fn reference_beside(problem: &Problem, sigma: &[Vec<f64>], fit: &Refined) -> Result<Reference> {
    check_positive(problem, sigma)?;
    search(problem, sigma, Some(fit))
}

fn search(problem: &Problem, sigma: &[Vec<f64>], fit: Option<&Refined>) -> Result<Reference> {
    let scattered = || -> Result<Reference> {
        let Ends { refined, starts, arrivals } = multistart(problem, sigma)?;
        Ok(Reference { kind: ReferenceKind::MultiStart, refined, starts, arrivals })
    };
    if !projection::applies(problem) {
        return scattered();
    }
    let (refined, starts) = projected(problem, sigma, fit)?;
    let found = Reference { kind: ReferenceKind::VariableProjection, refined, starts, arrivals: 1 };
    if found.refined.at_bound.iter().any(Option::is_some) {
        // The projection ignores the bounds. Where the refinement ends at one, a multistart may find a lower optimum.
        let other = scattered()?;
        if other.refined.weighted(sigma) < found.refined.weighted(sigma) {
            return Ok(other);
        }
    }
    Ok(found)
}

/// Returns the lowest optimum of the basins of the projection, and the number of basins.
fn projected(problem: &Problem, sigma: &[Vec<f64>], fit: Option<&Refined>) -> Result<(Refined, usize)> {
    let mut basins = basins(problem, sigma, BASINS);
    let starts = basins.len();
    // Costs at rounded times are not those of the fit.
    let is_exact = !problem.signals().iter().any(|signals| signals.has_many_steps());
    let own = fit.filter(|fit| is_exact && fit.converged).filter(|fit| {
        let holds = |basin: &Basin| basin.holds(&problem.parameters(&fit.values, 0), fit.weighted(sigma));
        basins.iter().filter(|basin| holds(basin)).count() == 1
    });
    if let Some(own) = own {
        let cost = own.weighted(sigma);
        basins.retain(|basin| !basin.holds(&problem.parameters(&own.values, 0), cost) && basin.may_reach(cost));
    }
    let axes = problem.space().free();
    let in_order = |basin: &Basin| axes.iter().map(|axis| basin.motor[axis.parameter as usize]).collect();
    let best = best_start(problem, &basins.iter().map(in_order).collect::<Vec<_>>(), sigma);
    let best = match (own, best) {
        (Some(own), Some(best)) if best.weighted(sigma) < own.weighted(sigma) => best.values,
        (Some(own), _) => return Ok((own.clone(), starts)),
        (None, best) => best.map_or_else(|| middle(problem), |best| best.values),
    };
    Ok((refine_problem(problem, &best, Some(sigma), Effort::Thorough)?, starts))
}

fn middle(problem: &Problem) -> Vec<f64> {
    problem.space().free().iter().map(Axis::middle).collect()
}

/// Returns the sums of squared residuals \[A², rad²/s²\] of each recording at `values`, one for each free parameter, from
/// the initial states of the problem. The problem must be made by [`super::fit_problem`].
///
/// # Errors
/// Returns `Usage` if the number of `values` is not that of the free parameters.
pub fn residual_squares(problem: &Problem, values: &[f64]) -> Result<Vec<Vec<f64>>> {
    check_count(problem, values)?;
    let fit = Fit::new(problem);
    let squares = fit.normal(&fit.start(values)).map(|normal| normal.all_squares());
    Ok(squares.unwrap_or_else(|| vec![vec![f64::INFINITY; 2]; problem.signals().len()]))
}

/// Returns an error if a standard deviation is not positive and finite, or there is not one pair for each recording.
fn check_positive(problem: &Problem, sigma: &[Vec<f64>]) -> Result<()> {
    check_sigma(problem, sigma)?;
    if let Some(wrong) = sigma.iter().flatten().find(|sigma| !(sigma.is_finite() && **sigma > 0.0)) {
        let message = format!("found a σ of {wrong:?}, expected a finite one above 0");
        return Err(Error::usage(
            message,
            "Give the standard deviations of current and speed; 1 for a channel that was not measured.",
        ));
    }
    Ok(())
}
