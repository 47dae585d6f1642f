//! Ranks of searches over the problems of a suite, with tests.

use super::definition::SuiteProblem;
use super::gap::GAP_MIN;
use super::run::{SuiteBlock, SuiteResult, SuiteRun};
use crate::statistics::{holm, wilcoxon};
use motorfit_core::numeric::{count, mean, quantile, sorted};

/// Mean ranks of the searches over the problems of a budget.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct SuiteRanks {
    /// Mean rank of each entrant over problems, 1 for the lowest median gap; ties have the mean of their ranks.
    pub mean_rank: Vec<f64>,
    /// Index of the entrant with the lowest mean rank.
    pub first: usize,
    /// p-value of Wilcoxon's signed-rank test over problems of each entrant against the first, with Holm's correction; NaN for the
    /// first itself.
    pub p_holm: Vec<f64>,
}

/// Returns the ranks of values, the lowest 1; ties have the mean of their ranks.
fn ranks(values: &[f64]) -> Vec<f64> {
    let below = |value: f64| count(values.iter().filter(|other| **other < value).count());
    let ties = |value: f64| count(values.iter().filter(|other| other.total_cmp(&value).is_eq()).count());
    values.iter().map(|value| below(*value) + 0.5 * (ties(*value) + 1.0)).collect()
}

impl SuiteResult {
    /// Returns the median gap of each entrant on each problem of a budget, at least 1e-8, shape `[problems][entrants]`.
    #[must_use]
    pub fn median_gaps(&self, budget: usize) -> Vec<Vec<f64>> {
        let of = |(problem, block): (&SuiteProblem, &SuiteBlock)| {
            let gap = |run: &SuiteRun| problem.gap(run.cost());
            let median = |runs: &[SuiteRun]| quantile(&sorted(&runs.iter().map(gap).collect::<Vec<_>>()), 0.5);
            (0..self.spec.entrants.len()).map(|entrant| median(block.of(entrant)).max(GAP_MIN)).collect()
        };
        self.of_budget(budget).map(of).collect()
    }

    /// Ranks the searches at a budget by their median gaps on each problem; `None` without a complete problem.
    #[must_use]
    pub fn ranks(&self, budget: usize) -> Option<SuiteRanks> {
        let gaps = self.median_gaps(budget);
        let by_problem: Vec<Vec<f64>> = gaps.iter().map(|gaps| ranks(gaps)).collect();
        let entrants = by_problem.first()?.len();
        let rank = |entrant: usize| mean(&by_problem.iter().map(|ranks| ranks[entrant]).collect::<Vec<_>>());
        let mean_rank: Vec<f64> = (0..entrants).map(rank).collect();
        let first = (0..entrants).min_by(|a, b| mean_rank[*a].total_cmp(&mean_rank[*b]))?;
        let others: Vec<usize> = (0..entrants).filter(|n| *n != first).collect();
        let logarithm = |gap: f64| gap.min(1e300).ln();
        let test = |n: &usize| {
            let differences: Vec<f64> = gaps.iter().map(|gaps| logarithm(gaps[*n]) - logarithm(gaps[first])).collect();
            wilcoxon(&differences)
        };
        let mut p_holm = vec![f64::NAN; entrants];
        let adjusted = holm(&others.iter().map(test).collect::<Vec<_>>());
        others.into_iter().zip(adjusted).for_each(|(n, p)| p_holm[n] = p);
        Some(SuiteRanks { mean_rank, first, p_holm })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ties_have_the_mean_of_their_ranks() {
        assert_eq!(ranks(&[3.0, 1.0, 3.0, 2.0]), [3.5, 1.0, 3.5, 2.0]);
        assert_eq!(ranks(&[f64::INFINITY, 1.0]), [2.0, 1.0]);
    }
}
