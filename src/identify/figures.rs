//! How well a simulation fits.

use crate::criterion::mean;
use crate::evaluate::Problem;
use crate::record::Record;

/// Sums over samples, of current and speed.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    /// Squares of what the model leaves.
    left: [f64; 2],
    /// Squares about the mean of each recording.
    about: [f64; 2],
    count: [f64; 2],
}

impl Sums {
    /// These and those of other recordings.
    pub(super) fn and(self, other: Self) -> Self {
        let add = |a: [f64; 2], b: [f64; 2]| [a[0] + b[0], a[1] + b[1]];
        Self {
            left: add(self.left, other.left),
            about: add(self.about, other.about),
            count: add(self.count, other.count),
        }
    }

    /// 100 (1 − ‖y − ŷ‖/‖y − mean y‖) per channel.
    pub(super) fn fit_percent(&self) -> [Option<f64>; 2] {
        [0, 1].map(|c| self.finite(100.0 * (1.0 - (self.left[c] / self.about[c]).sqrt()), c))
    }

    /// Standard deviation of the residuals.
    pub(super) fn residual_sigma(&self) -> [Option<f64>; 2] {
        [0, 1].map(|c| self.finite((self.left[c] / self.count[c]).sqrt(), c))
    }

    fn finite(&self, value: f64, channel: usize) -> Option<f64> {
        (self.count[channel] > 0.0 && value.is_finite()).then_some(value)
    }
}

/// The sums of the recordings of a problem.
pub(super) fn sums(records: &[Record], problem: &Problem, candidate: &[f64]) -> Sums {
    let mut sums = Sums::default();
    for (recording, (record, signals)) in records.iter().zip(problem.signals()).enumerate() {
        let model = problem.simulate(candidate, recording, signals.initial());
        for (channel, (measured, simulated)) in record.measured().into_iter().zip(model).enumerate() {
            let Some(measured) = measured else { continue };
            let counting: Vec<f64> =
                measured.iter().enumerate().filter(|(n, _)| signals.counts(channel, *n)).map(|(_, y)| *y).collect();
            let mean = mean(&counting);
            for (_, (y, y_hat)) in
                measured.iter().zip(simulated).enumerate().filter(|(n, _)| signals.counts(channel, *n))
            {
                sums.count[channel] += 1.0;
                sums.left[channel] += (y - y_hat) * (y - y_hat);
                sums.about[channel] += (y - mean) * (y - mean);
            }
        }
    }
    sums
}

/// Fits and standard deviations of residuals, norms over all recordings.
pub(super) fn of(records: &[Record], problem: &Problem, candidate: &[f64]) -> ([Option<f64>; 2], [Option<f64>; 2]) {
    let sums = sums(records, problem, candidate);
    (sums.fit_percent(), sums.residual_sigma())
}
