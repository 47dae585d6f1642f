//! Recordings: sampled voltage, load torque, current and speed of one motor, checked once, in SI units.

mod diagnose;
mod head;
mod heading;
mod import;
mod limits;
mod lines;
mod prepare;
mod reading;
mod samples;
mod stored;
mod time;

pub use diagnose::{FINDINGS, Finding, Severity, diagnose, explains_failure};
pub use heading::{ColumnRequest, Quantity, parse_columns};
pub use import::{
    BadRows, FORMATS, Format, ReadOptions, parse_number, read, read_bytes, read_csv, read_inputs, read_joined,
    write_csv,
};
pub use limits::limits;
pub use lines::Lines;
pub use prepare::{FilterKind, LowPass, Mask, Offset, Preparation, parse_masks};
pub use reading::{Reading, parse_crop, parse_offset};
pub use samples::Samples;
pub(crate) use time::rounded;
pub use time::{Gaps, Steps, TIME_JITTER_UNIFORM};

use crate::numeric::{count, whole};
use crate::setting::text;
use crate::{Error, Result};
use std::path::PathBuf;

/// The largest number of samples of a recording.
pub const SAMPLES_MAX: usize = 100_000_000;

/// The largest |value| that a signal may have in SI units; squares of it still add up to a finite number.
pub const VALUE_MAX: f64 = 1e9;

/// Returns whether the measured current is the input of all recordings.
#[must_use]
pub fn is_driven_by_current(records: &[Record]) -> bool {
    !records.is_empty() && records.iter().all(|record| record.driver() == Quantity::Current)
}

/// Returns the quantity that drives the motor, by the first recording.
#[must_use]
pub fn driver(records: &[Record]) -> Quantity {
    records.first().map_or(Quantity::Voltage, Record::driver)
}

/// A column as it was understood.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Column {
    /// The quantity that it holds.
    pub quantity: Quantity,
    /// Its heading in the file.
    pub heading: String,
    /// The conversion of its cells, for people; empty where there was none.
    pub conversion: String,
    /// Its unit as understood.
    pub unit: String,
    /// True if the unit was named or taken to be SI.
    pub unit_named: bool,
}

/// Where a recording came from and how it was understood.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Source {
    /// The file; `None` for one made in memory.
    pub path: Option<PathBuf>,
    /// SHA-256 of the file, in hexadecimal.
    pub sha256: Option<String>,
    /// Its columns; empty for one made in memory.
    pub columns: Vec<Column>,
    /// Which part of the file: a sheet, a test, a stretch between gaps; `None` for a whole file.
    pub part: Option<String>,
    /// The line of the file that each sample is on; empty for one made in memory or of several files.
    pub lines: Lines,
    /// Columns of the file that were not used.
    pub ignored: Vec<String>,
    /// Notes on what was left out, joined or prepared.
    pub notes: Vec<String>,
    /// True if the file ends without a line end, so that its last number may be cut off.
    pub last_line_open: bool,
}

impl Source {
    /// The same with the number of a stretch in its part, where there are several.
    fn stretch(mut self, n: usize, count: usize) -> Self {
        if count > 1 {
            let part = self.part.into_iter().chain([format!("stretch {}", n + 1)]);
            self.part = Some(part.collect::<Vec<_>>().join(", "));
        }
        self
    }
}

/// A recording that has passed all checks: at least two samples, finite values, regular increasing time.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    samples: Samples,
    steps: Steps,
    source: Source,
    excluded: Vec<Excluded>,
    independent: f64,
    slope: Vec<f64>,
    interpolated: bool,
}

/// Samples whose errors do not count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Excluded {
    /// The first.
    pub start: usize,
    /// One past the last.
    pub end: usize,
    /// Of current and speed.
    pub channels: [bool; 2],
}

impl Record {
    /// Checks the signals and makes a recording of them.
    ///
    /// # Errors
    /// `Data` when lengths differ, there are fewer than two samples, there is no input (a voltage, or a current beside
    /// a speed) or no output, a value is not finite or beyond [`VALUE_MAX`], or time repeats, goes back or has a gap.
    pub fn new(samples: Samples) -> Result<Self> {
        Self::from_file(samples, Source::default(), false)
    }

    /// With `keep_gaps` a gap is a long step.
    pub(crate) fn from_file(samples: Samples, source: Source, keep_gaps: bool) -> Result<Self> {
        Self::with_gaps(samples, source, &|_, _| keep_gaps)
    }

