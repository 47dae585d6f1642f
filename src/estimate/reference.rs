//! A global reference: the lowest weighted sum of squares that a search over the whole box finds.

use super::multistart::{ARRIVALS, Ends, multistart};
use super::normal::Fit;
use super::projection;
use super::refine::{Effort, check_count, refine_problem};
use super::refined::Refined;
use super::starts::best_start;
use crate::evaluate::Problem;
use crate::motor::Axis;
use crate::text::counted;
use crate::{Error, Result};

/// Ways to find a reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ReferenceKind {
    /// The two-dimensional search of the linear motor, each basin refined.
    VariableProjection,
    /// Refinements from points all over the box.
    MultiStart,
}

/// The best fit within the bounds that a search of the whole box finds.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// Its settings.
    pub kind: ReferenceKind,
    /// The fit.
    pub refined: Refined,
    /// Starts that were refined.
    pub starts: usize,
    /// The number of them that ended in this fit.
    pub arrivals: usize,
}

impl Reference {
    /// Returns whether there is evidence that no other optimum is lower: the two-dimensional search covers the box, and
    /// starts all over it must lead to the same optimum at least three times.
    #[must_use]
    pub fn is_conclusive(&self) -> bool {
        self.kind == ReferenceKind::VariableProjection || self.arrivals >= ARRIVALS
    }
}

/// Basins that are refined.
const BASINS: usize = 4;

/// Searches the whole box of a problem that [`super::fit_problem`] has made for the lowest sum of squares weighted by
/// `sigma`, one pair for each recording. `known` is the sum that another search reached: starts are refined until they have
/// been there often enough, or none is left.
///
/// # Errors
/// As for [`super::refine`]; `Usage` when σ or the known sum is no number that can be; `NotIdentified` when the motor diverges
/// everywhere.
pub fn global_reference(problem: &Problem, sigma: &[[f64; 2]], known: Option<f64>) -> Result<Reference> {
    check_sigma(problem, sigma, known)?;
    let sigma = &sigma.to_vec();
    let scattered = || -> Result<Reference> {
        let Ends { refined, starts, arrivals } = multistart(problem, sigma, known)?;
        Ok(Reference { kind: ReferenceKind::MultiStart, refined, starts, arrivals })
    };
    if !projection::applies(problem) {
        return scattered();
    }
    let axes = problem.space().free();
    let in_order = |start: &[f64; 5]| axes.iter().map(|axis| start[axis.parameter as usize]).collect();
    let starts: Vec<Vec<f64>> = projection::basins(problem, sigma, BASINS).iter().map(in_order).collect();
    let refined = best_start(problem, &starts, sigma).map_or_else(|| middle(problem), |best| best.values);
    let refined = refine_problem(problem, &refined, Some(sigma), Effort::Thorough)?;
    let found = Reference { kind: ReferenceKind::VariableProjection, refined, starts: starts.len(), arrivals: 1 };
    if found.refined.at_bound.iter().any(Option::is_some) {
        // The projection knows no bounds: where one is in the way, other starts may lead around it.
        let other = scattered()?;
        if other.refined.weighted(sigma) < found.refined.weighted(sigma) {
            return Ok(other);
        }
    }
    Ok(found)
}

fn middle(problem: &Problem) -> Vec<f64> {
    problem.space().free().iter().map(Axis::middle).collect()
}

/// Returns the sums of squared residuals \[A², rad²/s²\] of each recording at `values`, one for each free parameter, initial
/// states as the problem, one that [`super::fit_problem`] has made, has them.
///
/// # Errors
/// `Usage` when `values` are not as many as free parameters.
pub fn squares_on(problem: &Problem, values: &[f64]) -> Result<Vec<[f64; 2]>> {
    check_count(problem, values)?;
    let fit = Fit::new(problem);
    Ok(fit.normal(&fit.start(values)).all_squares())
}

/// Refuses standard deviations that are not positive and finite, or not one pair for each recording.
fn check_sigma(problem: &Problem, sigma: &[[f64; 2]], known: Option<f64>) -> Result<()> {
    let recordings = problem.signals().len();
    if sigma.len() != recordings {
        let message =
            format!("found {} of σ, expected {recordings}, one for each recording", counted(sigma.len(), "pair"));
        return Err(Error::usage(message, "Give one pair for each recording, in their order."));
    }
    if let Some(wrong) = sigma.as_flattened().iter().find(|sigma| !(sigma.is_finite() && **sigma > 0.0)) {
        let message = format!("found a σ of {wrong:?}, expected a finite one above 0");
        return Err(Error::usage(
            message,
            "Give the standard deviations of current and speed; 1 for one not measured.",
        ));
    }
    if known.is_some_and(f64::is_nan) {
        return Err(Error::usage(
            "the known sum of squares is NaN, expected a number",
            "Leave it out where none is known.",
        ));
    }
    Ok(())
}
