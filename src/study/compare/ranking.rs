//! Summaries of the runs of a block, and the ranking of methods with its significance.

use super::{Block, MethodResult};
use crate::numeric::{mean, quantile, sorted};
use crate::study::statistics::{holm, median_interval, superiority, wilcoxon};

/// Runs below which neither an interval nor a test of 5 % can be had.
pub const FEW: usize = 6;

/// Costs of a method's runs.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Summary {
    /// The lowest.
    pub best: f64,
    /// The median.
    pub median: f64,
    /// Its 95 % bootstrap interval.
    #[serde(rename = "median_ci95")]
    pub interval: [f64; 2],
    /// The highest.
    pub worst: f64,
    /// The mean.
    pub average: f64,
    /// Runs without any finite cost.
    pub failed: usize,
}

/// A method against another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairwiseTest {
    /// Both, by their places in the block.
    pub methods: [usize; 2],
    /// The probability that a run of the first ends lower than one of the second.
    pub superiority: f64,
    /// Wilcoxon's signed-rank test of the logarithms of the costs of runs with the same number.
    pub p_value: f64,
    /// The same after Holm's correction for all pairs of the block.
    pub p_holm: f64,
}

/// The methods of a block in order.
#[derive(Debug, Clone, PartialEq)]
pub struct Ranking {
    /// Their places in the block, the lowest median cost first.
    pub order: Vec<usize>,
    /// Every pair, in the order of the ranking.
    pub pairs: Vec<PairwiseTest>,
}

impl MethodResult {
    /// Final costs by run.
    #[must_use]
    pub fn costs(&self) -> Vec<f64> {
        self.runs.iter().map(|run| run.cost).collect()
    }

    /// The run that ended lowest.
    #[must_use]
    pub fn best(&self) -> Option<&super::Outcome> {
        self.runs.iter().min_by(|a, b| a.cost.total_cmp(&b.cost)).filter(|run| run.parameters.is_some())
    }

    /// The costs in short.
    #[must_use]
    pub fn summary(&self, seed: u64) -> Summary {
        let costs = self.costs();
        let sorted = sorted(&costs);
        Summary {
            best: quantile(&sorted, 0.0),
            median: quantile(&sorted, 0.5),
            interval: if costs.len() < FEW { [f64::NAN; 2] } else { median_interval(&costs, seed) },
            worst: quantile(&sorted, 1.0),
            average: mean(&costs),
            failed: self.runs.iter().filter(|run| run.parameters.is_none()).count(),
        }
    }
}

impl Block {
    /// Ranks the methods.
    #[must_use]
    pub fn ranking(&self) -> Ranking {
        let costs: Vec<Vec<f64>> = self.results.iter().map(MethodResult::costs).collect();
        let median = |n: usize| quantile(&sorted(&costs[n]), 0.5);
        let mut order: Vec<usize> = (0..costs.len()).collect();
        order.sort_by(|a, b| median(*a).total_cmp(&median(*b)));
        let mut pairs = Vec::new();
        for (place, &first) in order.iter().enumerate() {
            for &second in &order[place + 1..] {
                let pair = costs[first].iter().zip(&costs[second]);
                let differences: Vec<f64> = pair.map(|(a, b)| logarithm(*b) - logarithm(*a)).collect();
                let superiority = superiority(&costs[first], &costs[second]);
                let p_value = wilcoxon(&differences);
                pairs.push(PairwiseTest { methods: [first, second], superiority, p_value, p_holm: p_value });
            }
        }
        let p_holm = holm(&pairs.iter().map(|pair| pair.p_value).collect::<Vec<_>>());
        pairs.iter_mut().zip(p_holm).for_each(|(pair, p_holm)| pair.p_holm = p_holm);
        Ranking { order, pairs }
    }
}

/// Finite also for 0 and ∞.
fn logarithm(cost: f64) -> f64 {
    cost.clamp(1e-300, 1e300).ln()
}
