//! The precision at which costs are compared, and their logarithms.

use super::result::Block;
use motorfit_core::numeric::{quantile, sorted};

/// Excess below which costs count as equal, relative to the median cost after the first generation: the last target of COCO.
const PRECISION: f64 = 1e-8;

/// The lowest cost known, and the excess over it below which costs count as equal.
pub(super) struct Precision {
    lowest: f64,
    pub(super) smallest: f64,
}

impl Precision {
    /// Returns the precision of the costs of blocks in one criterion.
    pub(super) fn of<'a>(blocks: impl Iterator<Item = &'a Block> + Clone) -> Self {
        let runs = || blocks.clone().flat_map(|block| block.results.iter().flat_map(|result| &result.runs));
        let known = blocks.clone().filter_map(|block| block.reference_cost).fold(f64::INFINITY, f64::min);
        let lowest = runs().map(|run| run.cost).fold(known, f64::min);
        let firsts = runs().filter_map(|run| run.history.first().copied()).filter(|cost| cost.is_finite());
        let firsts = sorted(&firsts.collect::<Vec<_>>());
        Self { lowest, smallest: (PRECISION * quantile(&firsts, 0.5)).max(1e-300) }
    }

    /// Returns a cost, or the lowest one if the difference does not count.
    pub(super) fn counted(&self, cost: f64) -> f64 {
        if cost - self.lowest < self.smallest { self.lowest } else { cost }
    }

    /// Returns the excess of a cost over the lowest one, at least the smallest that counts.
    pub(super) fn excess(&self, cost: f64) -> f64 {
        (cost - self.lowest).max(self.smallest)
    }
}

/// Number of runs below which neither a 95 % interval nor a test at the 5 % level exists.
pub const FEW: usize = 6;

/// Returns the natural logarithm of a cost, finite also for 0 and ∞.
pub(super) fn logarithm(cost: f64) -> f64 {
    cost.clamp(1e-300, 1e300).ln()
}
