//! Abandons a block of candidates whose costs are all known to be above the cutoffs of the search.
//!
//! Errors are not negative and rounding to nearest preserves order, so the cost of the sums so far is a lower bound of the cost,
//! exactly; in another order of the recordings after [`Block::at_least`].

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays alike; that is what vectorizes")]

use super::kernel::Block;
use super::problem::{Problem, Scaling};
use super::signals::Signals;

/// Totals above which the candidates of a block have costs above their cutoffs.
pub(super) struct Limits<const L: usize>([f64; L]);

impl<const L: usize> Limits<L> {
    /// Returns the limits for the cutoffs of a block, the last of which fills the lanes without a candidate; `None` if there are no
    /// cutoffs or none is finite.
    #[inline(always)]
    pub(super) fn of(block: &Block<'_>) -> Option<Self> {
        let cutoffs = block.candidates.cutoffs();
        let last = cutoffs.len().checked_sub(1)?;
        let mut totals = [f64::INFINITY; L];
        for (lane, total) in totals.iter_mut().enumerate() {
            *total = total_above(block, cutoffs[lane.min(last)]);
        }
        totals.iter().any(|total| total.is_finite()).then_some(Self(totals))
    }
}

/// Returns a total above which a cost is above `cutoff`; ∞ if the cutoff is no number.
pub(super) fn total_above(block: &Block<'_>, cutoff: f64) -> f64 {
    if cutoff.is_nan() { f64::INFINITY } else { block.slack() * block.problem.total_above(cutoff) }
}

/// Number of samples before the first comparison with the limits. Later ones are due after half as many samples again, because a
/// comparison takes as long as some ten samples.
pub(super) const FIRST: usize = 128;

/// Returns the number of samples at which the sums are compared next.
#[inline(always)]
pub(super) fn next_due(done: usize) -> usize {
    done + FIRST.max(done / 2)
}

/// The limits of a block on one recording.
pub(super) struct Cut<'a, const L: usize> {
    limits: &'a Limits<L>,
    /// The totals over the recordings before.
    before: [f64; L],
    scaling: Scaling,
    /// Number of samples simulated, and that at which the sums are compared next.
    done: usize,
    due: usize,
}

impl<'a, const L: usize> Cut<'a, L> {
    #[inline(always)]
    pub(super) fn new(limits: &'a Limits<L>, problem: &Problem, signals: &Signals, before: [f64; L]) -> Self {
        Self { limits, before, scaling: problem.scaling(signals), done: 0, due: FIRST }
    }

    /// Returns the end of the samples from `from` to `end` before the next comparison.
    #[inline(always)]
    pub(super) fn until(&self, from: usize, end: usize) -> usize {
        end.min(from + (self.due - self.done))
    }

    /// Counts simulated samples and returns true if a comparison is due.
    #[inline(always)]
    pub(super) fn is_due(&mut self, samples: usize) -> bool {
        self.done += samples;
        let is_due = self.done >= self.due;
        if is_due {
            self.due = next_due(self.done);
        }
        is_due
    }

    /// Returns true if every candidate is beyond its limit, or diverged, with its sums so far.
    #[inline(always)]
    pub(super) fn is_passed(&self, sums: &[[f64; L]; 2]) -> bool {
        let mut within = false;
        for lane in 0..L {
            let scaled = self.scaling.total([sums[0][lane], sums[1][lane]]);
            within |= self.before[lane] + scaled <= self.limits.0[lane];
        }
        !within
    }
}
