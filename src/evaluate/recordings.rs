//! The costs of one block of candidates over the recordings of its problem.

use super::cutoff::{Cut, Limits};
use super::kernel::Block;
use super::step::Pair;

/// A kernel that simulates `L` candidates side by side. Its function is a method, not a closure, which would not be compiled for
/// the SIMD level.
pub(super) trait Kernel<const L: usize> {
    /// Returns the weighted sums of errors of the candidates over the active samples of a recording, shape `[channels][candidates]`;
    /// those so far once all candidates are beyond the limits of `cut`. Lanes without a candidate repeat the last one.
    fn sums<const FMA: bool>(block: &Block<'_>, recording: usize, cut: Option<&mut Cut<'_, L>>) -> Pair<L>;
}

/// Writes the costs of up to `L` candidates.
#[inline(always)]
pub(super) fn run<K: Kernel<L>, const L: usize, const FMA: bool>(block: &Block<'_>, costs: &mut [f64]) {
    let problem = block.problem;
    let limits = Limits::of(problem, block.candidates.cutoffs());
    let mut totals = [0.0; L];
    for (recording, signals) in problem.signals().iter().enumerate() {
        let mut cut = limits.as_ref().map(|limits| Cut::new(limits, problem, signals, totals));
        let sums = K::sums::<FMA>(block, recording, cut.as_mut());
        let is_abandoned = cut.as_ref().is_some_and(|cut| cut.is_passed(&sums));
        for lane in 0..L {
            totals[lane] += problem.scaled(signals, [sums[0][lane], sums[1][lane]]);
        }
        if is_abandoned {
            break;
        }
    }
    for (cost, total) in costs.iter_mut().zip(totals) {
        *cost = problem.cost(total);
    }
}
