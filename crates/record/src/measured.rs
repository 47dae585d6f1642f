//! Outputs that were measured at some of the samples of a recording only, because their sensor has a clock of its own.

use super::heading::Quantity;
use super::measured_at::MeasuredAt;
use super::record::Record;
use super::samples::Samples;
use super::source::Source;
use motorfit_core::numeric::{count, interpolate_between};
use motorfit_core::text::counted;
use motorfit_core::{Error, Result};

impl Record {
    /// Returns the recording with outputs that were measured at some of the samples only, interpolated linearly at the others.
    ///
    /// # Errors
    /// Returns `Data` if an output was measured at fewer than two samples.
    pub(super) fn with_measured_at(mut self, all: Vec<MeasuredAt>) -> Result<Self> {
        debug_assert!(all.iter().all(|of| of.samples.len() == self.len()), "rows are removed from all signals");
        for of in all.into_iter().filter(|of| of.samples.contains(&false)) {
            let own = of.indices();
            if own.len() < 2 {
                let message = format!("the {} has {} in the recording", of.quantity, counted(own.len(), "sample"));
                let error = Error::data(message, "Log it in shorter periods, or leave its column out.");
                return Err(self.source.path.iter().fold(error, |error, path| error.in_file(path)));
            }
            let time = self.samples.time_s.clone();
            self.samples.change(|quantity, values| {
                if quantity == of.quantity {
                    interpolate_between(&time, values, &own);
                }
            });
            self.measured_at.push(of);
        }
        Ok(self)
    }

    /// Returns the recording with all its samples as measured ones, of which the measured fraction is independent: filters and a change
    /// of the sampling rate mix them.
    pub(super) fn with_mixed_samples(self) -> Self {
        let part = |of: &MeasuredAt| count(of.indices().len()) / count(of.samples.len());
        let Some(least) = self.measured_at.iter().map(part).reduce(f64::min) else { return self };
        Self { measured_at: Vec::new(), independent: self.independent * least, interpolated: true, ..self }
    }

    /// Returns the outputs that were measured at some of the samples only.
    #[doc(hidden)]
    pub fn measured_at(&self) -> &[MeasuredAt] {
        &self.measured_at
    }

    /// Returns true if an output was measured at a sample, and not interpolated between others.
    #[must_use]
    pub fn is_measured(&self, quantity: Quantity, sample: usize) -> bool {
        let of = self.measured_at.iter().find(|of| of.quantity == quantity);
        of.is_none_or(|of| of.samples.get(sample) == Some(&true))
    }

    /// Returns the indices of the samples at which an output was measured; `None` if those are all.
    #[doc(hidden)]
    pub fn own_samples(&self, quantity: Quantity) -> Option<Vec<usize>> {
        self.measured_at.iter().find(|of| of.quantity == quantity).map(MeasuredAt::indices)
    }

    /// Returns the recording at the samples of the output that was measured at the fewest, with their indices; the input is its mean over
    /// each step. `None` if all outputs were measured at all samples.
    #[doc(hidden)]
    pub fn at_slowest_output(&self) -> Option<(Self, Vec<usize>)> {
        let slowest = self.measured_at().iter().map(MeasuredAt::indices).min_by_key(Vec::len)?;
        let of = |values: &[f64]| slowest.iter().map(|n| values[*n]).collect::<Vec<f64>>();
        let own = self.samples();
        let mut samples = Samples { time_s: of(&own.time_s), ..own.clone() };
        samples.change(|quantity, values| {
            let is_input = match quantity {
                Quantity::Signal(n) => {
                    own.named.iter().any(|signal| signal.is_input && signal.number == usize::from(n))
                }
                quantity => quantity == self.driver() || quantity == Quantity::Torque,
            };
            *values = match is_input {
                true => means(&own.time_s, values, &slowest),
                false => of(values),
            }
        });
        let source = Source { lines: self.source().lines.of(slowest.iter().copied()), ..self.source().clone() };
        Some((Self::from_file(samples, source, true).ok()?, slowest))
    }
}

/// Returns the means of an input that holds between samples over the steps from each of some samples to the next.
fn means(time_s: &[f64], values: &[f64], at: &[usize]) -> Vec<f64> {
    let mean = |pair: &[usize]| {
        let [from, to] = [pair[0], pair[1]];
        let sum: f64 = (from..to).map(|n| values[n] * (time_s[n + 1] - time_s[n])).sum();
        sum / (time_s[to] - time_s[from])
    };
    let mut means: Vec<f64> = at.windows(2).map(mean).collect();
    means.extend(at.last().map(|last| values[*last]));
    means
}
