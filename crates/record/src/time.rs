//! The time axis: sampling period, jitter, gaps, repeated and reversed times.

use super::lines::Lines;
use motorfit_core::named::named;
use motorfit_core::numeric::{count, differences, extremes, rounded, upper_median};
use motorfit_core::setting::{Text, text};
use motorfit_core::{Error, Result};

named! {
    /// Treatment of gaps in time.
    pub enum Gaps (default Error) {
        /// A gap is an error.
        Error = "error",
        /// A gap is one long step with a constant voltage.
        Keep = "keep",
        /// Each segment between gaps, or between restarts of the clock, is a separate recording.
        Split = "split",
    }
}

/// Largest deviation from a regular grid, relative to the period, at which times count as regular.
pub const TIME_JITTER_UNIFORM: f64 = 0.01;

/// Steps in time between samples, stored as a table of distinct values.
#[derive(Debug, Clone, PartialEq)]
pub struct Steps {
    /// Sampling period \[s\]: the median step, or the mean step of a regular clock whose times are too coarse for it.
    pub period_s: f64,
    /// Largest deviation of a step from the period, relative to the period.
    pub jitter: f64,
    /// Distinct steps \[s\]; only the period if the clock is regular.
    pub step_s: Vec<f64>,
    /// Index into `step_s` of the step after each sample (the last sample repeats the step before it); empty if the clock
    /// is regular.
    pub step_index: Vec<u16>,
}

impl Steps {
    /// Returns the unit of time \[s\] of which every step of an irregular clock is an integer multiple.
    #[must_use]
    pub fn unit_s(&self) -> f64 {
        self.period_s / TICKS_PER_PERIOD
    }

    /// Returns the step after sample `n` \[s\].
    ///
    /// # Panics
    /// Panics if `step_index` refers to a step that `step_s` lacks; [`Record::steps`](super::Record::steps) is complete.
    #[must_use]
    pub fn step(&self, n: usize) -> f64 {
        self.step_s[self.step_index.get(n).map_or(0, |&index| usize::from(index))]
    }
}

/// Returns the step after each of some times \[s\]: one value if the clock is regular. Gaps are long steps.
///
/// # Errors
/// Returns `Data` if there are fewer than two times, or they repeat, decrease or are out of range.
pub fn step_lengths(time_s: &[f64]) -> Result<Vec<f64>> {
    if time_s.len() < 2 {
        return Err(Error::data("there are fewer than two times", "Give at least two samples."));
    }
    let steps = steps(time_s, &Lines::default(), &|_, _| true)?;
    Ok(match steps.step_index.is_empty() {
        true => vec![steps.period_s],
        false => (0..time_s.len()).map(|n| steps.step(n)).collect(),
    })
}

/// Returns the remedy for methods that need evenly spaced samples.
pub(super) fn regular_clock() -> Text {
    text!("Bring the recording to a regular clock with " [Rate = "HZ"] ".")
}

/// Shortest sampling period of a recording \[s\].
const PERIOD_MIN: f64 = 1e-12;
/// Longest sampling period of a recording \[s\].
const PERIOD_MAX: f64 = 1e6;
/// Largest magnitude of a time \[s\]; seconds since 1970 are within it.
const TIME_MAX: f64 = 1e12;

/// Resolution of irregular times, in ticks per period; rounding to it keeps the table of steps small.
const TICKS_PER_PERIOD: f64 = 1000.0;

