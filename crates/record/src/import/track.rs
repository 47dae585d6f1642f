//! Columns of channels with the times of their samples: each as a function of time, and all at common times.

use motorfit_core::numeric::{count, upper_median};
use motorfit_logs::Series;
use std::borrow::Cow;

/// Part of the steps of a channel that deviate from their median by [`DEVIATION`], above which they are uneven.
const UNEVEN: f64 = 0.1;
const DEVIATION: f64 = 0.25;
/// Part of the changes of a channel by the smallest one from which it is coarsely quantized.
const QUANTIZED: f64 = 0.5;
/// Relative difference up to which changes are the same.
const SAME: f64 = 1e-3;
/// Length of a gap between samples, relative to their median step.
pub(super) const GAP: f64 = 2.5;
/// Step from the sample before a recording to the first, relative to the period: nothing moves in it.
const BEFORE: f64 = 2e-3;

/// Meaning of a column for the times.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// Time of the rows of a table.
    Time,
    /// An input, which holds between its samples.
    Input,
    /// An output, which counts at its own samples.
    Output,
}

/// A column of a channel that is used.
pub(super) struct Wanted {
    /// Index of its series, and of the column in it.
    pub at: (usize, usize),
    /// Name for notes.
    pub name: String,
    pub role: Role,
}

/// Columns at common times.
#[derive(Debug, Default)]
pub(super) struct Merged {
    /// Times \[s\].
    pub time_s: Vec<f64>,
    /// Values of each wanted column; those of an output between its samples are interpolated.
    pub columns: Vec<Vec<f64>>,
    /// For each wanted column true at the times at which it counts; empty if it counts at all of them.
    pub measured: Vec<Vec<bool>>,
    /// Notes on the clocks and on what was left out.
    pub notes: Vec<String>,
}

impl Merged {
    /// Adds a sample just before the first with the values of the inputs before the recording, which act in it as long as a delay lasts;
    /// without one the first input is 0, as between tests, and others, such as the voltage of a supply, have their first. No output
    /// counts there.
    pub(super) fn begin_with(&mut self, before: &[Option<f64>], wanted: &[Wanted]) {
        let Some(first) = self.time_s.first().copied() else { return };
        let drive = wanted.iter().position(|wanted| wanted.role == Role::Input);
        let of = |(n, (value, column)): (usize, (&Option<f64>, &Vec<f64>))| {
            let first = if drive == Some(n) { 0.0 } else { column.first().copied().unwrap_or(0.0) };
            value.unwrap_or(first)
        };
        let before: Vec<f64> = before.iter().zip(&self.columns).enumerate().map(of).collect();
        let is_changed = |((wanted, value), column): ((&Wanted, &f64), &Vec<f64>)| {
            wanted.role == Role::Input && column.first().is_some_and(|first| (first - value).abs() > 0.0)
        };
        if !wanted.iter().zip(&before).zip(&self.columns).any(is_changed) {
            return;
        }
        let rows = self.time_s.len();
        self.time_s.insert(0, first - BEFORE * median_step(&self.time_s));
        for ((wanted, value), (column, measured)) in
            wanted.iter().zip(&before).zip(self.columns.iter_mut().zip(&mut self.measured))
        {
            let is_input = wanted.role == Role::Input;
            let first = if is_input { *value } else { column.first().copied().unwrap_or(0.0) };
            column.insert(0, first);
            if !is_input {
                measured.resize(rows, true);
                measured.insert(0, false);
            }
        }
    }
}

/// Returns the median step between times; infinite for fewer than two.
pub(super) fn median_step(time_s: &[f64]) -> f64 {
    let mut steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    if steps.is_empty() { f64::INFINITY } else { upper_median(&mut steps) }
}

/// A column with the times of its samples.
pub(super) struct Track<'a> {
    pub name: &'a str,
    pub role: Role,
    pub time_s: Cow<'a, [f64]>,
    pub values: Cow<'a, [f64]>,
    /// Median step \[s\].
    pub step_s: f64,
    /// Number of samples without a number.
    pub left_out: usize,
    /// True for an output that was logged when it changed, and holds its value until then.
    pub is_held: bool,
}

impl<'a> Track<'a> {
    pub(super) fn new(series: &'a Series, wanted: &'a Wanted, holds: bool) -> Self {
        let values = &series.columns[wanted.at.1];
        let count = values.len().min(series.time_s.len());
        let (times, values) = (&series.time_s[..count], &values[..count]);
        let left_out = values.iter().filter(|value| value.is_nan()).count();
        let (time_s, values) = match left_out {
            0 => (Cow::Borrowed(times), Cow::Borrowed(values)),
            _ => {
                let good = times.iter().zip(values).filter(|(_, value)| !value.is_nan());
                let (times, values): (Vec<f64>, Vec<f64>) = good.map(|(time, value)| (*time, *value)).unzip();
                (Cow::Owned(times), Cow::Owned(values))
            }
        };
        let step_s = median_step(&time_s);
        let is_held = holds && wanted.role == Role::Output && is_of_changes(&time_s, &values, step_s);
        Self { name: &wanted.name, role: wanted.role, time_s, values, step_s, left_out, is_held }
    }

    /// Returns the last values at increasing times; a value acts early by up to `early`.
    pub(super) fn held(&self, time_s: &[f64], early: f64) -> Vec<f64> {
        let mut at = 0;
        let value = |t: &f64| {
            while self.time_s.get(at + 1).is_some_and(|next| *next <= t + early) {
                at += 1;
            }
            self.values[at]
        };
        time_s.iter().map(value).collect()
    }

    /// Returns the last values at increasing times, and true for those that are of the clock.
    pub(super) fn held_at(&self, time_s: &[f64], clock: &[f64], early: f64) -> (Vec<f64>, Vec<bool>) {
        let is_of_clock = |t: &f64| clock.binary_search_by(|own| own.total_cmp(t)).is_ok();
        (self.held(time_s, early), time_s.iter().map(is_of_clock).collect())
    }

    /// Returns the values at increasing times, interpolated linearly between samples, and true at those of samples within `skew`.
    pub(super) fn at(&self, time_s: &[f64], skew: f64) -> (Vec<f64>, Vec<bool>) {
        let (mut values, mut measured) = (Vec::with_capacity(time_s.len()), Vec::with_capacity(time_s.len()));
        let mut at = 0;
        for t in time_s {
            while self.time_s.get(at + 1).is_some_and(|next| *next <= t + skew) {
                at += 1;
            }
            let (before, value) = (self.time_s[at], self.values[at]);
            let is_own = (t - before).abs() <= skew;
            let next = self.time_s.get(at + 1).zip(self.values.get(at + 1)).filter(|_| !is_own && *t > before);
            values.push(next.map_or(value, |(after, next)| value + (next - value) * (t - before) / (after - before)));
            measured.push(is_own);
        }
        (values, measured)
    }
}

/// Returns true if values were logged when they changed: none equals the one before, and their steps are uneven or most changes are
/// those of a coarse quantization.
fn is_of_changes(time_s: &[f64], values: &[f64], step_s: f64) -> bool {
    let steps = time_s.windows(2).map(|pair| pair[1] - pair[0]);
    let uneven = steps.filter(|step| (step / step_s - 1.0).abs() > DEVIATION).count();
    let changes = || values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let least = changes().fold(f64::INFINITY, f64::min);
    let single = changes().filter(|change| (change / least - 1.0).abs() < SAME).count();
    let samples = count(time_s.len());
    least > 0.0 && (count(uneven) > UNEVEN * samples || count(single) > QUANTIZED * samples)
}
