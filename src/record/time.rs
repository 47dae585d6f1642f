//! The time axis: period, jitter, gaps, repeated and reversed times.

use super::Lines;
use crate::named::named;
use crate::numeric::{count, differences, extremes, upper_median};
use crate::setting::{Text, text};
use crate::{Error, Result};

named! {
    /// Treatment of gaps in time.
    pub enum Gaps (default Error) {
        /// Bad data.
        Error = "error",
        /// A long step, over which the voltage is held.
        Keep = "keep",
        /// Each stretch between gaps is a recording of its own, and each run of a clock that starts again.
        Split = "split",
    }
}

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
    /// The time that every step of an irregular clock is a whole multiple of \[s\].
    #[must_use]
    pub fn unit_s(&self) -> f64 {
        self.period_s / PARTS
    }

    /// The step after sample `n` \[s\].
    ///
    /// # Panics
    /// When the table of steps lacks it: [`Record::steps`](super::Record::steps) has those of all samples.
    #[must_use]
    pub fn step(&self, n: usize) -> f64 {
        self.step_s[self.step_index.get(n).map_or(0, |&index| usize::from(index))]
    }
}

/// The hint where only evenly spaced samples serve.
pub(super) fn regular_clock() -> Text {
    text!("Bring the recording to a regular clock with " [Rate = "HZ"] ".")
}

/// Periods and times that a recording can have \[s\]; seconds since 1970 are among them.
const PERIOD_MIN: f64 = 1e-12;
const PERIOD_MAX: f64 = 1e6;
const TIME_MAX: f64 = 1e12;

/// Parts of a period to which irregular times are rounded, so that their steps form a table.
const PARTS: f64 = 1000.0;

/// Steps of at least two times. `lines` are the lines of the file they are on, or empty; `keep` accepts gaps by the sample before
/// and the length in periods.
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
                "Where the clock starts again, " [Gaps = "split"] " makes a recording of each run; a single row may be \
                 removed."
            ),
            false => text!(
                "Remove the row, cut the recording there, or leave out rows of repeated time with " [DropRepeats]
                "; each row needs a time of its own, enough digits included."
            ),
        };
        return Err(Error::data(message, hint).at_line(lines.get(n + 1)));
    }
    // The digits of a file's decimals, not those of their difference; the same for all steps of a regular clock.
    let period_s = match [shortest, longest].map(|step| rounded(step, 10)) {
        [short, long] if short.to_bits() == long.to_bits() => short,
        _ => rounded(upper_median(&mut differences.clone()), 10),
    };
    let (first, last) = (time_s[0], time_s[time_s.len() - 1]);
    if !(PERIOD_MIN..=PERIOD_MAX).contains(&period_s) || first < -TIME_MAX || last > TIME_MAX {
        let message = format!("times {period_s} s apart, from {first} s to {last} s, are none of a recording");
        let hint = text!("Correct the times, or name their unit: " [Columns = "time=HEADING:ms"] ".");
        return Err(Error::data(message, hint));
    }
    if longest > period_s * GAP
        && let limit = gap_limit(&differences, period_s)
        && let Some(n) = (0..differences.len()).find(|&n| differences[n] > limit && !keep(n, differences[n] / period_s))
    {
        let (periods, before, after) = (differences[n] / period_s, time_s[n], time_s[n + 1]);
        let (missing, shown) = (periods.round() - 1.0, crate::text::significant(periods, 3));
        let message = format!("gap in time: {after} s follows {before} s, {shown} periods of {period_s} s later");
        let hint = text!(
            "About {missing} samples are missing: " [Gaps = "split"] " makes a recording of each stretch, "
            [Gaps = "keep"] " holds the voltage over the gap."
        );
        return Err(Error::data(message, hint).at_line(lines.get(n + 1)));
    }
    let jitter = [shortest, longest].map(|step| (step / period_s - 1.0).abs());
    let jitter = jitter[0].max(jitter[1]);
    // Times as large as seconds since 1970 have coarse steps: their mean is finer than their median.
    let mean = rounded((last - first) / count(time_s.len() - 1), 10);
    let is_near = |period: &f64| (period / period_s - 1.0).abs() < 1e-3;
    if let Some(period_s) = [period_s, mean].into_iter().filter(is_near).find(|period| is_on_grid(time_s, *period)) {
        return Ok(Steps { period_s, jitter, step_s: vec![period_s], step_index: Vec::new() });
    }
    let (step_s, step_index) = table(time_s, period_s)?;
    Ok(Steps { period_s, jitter, step_s, step_index })
}

