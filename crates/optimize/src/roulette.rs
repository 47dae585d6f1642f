//! Roulette-wheel selection: candidates are drawn with probability proportional to their fitness, with replacement.

use super::numbers::Numbers;
use motorfit_core::numeric::count;

/// A wheel with a sector for each candidate.
pub(super) struct Roulette {
    /// Running sums of the fitness.
    sums: Vec<f64>,
}

impl Roulette {
    /// Makes a wheel from the fitness of at least one candidate. If the sum is zero or not finite, since all candidates diverged, all
    /// have the same probability.
    pub(super) fn new(fitness: impl ExactSizeIterator<Item = f64>) -> Self {
        let size = fitness.len();
        let running = fitness.scan(0.0, |sum, share| {
            *sum += share;
            Some(*sum)
        });
        let sums: Vec<f64> = running.collect();
        let total = sums.last().copied().unwrap_or(0.0);
        let is_usable = total > 0.0 && total.is_finite();
        Self { sums: if is_usable { sums } else { (1..=size).map(count).collect() } }
    }

    /// Draws the index of a candidate.
    pub(super) fn draw(&self, numbers: &mut Numbers) -> usize {
        let at = numbers.unit() * self.sums.last().copied().unwrap_or(0.0);
        self.sums.partition_point(|sum| *sum <= at).min(self.sums.len().saturating_sub(1))
    }
}
