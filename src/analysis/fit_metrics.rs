//! Measures of fit of a simulation.

use crate::estimate::Refined;
use crate::evaluate::{Problem, Signals};
use crate::numeric::{count, mean, squares_about};
use crate::record::Record;
use crate::setting::text;
use crate::text::significant;
use crate::warning::Warning;
use std::borrow::Cow;
use std::sync::Arc;

/// Sums over samples, of current and speed: what fits and residual deviations are made of.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct FitMetrics {
    /// Squares of what the model leaves.
    left: [f64; 2],
    measured: [Spread; 2],
}

/// The spread of values about their mean.
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

    /// Of these and others together, about the mean of all (T. F. Chan, G. H. Golub, R. J. LeVeque 1983).
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

    /// 100 (1 − √(left/squares)), where there is anything.
    fn fit_percent(&self, left: f64) -> Option<f64> {
        let fit = 100.0 * (1.0 - (left / self.squares).sqrt());
        (self.count > 0.0 && fit.is_finite()).then_some(fit)
    }
}

impl FitMetrics {
    /// Returns those of the recordings of a problem, simulated with a candidate.
    pub(crate) fn of(records: &[Record], problem: &Problem, candidate: &[f64]) -> Self {
        Self::each(records, problem, candidate).into_iter().fold(Self::default(), Self::and)
    }

    /// Returns those of each recording.
    pub(crate) fn each(records: &[Record], problem: &Problem, candidate: &[f64]) -> Vec<Self> {
        let one = |(recording, (record, signals)): (usize, (&Record, &Arc<Signals>))| {
            let mut sums = Self::default();
            let model = problem.simulate(candidate, recording, signals.initial);
            for (channel, (measured, simulated)) in record.measured().into_iter().zip(model).enumerate() {
                let Some(measured) = measured else { continue };
                let counting = |(n, _): &(usize, (&f64, f64))| signals.counts(channel, *n);
                let pairs = measured.iter().zip(simulated).enumerate().filter(counting);
                let (measured, left): (Vec<f64>, Vec<f64>) = pairs.map(|(_, (y, x))| (*y, (y - x) * (y - x))).unzip();
                sums.left[channel] += left.iter().sum::<f64>();
                sums.measured[channel] = sums.measured[channel].and(Spread::of(&measured));
            }
            sums
        };
        records.iter().zip(problem.signals()).enumerate().map(one).collect()
    }

    /// Returns these and those of other recordings.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            left: [0, 1].map(|c| self.left[c] + other.left[c]),
            measured: [0, 1].map(|c| self.measured[c].and(other.measured[c])),
        }
    }

    /// 100 (1 − ‖y − ŷ‖/‖y − mean y‖) per channel.
    pub(crate) fn fit_percent(&self) -> [Option<f64>; 2] {
        [0, 1].map(|c| self.measured[c].fit_percent(self.left[c]))
    }

    /// Standard deviation of the residuals.
    pub(crate) fn residual_sigma(&self) -> [Option<f64>; 2] {
        [0, 1].map(|c| {
            let sigma = (self.left[c] / self.measured[c].count).sqrt();
            (self.measured[c].count > 0.0 && sigma.is_finite()).then_some(sigma)
        })
    }
}

/// Returns the fit of the refined motor \[%\], from the sums with which the refinement ended.
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

/// A fit below this is none.
const POOR_FIT_PERCENT: f64 = 50.0;

/// Returns the warning for a model that does not fit.
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