/// Steps longer than so many periods are gaps: samples are missing.
const GAP: f64 = 1.5;
/// The same where the clock is irregular: a logger that polls takes its time now and then.
const GAP_IRREGULAR: f64 = 10.0;
/// A clock is irregular where so many of the steps that are no gaps are so far from their median.
const IRREGULAR_PART: f64 = 0.1;
const IRREGULAR_STEP: f64 = 0.03;

/// Steps of lost samples are so near to whole numbers of periods.
const MULTIPLE: f64 = 0.1;

/// The longest step that is no gap \[s\].
///
/// A long step counts as one of an irregular clock unless it is a whole number of periods, as where samples were lost.
fn gap_limit(differences: &[f64], period_s: f64) -> f64 {
    let (mut off, mut all) = (0.0, 0.0);
    for step in differences.iter().map(|step| step / period_s).filter(|step| *step <= GAP_IRREGULAR) {
        let is_lost = step > GAP && (step - step.round()).abs() <= MULTIPLE;
        off += if (step - 1.0).abs() > IRREGULAR_STEP && !is_lost { 1.0 } else { 0.0 };
        all += if is_lost { 0.0 } else { 1.0 };
    }
    let irregular = off > IRREGULAR_PART * all;
    period_s * if irregular { GAP_IRREGULAR } else { GAP }
}

/// The samples that follow gaps.
pub(super) fn gaps(time_s: &[f64]) -> Vec<usize> {
    let differences = differences(time_s);
    if differences.is_empty() {
        return Vec::new();
    }
    let longest = gap_limit(&differences, upper_median(&mut differences.clone()));
    (1..time_s.len()).filter(|&n| differences[n - 1] > longest).collect()
}

/// The samples at which a stretch begins: those that follow gaps, and those whose time goes back.
pub(super) fn breaks(time_s: &[f64]) -> Vec<usize> {
    let restarts = (1..time_s.len()).filter(|&n| time_s[n] < time_s[n - 1]);
    let edges: Vec<usize> = std::iter::once(0).chain(restarts).chain([time_s.len()]).collect();
    let runs = edges.windows(2).map(|edge| edge[0]..edge[1]);
    let breaks = runs.flat_map(|run| {
        std::iter::once(run.start).chain(gaps(&time_s[run.clone()]).into_iter().map(move |n| n + run.start))
    });
    breaks.filter(|&n| n > 0).collect()
}

/// Returns whether a gap of some periods is one of so many rows that were left out.
pub(super) fn is_of_left_out(periods: f64, rows: usize) -> bool {
    rows > 0 && periods <= count(rows) + GAP
}

/// `value` to so many significant digits.
pub(crate) fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}

/// Returns whether all times lie on a regular grid.
fn is_on_grid(time_s: &[f64], period_s: f64) -> bool {
    let on_grid = |n: usize, t: f64| ((t - time_s[0]) / period_s - count(n)).abs() <= TIME_JITTER_UNIFORM;
    time_s.iter().enumerate().all(|(n, &t)| on_grid(n, t))
}

/// The steps between times, rounded to a thousandth of the period.
fn table(time_s: &[f64], period_s: f64) -> Result<(Vec<f64>, Vec<u16>)> {
    let tick = |t: f64| ((t - time_s[0]) / period_s * PARTS).round();
    let ticks: Vec<f64> = time_s.windows(2).map(|w| (tick(w[1]) - tick(w[0])).max(1.0)).collect();
    let mut distinct = ticks.clone();
    distinct.sort_unstable_by(f64::total_cmp);
    distinct.dedup_by(|a, b| a.to_bits() == b.to_bits());
    if distinct.len() > usize::from(u16::MAX) {
        return Err(Error::data(format!("{} different steps between samples", distinct.len()), regular_clock()));
    }
    let index = |tick: &f64| distinct.partition_point(|d| d < tick);
    let mut step_index: Vec<u16> = ticks.iter().map(|tick| u16::try_from(index(tick)).unwrap_or(u16::MAX)).collect();
    step_index.extend(step_index.last().copied());
    Ok((distinct.into_iter().map(|tick| tick / PARTS * period_s).collect(), step_index))
}
