//! Measures of fit of a simulation: fit in percent and standard deviation of the residuals, per channel.

use motorfit_core::numeric::{count, mean, squares_about};
use motorfit_core::setting::text;
use motorfit_core::text::significant;
use motorfit_estimate::Refined;
use motorfit_evaluate::{Problem, Signals};
use motorfit_record::Record;
use motorfit_record::warning::Warning;
use std::borrow::Cow;
use std::sync::Arc;

/// Sums over the samples of current and speed from which fits and residual deviations are computed.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct FitMetrics {
    /// Sums of squared residuals.
    squares: [f64; 2],
    /// Spread of the measured values.
    measured: [Spread; 2],
}

/// The number of values, their mean, and their sum of squares about it.
#[derive(Debug, Clone, Copy, Default)]
struct Spread {
    count: f64,
    mean: f64,
    squares: f64,
}

impl Spread {
    fn of(values: &[f64]) -> Self {
        if values.is_empty() {
            return Self::default();
        }
        let mean = mean(values);
        Self { count: count(values.len()), mean, squares: squares_about(mean, values) }
    }

    /// Returns the spread of both sets of values together (T. F. Chan, G. H. Golub, R. J. LeVeque, 1983).
    fn and(self, other: Self) -> Self {
        let count = self.count + other.count;
        if count == 0.0 {
            return self;
        }
        let apart = other.mean - self.mean;
        let mean = self.mean + apart * other.count / count;
        let between = apart * apart * self.count * other.count / count;
        Self { count, mean, squares: self.squares + other.squares + between }
    }

    /// Returns the fit at a sum of squared residuals, `100 (1 − √(residual/squares))` \[%\]; `None` for constant or missing
    /// signals.
    fn fit_percent(&self, residual: f64) -> Option<f64> {
        let fit = 100.0 * (1.0 - (residual / self.squares).sqrt());
        (self.count > 0.0 && fit.is_finite()).then_some(fit)
    }
}

impl FitMetrics {
    /// Computes the metrics over all recordings of a problem, simulated with a candidate.
    pub(crate) fn of(records: &[Record], problem: &Problem, candidate: &[f64]) -> Self {
        Self::each(records, problem, candidate).into_iter().fold(Self::default(), Self::and)
    }

    /// Computes the metrics of each recording of a problem, simulated with a candidate.
    pub(crate) fn each(records: &[Record], problem: &Problem, candidate: &[f64]) -> Vec<Self> {
        let one = |(recording, (record, signals)): (usize, (&Record, &Arc<Signals>))| {
            let mut sums = Self::default();
            let model = problem.simulate(candidate, recording, signals.initial);
            for (channel, (measured, simulated)) in record.measured().into_iter().zip(model).enumerate() {
                let Some(measured) = measured else { continue };
                let counting = |(n, _): &(usize, (&f64, f64))| signals.counts(channel, *n);
                let pairs = measured.iter().zip(simulated).enumerate().filter(counting);
                let (measured, squares): (Vec<f64>, Vec<f64>) =
                    pairs.map(|(_, (y, x))| (*y, (y - x) * (y - x))).unzip();
                sums.squares[channel] += squares.iter().sum::<f64>();
                sums.measured[channel] = sums.measured[channel].and(Spread::of(&measured));
            }
            sums
        };
        records.iter().zip(problem.signals()).enumerate().map(one).collect()
    }

    /// Returns the metrics of both sets of recordings together.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            squares: [0, 1].map(|c| self.squares[c] + other.squares[c]),
            measured: [0, 1].map(|c| self.measured[c].and(other.measured[c])),
        }
    }

    /// Returns the fit `100 (1 − ‖y − ŷ‖/‖y − mean y‖)` of current and speed \[%\].
    pub(crate) fn fit_percent(&self) -> [Option<f64>; 2] {
        [0, 1].map(|c| self.measured[c].fit_percent(self.squares[c]))
    }

    /// Returns the standard deviation of the residuals of current \[A\] and speed \[rad/s\].
    pub(crate) fn residual_sigma(&self) -> [Option<f64>; 2] {
        [0, 1].map(|c| {
            let sigma = (self.squares[c] / self.measured[c].count).sqrt();
            (self.measured[c].count > 0.0 && sigma.is_finite()).then_some(sigma)
        })
    }
}

/// Returns the fit of current and speed of a refined motor \[%\], from the final sums of squares of the refinement.
pub(crate) fn fit_percent(records: &[Record], refined: &Refined) -> [Option<f64>; 2] {
    [0, 1].map(|channel| {
        let mut spread = Spread::default();
        for record in records {
            let Some(measured) = record.measured()[channel] else { continue };
            let counting = record.counting();
            let kept: Cow<'_, [f64]> = match counting.is_empty() {
                true => Cow::Borrowed(measured),
                false => {
                    measured.iter().zip(&counting).filter(|(_, counts)| counts[channel]).map(|(y, _)| *y).collect()
                }
            };
            spread = spread.and(Spread::of(&kept));
        }
        spread.fit_percent(refined.squares.iter().map(|squares| squares[channel]).sum())
    })
}

/// Smallest fit of a channel without a warning \[%\].
const POOR_FIT_PERCENT: f64 = 50.0;

/// Returns the warning about a model that does not fit.
pub(crate) fn poor_fit(fit_percent: [Option<f64>; 2]) -> Option<Warning> {
    let poor = |(name, fit): (&str, Option<f64>)| {
        fit.filter(|fit| *fit < POOR_FIT_PERCENT).map(|fit| format!("{name} {} %", significant(fit, 3)))
    };
    let list: Vec<String> = ["current", "speed"].into_iter().zip(fit_percent).filter_map(poor).collect();
    (!list.is_empty()).then(|| {
        let message = text!(
            ("the model does not fit ({}): do not use these parameters; check columns, ", list.join(", "))
            "units and signs, and " [Bounds]
        );
        Warning::new("poor_fit", message)
    })
}
