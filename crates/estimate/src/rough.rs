//! Rough refinements that compare starts: to a hundredth of a standard error under given weights.
//!
//! A motor with extensions needs a one-step map with derivatives for every distinct step length. On an irregular clock
//! nearly every sample has its own length, and the maps take several times as long as the simulation. A rough refinement
//! there runs on rounded times first and ends on the recorded times.

use super::refine::{Effort, check_plain, refine_problem};
use super::refined::Refined;
use motorfit_core::Result;
use motorfit_evaluate::Problem;
use rayon::prelude::*;

/// Refines like [`super::refine_on`], but only to a hundredth of a standard error, under the weights `sigma` and without a
/// test of the residuals. It serves to compare starts.
///
/// # Errors
/// Propagates the errors of [`super::refine_on`].
pub fn refine_coarse(problem: &Problem, start: &[f64], sigma: &[Vec<f64>]) -> Result<Refined> {
    check_plain(problem)?;
    RoughProblem::new(problem).refine(start, sigma)
}

/// Difference of two sums of squares, in units of σ², up to which they belong to one optimum: a rough refinement ends
/// within a hundredth of a standard error.
const SAME: f64 = 0.01;
/// Difference relative to the lower sum, added to [`SAME`].
const SAME_RELATIVE: f64 = 1e-6;
/// Ratio of an optimum on rounded times to the lowest one above which it is discarded.
const FAR: f64 = 1.5;
/// Largest number of optima on rounded times that are refined on the recorded times.
const OPTIMA: usize = 4;

/// Returns true if a sum of squares, in units of σ², belongs to the lowest optimum.
pub(super) fn is_same(cost: f64, lowest: f64) -> bool {
    cost <= lowest + SAME + SAME_RELATIVE * lowest
}

/// A problem for rough refinements of many starts.
pub(super) struct RoughProblem<'a> {
    problem: &'a Problem,
    /// The problem with rounded times; `None` if rounding would save little.
    coarse: Option<Problem>,
}

impl<'a> RoughProblem<'a> {
    pub(super) fn new(problem: &'a Problem) -> Self {
        let is_faster_rounded = !problem.features().is_linear() && problem.signals().iter().any(|s| s.has_many_steps());
        Self { problem, coarse: is_faster_rounded.then(|| problem.at_coarse_steps()) }
    }

    /// Refines a start on rounded times, or on the recorded times if there is no rounded problem.
    ///
    /// # Errors
    /// Propagates the errors of [`super::refine`].
    pub(super) fn approach(&self, start: &[f64], sigma: &[Vec<f64>]) -> Result<Refined> {
        refine_problem(self.coarse.as_ref().unwrap_or(self.problem), start, Some(sigma), Effort::Rough)
    }

    /// Refines estimates on the recorded times, once for all that ended in the same optimum, and returns each optimum with
    /// the number of its starts. Optima far above the lowest are discarded.
    pub(super) fn ends(&self, near: &[Refined], sigma: &[Vec<f64>]) -> Vec<(Refined, usize)> {
        if self.coarse.is_none() {
            return near.iter().map(|end| (end.clone(), 1)).collect();
        }
        let mut ordered: Vec<(f64, &Refined)> = near.iter().map(|end| (end.weighted(sigma), end)).collect();
        ordered.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut optima: Vec<(f64, &Refined, usize)> = Vec::new();
        for (cost, end) in ordered {
            let lowest = optima.first().map_or(cost, |optimum| optimum.0);
            match optima.last_mut() {
                Some(optimum) if is_same(cost, optimum.0) => optimum.2 += 1,
                _ if cost <= FAR * lowest => optima.push((cost, end, 1)),
                _ => break,
            }
        }
        optima.truncate(OPTIMA);
        let exact = |(_, end, count): &(f64, &Refined, usize)| {
            Some((refine_problem(self.problem, &end.values, Some(sigma), Effort::Rough).ok()?, *count))
        };
        optima.par_iter().filter_map(exact).collect()
    }

    /// Refines a start and ends on the recorded times.
    ///
    /// # Errors
    /// Propagates the errors of [`super::refine`].
    pub(super) fn refine(&self, start: &[f64], sigma: &[Vec<f64>]) -> Result<Refined> {
        let near = self.approach(start, sigma)?;
        if self.coarse.is_none() {
            return Ok(near);
        }
        refine_problem(self.problem, &near.values, Some(sigma), Effort::Rough)
    }
}