    /// With the gaps that `keep` accepts, by the sample before and the length in periods.
    fn with_gaps(samples: Samples, source: Source, keep: &dyn Fn(usize, f64) -> bool) -> Result<Self> {
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
            independent: 1.0,
            slope: Vec::new(),
            interpolated: false,
        })
    }

    /// Some of its samples.
    fn part(&self, range: std::ops::Range<usize>, note: String) -> Result<Self> {
        let mut source = Source { lines: self.source.lines.of(range.clone()), ..self.source.clone() };
        source.notes.push(note);
        let excluded = self.excluded.iter().map(|e| Excluded {
            start: e.start.clamp(range.start, range.end) - range.start,
            end: e.end.clamp(range.start, range.end) - range.start,
            ..*e
        });
        let excluded = excluded.filter(|e| e.start < e.end).collect();
        let record = Self::from_file(self.samples.slice(range.clone()), source, true)?;
        let slope = self.slope.get(range).unwrap_or_default().to_vec();
        Ok(Self { excluded, slope, independent: self.independent, interpolated: self.interpolated, ..record })
    }

    /// The first part of the samples, and the rest of them.
    ///
    /// # Errors
    /// `Usage` when either would have fewer than two samples.
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

    /// By how much the input rises over each step, around its value there as the mean; empty where it is held or
    /// sampled as recorded. A change of rate makes such lines.
    #[must_use]
    pub fn slope(&self) -> &[f64] {
        &self.slope
    }

    /// Returns whether values stand between samples that were measured.
    #[must_use]
    pub fn is_interpolated(&self) -> bool {
        self.interpolated
    }

    /// Some of its signals alone.
    pub(crate) fn speed_alone(&self) -> Self {
        Self { samples: Samples { current: None, ..self.samples.clone() }, ..self.clone() }
    }

    /// Time from the first sample to the last \[s\].
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        let time = &self.samples.time_s;
        time.last().zip(time.first()).map_or(0.0, |(last, first)| last - first)
    }

    /// The same with the input some samples later; what was before the first lasts on.
    pub(crate) fn with_late_input(&self, samples: usize) -> Self {
        let input = self.input();
        let late = (0..input.len()).map(|n| input[n.saturating_sub(samples)]).collect();
        Self { samples: self.samples.clone().with_input(late), ..self.clone() }
    }

    /// The same with the voltage held over each step as a line that does not rise.
    pub(crate) fn with_level_steps(&self) -> Self {
        Self { slope: vec![0.0; self.len()], ..self.clone() }
    }

    /// Samples whose errors do not count.
    #[must_use]
    pub fn excluded(&self) -> &[Excluded] {
        &self.excluded
    }

    /// For each sample whether its current and its speed count; empty when all do.
    #[must_use]
    pub fn counting(&self) -> Vec<[bool; 2]> {
        if self.excluded.is_empty() {
            return Vec::new();
        }
        let mut counting = vec![[true; 2]; self.len()];
        for Excluded { start, end, channels } in &self.excluded {
            for counts in &mut counting[*start..*end] {
                *counts = [counts[0] && !channels[0], counts[1] && !channels[1]];
            }
        }
        counting
    }

    /// The part of the samples that count as independent: filters leave less than all.
    #[must_use]
    pub fn independent(&self) -> f64 {
        self.independent
    }

    /// The signals.
    #[must_use]
    pub fn samples(&self) -> &Samples {
        &self.samples
    }

    /// Measured outputs in the order current, speed; a current that is the input is none.
    #[must_use]
    pub fn measured(&self) -> [Option<&[f64]>; 2] {
        let current = self.samples.current.as_deref().filter(|_| self.driver() == Quantity::Voltage);
        [current, self.samples.speed.as_deref()]
    }

    /// Returns the quantity of the input: the voltage, or the current where no voltage was recorded.
    #[must_use]
    pub fn driver(&self) -> Quantity {
        self.samples.driver()
    }

    /// The samples of the input, in V or A.
    #[must_use]
    pub fn input(&self) -> &[f64] {
        self.samples.input()
    }

    /// Returns the number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.samples.time_s.len()
    }

    /// Never: a recording has at least two samples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.samples.time_s.is_empty()
    }

    /// The period \[s\]: the median of the steps between samples.
    #[must_use]
    pub fn period_s(&self) -> f64 {
        self.steps.period_s
    }

    /// The steps between samples.
    #[must_use]
    pub fn steps(&self) -> &Steps {
        &self.steps
    }

    /// Where it came from.
    #[must_use]
    pub fn source(&self) -> &Source {
        &self.source
    }
}

fn check_values(quantity: Quantity, signal: &[f64], source: &Source) -> Result<()> {
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
