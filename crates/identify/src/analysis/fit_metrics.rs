//! Measures of fit of a simulation: fit in percent and standard deviation of the residuals, for each output.

use super::outputs::Output;
use motorfit_core::numeric::{count, mean, squares_about};
use motorfit_core::setting::text;
use motorfit_core::text::significant;
use motorfit_estimate::{Fitted, Refined};
use motorfit_record::Record;
use motorfit_record::warning::Warning;
use std::borrow::Cow;

/// Sums over the samples of each output from which fits and residual deviations are computed.
#[derive(Debug, Clone, Default)]
pub(crate) struct FitMetrics(Vec<OfOutput>);

/// The sums of an output.
#[derive(Debug, Clone, Copy, Default)]
struct OfOutput {
    /// Sum of squared residuals.
    squares: f64,
    /// Spread of the measured values.
    measured: Spread,
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
    pub(crate) fn of(problem: &dyn Fitted, candidate: &[f64]) -> Self {
        Self::each(problem, candidate).into_iter().fold(Self::default(), Self::and)
    }

    /// Computes the metrics of each recording of a problem, simulated with a candidate.
    pub(crate) fn each(problem: &dyn Fitted, candidate: &[f64]) -> Vec<Self> {
        let one = |n: usize| Self::of_residuals(problem, n, &problem.residuals(candidate, n, &problem.initial(n)));
        (0..problem.recordings()).map(one).collect()
    }

    /// Computes the metrics of a recording from its residuals, those of each output at the samples that count.
    pub(crate) fn of_residuals(problem: &dyn Fitted, recording: usize, residuals: &[Vec<f64>]) -> Self {
        let squares: Vec<f64> = residuals.iter().map(|of| of.iter().map(|e| e * e).sum()).collect();
        Self::of_squares(problem, recording, &squares)
    }

    /// Computes the metrics of a recording from the sum of squared residuals of each output.
    pub(crate) fn of_squares(problem: &dyn Fitted, recording: usize, squares: &[f64]) -> Self {
        let measured = |output: usize| Spread::of(&problem.measured((recording, output)));
        let one = |(output, squares): (usize, &f64)| OfOutput { squares: *squares, measured: measured(output) };
        Self(squares.iter().enumerate().map(one).collect())
    }

    /// Returns the metrics of both sets of recordings together.
    pub(crate) fn and(self, other: Self) -> Self {
        if self.0.is_empty() {
            return other;
        }
        let sum = |(a, b): (&OfOutput, &OfOutput)| OfOutput {
            squares: a.squares + b.squares,
            measured: a.measured.and(b.measured),
        };
        Self(self.0.iter().zip(&other.0).map(sum).collect())
    }

    /// Returns the fit `100 (1 − ‖y − ŷ‖/‖y − mean y‖)` of each output \[%\].
    pub(crate) fn fit_percent(&self) -> Vec<Option<f64>> {
        self.0.iter().map(|of| of.measured.fit_percent(of.squares)).collect()
    }

    /// Returns the standard deviation of the residuals of each output in its unit.
    pub(crate) fn residual_sigma(&self) -> Vec<Option<f64>> {
        let one = |of: &OfOutput| {
            let sigma = (of.squares / of.measured.count).sqrt();
            (of.measured.count > 0.0 && sigma.is_finite()).then_some(sigma)
        };
        self.0.iter().map(one).collect()
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

/// Returns true if a fit is too poor for the parameters to be of use.
pub(crate) fn is_poor(fit_percent: &[Option<f64>]) -> bool {
    fit_percent.iter().flatten().any(|fit| *fit < POOR_FIT_PERCENT)
}

/// Returns the warning about a model that does not fit.
pub(crate) fn poor_fit(outputs: &[Output], fit_percent: &[Option<f64>]) -> Option<Warning> {
    let poor = |(output, fit): (&Output, &Option<f64>)| {
        fit.filter(|fit| *fit < POOR_FIT_PERCENT).map(|fit| format!("{} {} %", output.name, significant(fit, 3)))
    };
    let list: Vec<String> = outputs.iter().zip(fit_percent).filter_map(poor).collect();
    (!list.is_empty()).then(|| {
        let message = text!(
            ("the model does not fit ({}): do not use these parameters; check columns, ", list.join(", "))
            "units and signs, and " [Bounds]
        );
        Warning::new("poor_fit", message)
    })
}
