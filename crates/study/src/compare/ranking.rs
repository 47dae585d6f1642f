//! Summary of the runs of a method, and the ranking of the methods of a block with pairwise significance tests.

use super::precision::{FEW, Precision, logarithm};
use super::result::{Block, MethodResult};
use crate::statistics::{holm, median_interval, superiority, wilcoxon};
use motorfit_core::numeric::{mean, quantile, sorted};

/// Summary of the final costs of a method's runs.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Summary {
    /// Lowest cost.
    pub best: f64,
    /// Median cost.
    pub median: f64,
    /// 95 % bootstrap confidence interval of the median; NaN below [`FEW`] runs.
    #[serde(rename = "median_ci95")]
    pub interval: [f64; 2],
    /// Highest cost.
    pub worst: f64,
    /// Mean cost.
    pub average: f64,
    /// Number of runs in which every candidate diverged.
    pub failed: usize,
}

/// Paired comparison of two methods.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairwiseTest {
    /// Indices of the two methods in the block.
    pub methods: [usize; 2],
    /// Probability that a run of the first method ends at a lower cost than a run of the second.
    pub superiority: f64,
    /// p-value of Wilcoxon's signed-rank test on the logarithms of the final costs, paired by run number.
    pub p_value: f64,
    /// p-value after Holm's correction for all pairs of the block.
    pub p_holm: f64,
}

/// Ranking of the methods of a block.
#[derive(Debug, Clone, PartialEq)]
pub struct Ranking {
    /// Indices of the methods in the block, by increasing median cost.
    pub order: Vec<usize>,
    /// Tests of all pairs, in the order of the ranking.
    pub pairs: Vec<PairwiseTest>,
}

impl MethodResult {
    /// Returns the final cost of each run.
    #[must_use]
    pub fn costs(&self) -> Vec<f64> {
        self.runs.iter().map(|run| run.cost).collect()
    }

    /// Returns the run with the lowest final cost; `None` if every candidate of all runs diverged.
    #[must_use]
    pub fn best(&self) -> Option<&super::result::Outcome> {
        self.runs.iter().min_by(|a, b| a.cost.total_cmp(&b.cost)).filter(|run| run.parameters.is_some())
    }

    /// Summarizes the final costs; `seed` draws the bootstrap.
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
    /// Ranks the methods by median cost and tests each pair.
    #[must_use]
    pub fn ranking(&self) -> Ranking {
        // Runs that reached the lowest cost to within the precision are ties: below it there is only rounding.
        let precision = Precision::of(std::iter::once(self));
        let costs = |result: &MethodResult| result.costs().into_iter().map(|cost| precision.counted(cost)).collect();
        let costs: Vec<Vec<f64>> = self.results.iter().map(costs).collect();
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
