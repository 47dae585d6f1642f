//! A checked recording.

use super::heading::Quantity;
use super::measured_at::MeasuredAt;
use super::samples::{Samples, VALUE_MAX};
use super::source::Source;
use super::time::{self, Steps};
use motorfit_core::numeric::{count, whole};
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};

/// Returns true if there are recordings and the measured current is the input of all of them.
#[must_use]
pub fn is_driven_by_current(records: &[Record]) -> bool {
    !records.is_empty() && records.iter().all(|record| record.driver() == Quantity::Current)
}

/// Returns the input quantity (voltage or current) of the first recording; the voltage if there is none.
#[must_use]
pub fn driver(records: &[Record]) -> Quantity {
    records.first().map_or(Quantity::Voltage, Record::driver)
}

/// Checks that recordings hold the signals of a DC motor.
pub fn check_of_motor(records: &[Record]) -> Result<()> {
    if !records.iter().any(Record::is_of_model) {
        return Ok(());
    }
    let hint = "Read it without signals of a model, or evaluate it with the model.";
    Err(Error::data("the recording holds the signals of a model, not of a DC motor", hint))
}

/// A checked recording: at least two samples, finite values, increasing time without gaps except accepted ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    pub(crate) samples: Samples,
    pub(crate) steps: Steps,
    pub(crate) source: Source,
    pub(crate) excluded: Vec<Excluded>,
    /// Outputs that were measured at some of the samples only.
    pub(crate) measured_at: Vec<MeasuredAt>,
    /// Effective sample size over the number of samples.
    pub(crate) independent: f64,
    /// Rise of the input over each step; empty if the input is as recorded.
    pub(crate) slope: Vec<f64>,
    /// True if samples were interpolated between measured ones.
    pub(crate) interpolated: bool,
}

/// A range of samples whose residuals are excluded from the criterion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Excluded {
    /// Index of the first sample.
    pub start: usize,
    /// Index one past the last sample.
    pub end: usize,
    /// True for each excluded channel, in the order current, speed.
    pub channels: [bool; 2],
}

impl Record {
    /// Checks the signals and creates a recording from them.
    ///
    /// # Errors
    /// Returns `Data` if lengths differ, there are fewer than two samples, there is no input (a voltage, or a current beside a
    /// speed) or no output, a value is not finite or exceeds [`VALUE_MAX`], or times are not finite or out of range, repeat,
    /// decrease, have a gap or too many distinct steps.
    pub fn new(samples: Samples) -> Result<Self> {
        Self::from_file(samples, Source::default(), false)
    }

    /// Creates a recording with ranges of samples that are excluded, of all channels.
    ///
    /// # Errors
    /// Returns the errors of [`Self::new`].
    #[doc(hidden)]
    pub fn of_parts(samples: Samples, excluded: impl Iterator<Item = std::ops::Range<usize>>) -> Result<Self> {
        let record = Self::from_file(samples, Source::default(), true)?;
        let bound = |range: std::ops::Range<usize>| Excluded {
            start: range.start.min(record.len()),
            end: range.end.min(record.len()),
            channels: [true; 2],
        };
        let excluded = excluded.map(bound).filter(|range| range.start < range.end).collect();
        Ok(Self { excluded, ..record })
    }

    /// Creates a recording with its origin; with `keep_gaps` a gap in time is a long step instead of an error.
    pub(crate) fn from_file(samples: Samples, source: Source, keep_gaps: bool) -> Result<Self> {
        Self::with_gaps(samples, source, &|_, _| keep_gaps)
    }

    /// Creates a recording; `keep(n, periods)` accepts a gap of that length after sample `n`.
    pub(crate) fn with_gaps(samples: Samples, source: Source, keep: &dyn Fn(usize, f64) -> bool) -> Result<Self> {
        let located = |error: Error| source.path.iter().fold(error, |error, path| error.in_file(path));
        samples.check_shape().map_err(located)?;
        let steps = time::steps(&samples.time_s, &source.lines, keep).map_err(located)?;
        for (quantity, signal) in samples.signals() {
            check_values(quantity, signal, &source).map_err(located)?;
        }
        Ok(Self {
            samples,
            steps,
            source,
            excluded: Vec::new(),
            measured_at: Vec::new(),
            independent: 1.0,
            slope: Vec::new(),
            interpolated: false,
        })
    }

