//! How well a simulation fits.

use crate::evaluate::Problem;
use crate::numeric::{count, mean, squares_about};
use crate::record::Record;

/// Sums over samples, of current and speed.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    /// Squares of what the model leaves.
    left: [f64; 2],
    measured: [Spread; 2],
}

/// How values spread about their mean.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Spread {
    count: f64,
    mean: f64,
    squares: f64,
}

impl Spread {
    /// Of some values.
    pub(super) fn of(values: &[f64]) -> Self {
        if values.is_empty() {
            return Self::default();
        }
        let mean = mean(values);
        Self { count: count(values.len()), mean, squares: squares_about(mean, values) }
    }

    /// Of these and others together, about the mean of all (T. F. Chan, G. H. Golub, R. J. LeVeque 1983).
    pub(super) fn and(self, other: Self) -> Self {
        let count = self.count + other.count;
        if count == 0.0 {
            return self;
        }
        let apart = other.mean - self.mean;
        let mean = self.mean + apart * other.count / count;
        let between = apart * apart * self.count * other.count / count;
        Self { count, mean, squares: self.squares + other.squares + between }
    }

    /// 100 (1 − √(left/squares)), where there is anything.
    pub(super) fn fit_percent(&self, left: f64) -> Option<f64> {
        let fit = 100.0 * (1.0 - (left / self.squares).sqrt());
        (self.count > 0.0 && fit.is_finite()).then_some(fit)
    }
}

impl Sums {
    /// These and those of other recordings.
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            left: [0, 1].map(|c| self.left[c] + other.left[c]),
            measured: [0, 1].map(|c| self.measured[c].and(other.measured[c])),
        }
    }

    /// 100 (1 − ‖y − ŷ‖/‖y − mean y‖) per channel.
    pub(super) fn fit_percent(&self) -> [Option<f64>; 2] {
        [0, 1].map(|c| self.measured[c].fit_percent(self.left[c]))
    }

    /// Standard deviation of the residuals.
    pub(super) fn residual_sigma(&self) -> [Option<f64>; 2] {
        [0, 1].map(|c| {
            let sigma = (self.left[c] / self.measured[c].count).sqrt();
            (self.measured[c].count > 0.0 && sigma.is_finite()).then_some(sigma)
        })
    }
}

/// The sums of the recordings of a problem.
pub(super) fn sums(records: &[Record], problem: &Problem, candidate: &[f64]) -> Sums {
    let of = |(recording, record): (usize, &Record)| {
        let signals = &problem.signals()[recording];
        let model = problem.simulate(candidate, recording, signals.initial());
        let mut sums = Sums::default();
        for (channel, (measured, simulated)) in record.measured().into_iter().zip(model).enumerate() {
            let Some(measured) = measured else { continue };
            let counting = |(n, _): &(usize, (&f64, f64))| signals.counts(channel, *n);
            let pairs: Vec<(f64, f64)> =
                measured.iter().zip(simulated).enumerate().filter(counting).map(|(_, (y, x))| (*y, x)).collect();
            sums.left[channel] = pairs.iter().map(|(y, x)| (y - x) * (y - x)).sum();
            sums.measured[channel] = Spread::of(&pairs.iter().map(|(y, _)| *y).collect::<Vec<_>>());
        }
        sums
    };
    records.iter().enumerate().map(of).fold(Sums::default(), Sums::and)
}

/// Fits and standard deviations of residuals, norms and means over all recordings.
pub(super) fn of(records: &[Record], problem: &Problem, candidate: &[f64]) -> ([Option<f64>; 2], [Option<f64>; 2]) {
    let sums = sums(records, problem, candidate);
    (sums.fit_percent(), sums.residual_sigma())
}