/// Checks at least two times and returns their steps.
///
/// `lines` are the lines of the samples in the file, or empty. `keep(n, periods)` accepts a gap of that length after sample
/// `n`.
pub(super) fn steps(time_s: &[f64], lines: &Lines, keep: &dyn Fn(usize, f64) -> bool) -> Result<Steps> {
    if !time_s.iter().fold(true, |all, t| all & t.is_finite())
        && let Some(n) = time_s.iter().position(|t| !t.is_finite())
    {
        return Err(Error::data(format!("time is {}", time_s[n]), "Correct the time.").at_line(lines.get(n)));
    }
    let differences = differences(time_s);
    let [shortest, longest] = extremes(&differences);
    if shortest <= 0.0
        && let Some(n) = differences.iter().position(|&step| step <= 0.0)
    {
        let is_back = differences[n] < 0.0;
        let (what, was) = (if is_back { "goes back" } else { "is repeated" }, time_s[n]);
        let message = format!("time {what}: found {} s after {was} s, expected a later time", time_s[n + 1]);
        let hint = match is_back {
            true => text!(
                "If the clock restarted, " [Gaps = "split"] " makes a recording of each segment; a single wrong row \
                 may be removed."
            ),
            false => text!(
                "Remove the row, cut the recording there, or leave out rows of repeated time with " [DropRepeats]
                "; record times with enough digits to distinguish the rows."
            ),
        };
        return Err(Error::data(message, hint).at_line(lines.get(n + 1)));
    }
    // Rounding removes the floating-point error of the differences, so that all steps of a regular clock are equal.
    let period_s = match [shortest, longest].map(|step| rounded(step, 10)) {
        [short, long] if short.to_bits() == long.to_bits() => short,
        _ => rounded(upper_median(&mut differences.clone()), 10),
    };
    let (first, last) = (time_s[0], time_s[time_s.len() - 1]);
    if !(PERIOD_MIN..=PERIOD_MAX).contains(&period_s) || first < -TIME_MAX || last > TIME_MAX {
        let message = format!("times {period_s} s apart, from {first} s to {last} s, are out of range");
        let hint = text!("Correct the times, or name their unit: " [Columns = "time=HEADING:ms"] ".");
        return Err(Error::data(message, hint));
    }
    if longest > period_s * GAP
        && let limit = gap_limit(&differences, period_s)
        && let Some(n) = (0..differences.len()).find(|&n| differences[n] > limit && !keep(n, differences[n] / period_s))
    {
        let (periods, before, after) = (differences[n] / period_s, time_s[n], time_s[n + 1]);
        let (missing, shown) = (periods.round() - 1.0, motorfit_core::text::significant(periods, 3));
        let message = format!("gap in time: {after} s follows {before} s, {shown} periods of {period_s} s later");
        let hint = text!(
            "About {missing} samples are missing: " [Gaps = "split"] " makes a recording of each segment, "
            [Gaps = "keep"] " takes the voltage as constant over the gap."
        );
        return Err(Error::data(message, hint).at_line(lines.get(n + 1)));
    }
    let jitter = [shortest, longest].map(|step| (step / period_s - 1.0).abs());
    let jitter = jitter[0].max(jitter[1]);
    // Times such as seconds since 1970 have few digits after the point: the mean step is more precise than the median.
    let mean = rounded((last - first) / count(time_s.len() - 1), 10);
    let is_near = |period: &f64| (period / period_s - 1.0).abs() < 1e-3;
    if let Some(period_s) = [period_s, mean].into_iter().filter(is_near).find(|period| is_on_grid(time_s, *period)) {
        return Ok(Steps { period_s, jitter, step_s: vec![period_s], step_index: Vec::new() });
    }
    let (step_s, step_index) = table(time_s, period_s)?;
    Ok(Steps { period_s, jitter, step_s, step_index })
}

/// Longest step of a regular clock \[periods\]; longer ones are gaps.
const GAP: f64 = 1.5;
/// Longest step of an irregular clock \[periods\], for loggers that poll with occasional delays; longer ones are gaps.
const GAP_IRREGULAR: f64 = 10.0;
/// Fraction of the steps that must deviate by [`IRREGULAR_STEP`] for the clock to count as irregular.
const IRREGULAR_FRACTION: f64 = 0.1;
/// Deviation of a step from the median, relative to it, that counts as irregular.
const IRREGULAR_STEP: f64 = 0.03;