    /// Returns the samples of a range as a recording, with a note.
    pub(crate) fn part(&self, range: std::ops::Range<usize>, note: String) -> Result<Self> {
        let mut source = Source { lines: self.source.lines.of(range.clone()), ..self.source.clone() };
        source.notes.push(note);
        let excluded = self.excluded.iter().map(|e| Excluded {
            start: e.start.clamp(range.start, range.end) - range.start,
            end: e.end.clamp(range.start, range.end) - range.start,
            ..*e
        });
        let excluded = excluded.filter(|e| e.start < e.end).collect();
        let record = Self::from_file(self.samples.slice(range.clone()), source, true)?;
        let slope = self.slope.get(range.clone()).unwrap_or_default().to_vec();
        let measured_at = self.measured_at.iter().map(|of| of.part(range.clone())).collect();
        let (independent, interpolated) = (self.independent, self.interpolated);
        Ok(Self { excluded, slope, measured_at, independent, interpolated, ..record })
    }

    /// Returns the samples of a range, counted from 0, as a recording.
    ///
    /// # Errors
    /// Returns `Usage` if the range has fewer than two samples or exceeds the recording.
    pub fn slice(&self, range: std::ops::Range<usize>) -> Result<Self> {
        if range.end > self.len() || range.len() < 2 {
            let message =
                format!("the range {}..{} of {} samples is not a recording", range.start, range.end, self.len());
            return Err(Error::usage(message, format!("Give at least two samples between 0 and {}.", self.len())));
        }
        let note = format!("the samples {}..{}", range.start, range.end);
        self.part(range, note)
    }

    /// Splits the recording in two: the given fraction of the samples, and the remaining ones.
    ///
    /// # Errors
    /// Returns `Usage` if either would have fewer than two samples.
    pub fn split(&self, fraction: f64) -> Result<[Self; 2]> {
        let at = whole((count(self.len()) * fraction.clamp(0.0, 1.0)).round());
        if at < 2 || self.len() - at < 2 {
            let message = format!("a split at {fraction} leaves {at} and {} samples", self.len() - at);
            let hint = text!("Give a fraction between 0 and 1, as in " [Split = "0.7"] ".");
            return Err(Error::usage(message, hint));
        }
        let part = |range, which: &str| self.part(range, format!("the {which} part of a split"));
        Ok([part(0..at, "first")?, part(at..self.len(), "held-out")?])
    }

    /// Returns the rise of the input over each step, in V or A; [`Self::input`] is then its mean over the step.
    ///
    /// A change of the sampling rate introduces slopes. Empty if the input is as recorded.
    #[must_use]
    pub fn slope(&self) -> &[f64] {
        &self.slope
    }

    /// Returns true if samples were interpolated between measured ones.
    #[must_use]
    pub fn is_interpolated(&self) -> bool {
        self.interpolated
    }

    /// Returns a copy without the current.
    #[doc(hidden)]
    pub fn without_current(&self) -> Self {
        Self { samples: Samples { current: None, ..self.samples.clone() }, ..self.clone() }
    }

