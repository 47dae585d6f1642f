//! The time axis: period, jitter, gaps, repeated and reversed times.

use crate::{Error, Result};

/// Deviation from a regular grid, relative to the period, up to which times count as regular.
pub const TIME_JITTER_UNIFORM: f64 = 0.01;

/// Steps between samples, as a table of the distinct ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Steps {
    /// Median step \[s\].
    pub period_s: f64,
    /// Largest deviation of a step from the period, relative to it.
    pub jitter: f64,
    /// The distinct steps \[s\]: just the period where time is regular.
    pub step_s: Vec<f64>,
    /// For each sample the step after it (for the last, the step before it), as an index into `step_s`; empty where
    /// time is regular.
    pub step_index: Vec<u16>,
}

impl Steps {
    /// The step after sample `n` \[s\].
    #[must_use]
    pub fn step(&self, n: usize) -> f64 {
        self.step_s[self.step_index.get(n).map_or(0, |&index| usize::from(index))]
    }
}

/// Periods and times that a recording can have \[s\]; seconds since 1970 are among them.
const PERIOD_MIN: f64 = 1e-12;
const PERIOD_MAX: f64 = 1e6;
const TIME_MAX: f64 = 1e12;

/// Parts of a period to which irregular times are rounded, so that their steps form a table.
const PARTS: f64 = 1000.0;

/// Steps of at least two times. `lines` are the lines of the file they are on, or empty.
pub(super) fn steps(time_s: &[f64], lines: &[u64]) -> Result<Steps> {
    let located = |error: Error, n: usize| match lines.get(n) {
        Some(&line) => error.at_line(line),
        None => error,
    };
    if let Some(n) = time_s.iter().position(|t| !t.is_finite()) {
        return Err(located(Error::data(format!("time is {}", time_s[n]), "Correct the time."), n));
    }
    let differences: Vec<f64> = time_s.windows(2).map(|w| w[1] - w[0]).collect();
    if let Some(n) = differences.iter().position(|&step| step <= 0.0) {
        let (what, was) = (if differences[n] < 0.0 { "goes back" } else { "is repeated" }, time_s[n]);
        let error = Error::data(
            format!("time {what}: found {} s after {was} s, expected a later time", time_s[n + 1]),
            "Remove the row, or cut the recording there; each row needs a time of its own, enough digits included.",
        );
        return Err(located(error, n + 1));
    }
    let mut sorted = differences.clone();
    let (_, &mut median, _) = sorted.select_nth_unstable_by(differences.len() / 2, f64::total_cmp);
    // The digits of a file's decimals, not those of their difference.
    let period_s = rounded(median, 10);
    if !(PERIOD_MIN..=PERIOD_MAX).contains(&period_s) || time_s.iter().any(|t| t.abs() > TIME_MAX) {
        return Err(Error::data(
            format!(
                "times {period_s} s apart, from {} s to {} s, are none of a recording",
                time_s[0],
                time_s[time_s.len() - 1]
            ),
            "Correct the times, or name their unit: --columns time=HEADING:ms.",
        ));
    }
    if let Some(n) = differences.iter().position(|&step| step > 1.5 * period_s) {
        let missing = (differences[n] / period_s).round() - 1.0;
        let error = Error::data(
            format!(
                "gap in time: {} s follows {} s, {} periods of {period_s} s later",
                time_s[n + 1],
                time_s[n],
                crate::text::significant(differences[n] / period_s, 3)
            ),
            format!("About {missing} samples are missing: cut the recording there and use the longer part."),
        );
        return Err(located(error, n + 1));
    }
    let jitter = differences.iter().fold(0.0, |worst: f64, step| worst.max((step / period_s - 1.0).abs()));
    let (step_s, step_index) = table(time_s, period_s);
    Ok(Steps { period_s, jitter, step_s, step_index })
}

/// `value` to so many significant digits.
pub(super) fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}

/// One step where all times lie on a regular grid; else the times, rounded to a thousandth of the period.
fn table(time_s: &[f64], period_s: f64) -> (Vec<f64>, Vec<u16>) {
    #[expect(clippy::cast_precision_loss, reason = "a count of samples is far below 2^53")]
    let on_grid = |n: usize, t: f64| ((t - time_s[0]) / period_s - n as f64).abs() <= TIME_JITTER_UNIFORM;
    if time_s.iter().enumerate().all(|(n, &t)| on_grid(n, t)) {
        return (vec![period_s], Vec::new());
    }
    #[expect(clippy::cast_possible_truncation, reason = "gaps are refused, so a step is at most 1.5 periods of 1000")]
    let ticks: Vec<u16> = time_s
        .windows(2)
        .map(|w| {
            let tick = |t: f64| ((t - time_s[0]) / period_s * PARTS).round();
            (tick(w[1]) - tick(w[0])).max(1.0) as u16
        })
        .collect();
    let mut distinct = ticks.clone();
    distinct.sort_unstable();
    distinct.dedup();
    let index = |tick: &u16| distinct.partition_point(|d| d < tick);
    #[expect(clippy::cast_possible_truncation, reason = "at most 1501 distinct steps")]
    let mut step_index: Vec<u16> = ticks.iter().map(|tick| index(tick) as u16).collect();
    step_index.extend(step_index.last().copied());
    (distinct.into_iter().map(|tick| f64::from(tick) / PARTS * period_s).collect(), step_index)
}
