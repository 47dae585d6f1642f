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
    let limits = Limits::of(block);
    let mut totals = [0.0; L];
    // In another order the contributions are kept, and summed in that of the problem.
    let mut parts = vec![[0.0; L]; block.order.len()];
    for turn in 0..problem.signals().len() {
        let recording = block.recording(turn);
        let signals = &problem.signals()[recording];
        let mut cut = limits.as_ref().map(|limits| Cut::new(limits, problem, signals, totals));
        let sums = K::sums::<FMA>(block, recording, cut.as_mut());
        let is_abandoned = cut.as_ref().is_some_and(|cut| cut.is_passed(&sums));
        for lane in 0..L {
            let part = problem.scaled(signals, [sums[0][lane], sums[1][lane]]);
            totals[lane] += part;
            if let Some(parts) = parts.get_mut(recording) {
                parts[lane] = part;
            }
        }
        if is_abandoned {
            for total in &mut totals {
                *total = block.at_least(*total);
            }
            parts.clear();
            break;
        }
    }
    if !parts.is_empty() {
        totals = [0.0; L];
        for part in parts {
            for lane in 0..L {
                totals[lane] += part[lane];
            }
        }
    }
    for (cost, total) in costs.iter_mut().zip(totals) {
        *cost = problem.cost(total);
    }
}