    /// Returns the time from the first sample to the last \[s\].
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        let time = &self.samples.time_s;
        time.last().zip(time.first()).map_or(0.0, |(last, first)| last - first)
    }

    /// Returns a copy with the input delayed by a number of samples; the first value is repeated at the start.
    #[doc(hidden)]
    pub fn with_delayed_input(&self, samples: usize) -> Self {
        let input = self.input();
        let late = (0..input.len()).map(|n| input[n.saturating_sub(samples)]).collect();
        Self { samples: self.samples.clone().with_input(late), ..self.clone() }
    }

    /// Returns a copy with a zero-order hold of the input, expressed as slopes of 0.
    #[doc(hidden)]
    pub fn with_zero_order_hold(&self) -> Self {
        Self { slope: vec![0.0; self.len()], ..self.clone() }
    }

    /// Returns the ranges of samples that are excluded from the criterion.
    #[must_use]
    pub fn excluded(&self) -> &[Excluded] {
        &self.excluded
    }

    /// Returns a mask \[current, speed\] for each sample, true if its residual counts: it was measured and is not excluded. Empty if
    /// all count.
    #[must_use]
    pub fn counting(&self) -> Vec<[bool; 2]> {
        if self.excluded.is_empty() && self.measured_at.is_empty() {
            return Vec::new();
        }
        let mut counting = vec![[true; 2]; self.len()];
        for Excluded { start, end, channels } in &self.excluded {
            for counts in &mut counting[*start..*end] {
                *counts = [counts[0] && !channels[0], counts[1] && !channels[1]];
            }
        }
        for of in &self.measured_at {
            let Some(channel) = [Quantity::Current, Quantity::Speed].iter().position(|q| *q == of.quantity) else {
                continue;
            };
            for (counts, is_measured) in counting.iter_mut().zip(&of.samples) {
                counts[channel] &= is_measured;
            }
        }
        counting
    }

    /// Returns the effective sample size over the number of samples, in (0, 1\]: filters correlate the noise.
    #[must_use]
    pub fn effective_sample_ratio(&self) -> f64 {
        self.independent
    }

    /// Returns the signals.
    #[must_use]
    pub fn samples(&self) -> &Samples {
        &self.samples
    }

    /// Returns the measured outputs \[current, speed\]; a current that is the input is not an output.
    #[must_use]
    pub fn measured(&self) -> [Option<&[f64]>; 2] {
        let current = self.samples.current.as_deref().filter(|_| self.driver() == Quantity::Voltage);
        [current, self.samples.speed.as_deref()]
    }

    /// Returns true if the recording holds the signals of a user's model instead of those of a DC motor.
    #[must_use]
    pub fn is_of_model(&self) -> bool {
        !self.samples.named.is_empty()
    }

    /// Returns the input quantity: the voltage, or the current if no voltage was recorded.
    #[must_use]
    pub fn driver(&self) -> Quantity {
        self.samples.driver()
    }

    /// Returns the samples of the input, in V or A.
    #[must_use]
    pub fn input(&self) -> &[f64] {
        self.samples.input()
    }

    /// Returns the number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.samples.time_s.len()
    }

    /// Returns false: a recording has at least two samples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.samples.time_s.is_empty()
    }

    /// Returns the sampling period \[s\]: the median step in time.
    #[must_use]
    pub fn period_s(&self) -> f64 {
        self.steps.period_s
    }

    /// Returns the steps in time between samples.
    #[must_use]
    pub fn steps(&self) -> &Steps {
        &self.steps
    }

    /// Returns the origin of the recording.
    #[must_use]
    pub fn source(&self) -> &Source {
        &self.source
    }
}

pub(crate) fn check_values(quantity: Quantity, signal: &[f64], source: &Source) -> Result<()> {
    let good = |value: &f64| value.abs() <= VALUE_MAX;
    if signal.iter().fold(true, |all, value| all & good(value)) {
        return Ok(());
    }
    let Some(n) = signal.iter().position(|value| !good(value)) else { return Ok(()) };
    let heading = source.columns.iter().find(|c| c.quantity == quantity).map(|c| c.heading.clone());
    let message = format!("found {} {}, expected a finite value up to {VALUE_MAX:e}", signal[n], quantity.unit());
    let hint = "Correct the value or its unit, or remove the row at the start or end of the recording.";
    let error = Error::data(message, hint).at_line(source.lines.get(n));
    Err(error.in_column(heading.unwrap_or_else(|| quantity.to_string())))
}
