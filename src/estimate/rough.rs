//! Rough refinements, to compare starts: to a hundredth of a standard error under given weights.
//!
//! A motor with extensions needs the map of every distinct step with its derivatives. On an irregular clock nearly every sample
//! has its own, which takes several times as long as the samples do. There a refinement goes most of its way on rounded
//! times, and only the rest on the true ones.

use super::refine::{Effort, check_plain, refine_problem};
use super::refined::Refined;
use crate::Result;
use crate::evaluate::Problem;
use rayon::prelude::*;

/// Refines like [`super::refine_on`], to a hundredth of a standard error under the weights `sigma`, without a test of the residuals: to
/// compare starts.
///
/// # Errors
/// As [`super::refine_on`].
pub fn refine_roughly(problem: &Problem, start: &[f64], sigma: &[[f64; 2]]) -> Result<Refined> {
    check_plain(problem)?;
    RoughProblem::new(problem).refine(start, sigma)
}

/// Sums of squares in units of σ² that differ by less than this, or this part, are of one optimum: a rough refinement ends
/// within a hundredth of a standard error.
const SAME: f64 = 0.01;
const SAME_PART: f64 = 1e-6;
/// An optimum on rounded times is far above the lowest when its sum of squares is so many times as large.
const FAR: f64 = 1.5;
/// Optima on rounded times that are refined on the true ones at most.
const OPTIMA: usize = 4;

/// Returns whether a sum of squares in units of σ² is not above another.
pub(super) fn is_same(cost: f64, lowest: f64) -> bool {
    cost <= lowest + SAME + SAME_PART * lowest
}

/// A problem for rough refinements of many starts.
pub(super) struct RoughProblem<'a> {
    problem: &'a Problem,
    /// The same with rounded times, where that is worth it.
    coarse: Option<Problem>,
}

impl<'a> RoughProblem<'a> {
    pub(super) fn new(problem: &'a Problem) -> Self {
        let is_worth = !problem.features().is_linear() && problem.signals().iter().any(|s| s.has_many_steps());
        Self { problem, coarse: is_worth.then(|| problem.at_coarse_steps()) }
    }

    /// Refines a start on rounded times, or at once on the true ones where none are rounded.
    ///
    /// # Errors
    /// As [`super::refine`].
    pub(super) fn approach(&self, start: &[f64], sigma: &[[f64; 2]]) -> Result<Refined> {
        refine_problem(self.coarse.as_ref().unwrap_or(self.problem), start, Some(sigma), Effort::Rough)
    }

    /// Refines on the true times what starts led to on rounded ones, once for all that ended in the same optimum, and returns each
    /// optimum with their number. Optima far above the lowest are left out.
    pub(super) fn ends(&self, near: &[Refined], sigma: &[[f64; 2]]) -> Vec<(Refined, usize)> {
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

    /// Refines a start, at last on the true times.
    ///
    /// # Errors
    /// As [`super::refine`].
    pub(super) fn refine(&self, start: &[f64], sigma: &[[f64; 2]]) -> Result<Refined> {
        let near = self.approach(start, sigma)?;
        if self.coarse.is_none() {
            return Ok(near);
        }
        refine_problem(self.problem, &near.values, Some(sigma), Effort::Rough)
    }
}