/// Largest deviation from an integer number of periods at which a long step is attributed to lost samples.
const MULTIPLE: f64 = 0.1;

/// Returns the longest step that is not a gap \[s\].
///
/// A long step counts as evidence of an irregular clock unless it is an integer number of periods, as after lost samples.
fn gap_limit(differences: &[f64], period_s: f64) -> f64 {
    let (mut off, mut all) = (0.0, 0.0);
    for step in differences.iter().map(|step| step / period_s).filter(|step| *step <= GAP_IRREGULAR) {
        let is_lost = step > GAP && (step - step.round()).abs() <= MULTIPLE;
        off += if (step - 1.0).abs() > IRREGULAR_STEP && !is_lost { 1.0 } else { 0.0 };
        all += if is_lost { 0.0 } else { 1.0 };
    }
    let irregular = off > IRREGULAR_FRACTION * all;
    period_s * if irregular { GAP_IRREGULAR } else { GAP }
}

/// Returns the samples that follow gaps.
pub(super) fn gaps(time_s: &[f64]) -> Vec<usize> {
    let differences = differences(time_s);
    if differences.is_empty() {
        return Vec::new();
    }
    let longest = gap_limit(&differences, upper_median(&mut differences.clone()));
    (1..time_s.len()).filter(|&n| differences[n - 1] > longest).collect()
}

/// Returns the first samples of all segments but the first: those after gaps, and those whose time decreases.
pub(super) fn breaks(time_s: &[f64]) -> Vec<usize> {
    let restarts = (1..time_s.len()).filter(|&n| time_s[n] < time_s[n - 1]);
    let edges: Vec<usize> = std::iter::once(0).chain(restarts).chain([time_s.len()]).collect();
    let runs = edges.windows(2).map(|edge| edge[0]..edge[1]);
    let breaks = runs.flat_map(|run| {
        std::iter::once(run.start).chain(gaps(&time_s[run.clone()]).into_iter().map(move |n| n + run.start))
    });
    breaks.filter(|&n| n > 0).collect()
}

/// Returns true if a number of left-out rows accounts for a gap of some periods.
pub(super) fn is_of_left_out(periods: f64, rows: usize) -> bool {
    rows > 0 && periods <= count(rows) + GAP
}

/// Returns true if all times are on a regular grid within [`TIME_JITTER_UNIFORM`].
fn is_on_grid(time_s: &[f64], period_s: f64) -> bool {
    let on_grid = |n: usize, t: f64| ((t - time_s[0]) / period_s - count(n)).abs() <= TIME_JITTER_UNIFORM;
    time_s.iter().enumerate().all(|(n, &t)| on_grid(n, t))
}

/// Returns the distinct steps \[s\], rounded to a thousandth of the period, and the index of the step after each sample.
fn table(time_s: &[f64], period_s: f64) -> Result<(Vec<f64>, Vec<u16>)> {
    let tick = |t: f64| ((t - time_s[0]) / period_s * TICKS_PER_PERIOD).round();
    let ticks: Vec<f64> = time_s.windows(2).map(|w| (tick(w[1]) - tick(w[0])).max(1.0)).collect();
    let mut distinct = ticks.clone();
    distinct.sort_unstable_by(f64::total_cmp);
    distinct.dedup_by(|a, b| a.to_bits() == b.to_bits());
    if distinct.len() > usize::from(u16::MAX) {
        let message = format!("found {} different steps in time, expected at most {}", distinct.len(), u16::MAX);
        return Err(Error::data(message, regular_clock()));
    }
    let index = |tick: &f64| distinct.partition_point(|d| d < tick);
    let mut step_index: Vec<u16> = ticks.iter().map(|tick| u16::try_from(index(tick)).unwrap_or(u16::MAX)).collect();
    step_index.extend(step_index.last().copied());
    Ok((distinct.into_iter().map(|tick| tick / TICKS_PER_PERIOD * period_s).collect(), step_index))
}
