//! Channels with different clocks on one clock, that of the input.

use super::formats::Series;
use crate::numeric::{count, upper_median};
use crate::text::{counted, engineering};

/// A column of a channel that is used.
pub(super) struct Wanted {
    /// Index of its series, and of the column in it.
    pub at: (usize, usize),
    /// Name for notes.
    pub name: String,
    /// True for an input, which holds between its samples; outputs are interpolated.
    pub is_input: bool,
}

/// Columns at the times of one clock.
#[derive(Debug, Default)]
pub(super) struct Merged {
    /// Times \[s\].
    pub time_s: Vec<f64>,
    /// Values of each wanted column.
    pub columns: Vec<Vec<f64>>,
    /// Notes on the clock and the methods.
    pub notes: Vec<String>,
    /// Number of samples of the slowest interpolated output over that of the clock, at most 1; `None` if no output was
    /// interpolated by more than [`SKEW`] of a period.
    pub interpolated: Option<f64>,
}

/// Distance between the times of two channels, relative to the period, up to which their samples count as simultaneous.
const SKEW: f64 = 0.01;
/// Length of a gap between samples, relative to their median step, over which nothing is interpolated.
const GAP: f64 = 2.5;
/// Number of samples of an input, relative to those of an output, below which it was logged when it changed.
const CHANGES: f64 = 0.5;
/// Distance between the times of two channels, relative to the period, up to which they are of one period of a control loop.
const SAME_PERIOD: f64 = 0.2;
/// Ratio of two periods from which they are equal.
const EQUAL: f64 = 0.95;
/// Number of samples outside of the other channels that is not worth a note.
const EDGE: usize = 2;

/// Brings the wanted columns of several series to one clock: that of the input with the most samples, or that of the output with the
/// most samples if the input was logged when it changed. Inputs hold their last value, outputs are interpolated linearly.
///
/// `holds` is true for logs of changes: an output whose samples have a gap holds its value in it; otherwise the times in the gap
/// are left out.
pub(super) fn merged(mut series: Vec<Series>, wanted: &[Wanted], holds: bool) -> Merged {
    let notes = cleaned(&mut series, wanted);
    let is_same = series.windows(2).all(|pair| {
        let lengths = [&pair[0], &pair[1]].map(|series| series.columns.first().map_or(0, Vec::len));
        pair[0].time_s == pair[1].time_s && lengths[0] == lengths[1]
    });
    if is_same {
        let time_s = series.first().map(|first| first.time_s.clone()).unwrap_or_default();
        let columns = wanted.iter().map(|w| series[w.at.0].columns[w.at.1].clone()).collect();
        return Merged { time_s, columns, notes, interpolated: None };
    }
    let inputs = wanted.iter().filter(|w| w.is_input);
    let (input, output) = (inputs.max_by_key(|w| series[w.at.0].time_s.len()), wanted.iter().find(|w| !w.is_input));
    let changes = input.zip(output).is_some_and(|(input, output)| is_sparse(&series[input.at.0], &series[output.at.0]));
    let clock = if changes && holds { output } else { input.or(output) };
    let Some(clock) = clock else { return Merged::default() };
    let time_s = common(&series, wanted, clock.at.0, &series[clock.at.0].time_s);
    let period = median_step(&series[clock.at.0].time_s);
    let early = SAME_PERIOD * period;
    let tracks: Vec<Track<'_>> = wanted.iter().map(|w| Track::new(&series[w.at.0], w, holds, early)).collect();
    let (mut columns, facts): (Vec<Vec<f64>>, Vec<Facts>) = tracks.iter().map(|track| track.values(&time_s)).unzip();
    let is_in_gap = |n: usize| columns.iter().any(|column| column[n].is_nan());
    let kept: Vec<usize> = (0..time_s.len()).filter(|n| !is_in_gap(*n)).collect();
    let left_out = time_s.len() - kept.len();
    let of_kept = |values: &Vec<f64>| kept.iter().map(|n| values[*n]).collect::<Vec<f64>>();
    if left_out > 0 {
        columns = columns.iter().map(of_kept).collect();
    }
    let mut merged = Merged { time_s: of_kept(&time_s), columns, notes, interpolated: None };
    let rate = |series: &Series| match median_step(&series.time_s) {
        step if step.is_finite() => format!(" ({})", engineering(1.0 / step, "Hz", 4)),
        _ => String::new(),
    };
    let why = if changes && holds { ", as the input is logged when it changes" } else { "" };
    let own = &series[clock.at.0];
    merged.notes.push(format!("channels are brought to the clock of {}{}{why}", clock.name, rate(own)));
    for ((wanted, facts), track) in wanted.iter().zip(&facts).zip(&tracks) {
        if wanted.at.0 == clock.at.0 {
            continue;
        }
        let how = if wanted.is_input { "holds its last value" } else { "is interpolated linearly" };
        let held = if holds && facts.held > 0 && !wanted.is_input {
            format!("; in gaps it holds its value ({})", counted(facts.held, "sample"))
        } else {
            String::new()
        };
        merged.notes.push(format!("{}{} {how}{held}", wanted.name, rate(track.series)));
        if !wanted.is_input && facts.distance > SKEW * period {
            let ratio = period / median_step(&track.series.time_s);
            // Of equal rates each sample of the output counts once.
            let ratio = if ratio < EQUAL { ratio } else { 1.0 };
            merged.interpolated = Some(merged.interpolated.unwrap_or(1.0).min(ratio));
        }
    }
    if left_out > 0 {
        merged.notes.push(format!("{} in gaps of other channels left out", counted(left_out, "sample")));
    }
    let outside = own.time_s.len() - time_s.len();
    if outside > EDGE {
        merged.notes.push(format!("{} before or after those of other channels left out", counted(outside, "sample")));
    }
    merged
}

/// Removes samples without a number and repeated ones; returns notes on them.
fn cleaned(series: &mut [Series], wanted: &[Wanted]) -> Vec<String> {
    let mut notes = Vec::new();
    let is_timeless = series.iter().all(|series| series.time_s.is_empty());
    if is_timeless {
        notes.extend(without_nan_rows(series));
    }
    for (n, series) in series.iter_mut().enumerate().filter(|_| !is_timeless) {
        let name = wanted.iter().find(|wanted| wanted.at.0 == n).map_or("", |wanted| &wanted.name);
        for (left_out, why) in
            [(without_nan(series), "without a number"), (without_repeats(series), "that repeat the one before")]
        {
            if left_out > 0 {
                notes.push(format!("{} of {name} {why} left out", counted(left_out, "sample")));
            }
        }
    }
    notes
}

/// Returns true if an input was logged when it changed: it has far fewer samples than an output, or a longer gap within them.
fn is_sparse(input: &Series, output: &Series) -> bool {
    let gap = GAP * median_step(&output.time_s);
    let has_gap = || input.time_s.windows(2).any(|pair| pair[1] - pair[0] > gap);
    let ends_early = || output.time_s.last().zip(input.time_s.last()).is_some_and(|(last, own)| last - own > gap);
    count(input.time_s.len()) < CHANGES * count(output.time_s.len()) || has_gap() || ends_early()
}

/// Removes the rows of tables without times that have NaN in any column; returns the note on them.
fn without_nan_rows(all: &mut [Series]) -> Option<String> {
    let rows = all.iter().flat_map(|series| &series.columns).map(Vec::len).min().unwrap_or(0);
    let is_good = |n: &usize| all.iter().flat_map(|series| &series.columns).all(|column| !column[*n].is_nan());
    let good: Vec<usize> = (0..rows).filter(is_good).collect();
    let left_out = rows - good.len();
    if left_out > 0 {
        let columns = all.iter_mut().flat_map(|series| &mut series.columns);
        columns.for_each(|column| *column = good.iter().map(|n| column[*n]).collect());
    }
    (left_out > 0).then(|| format!("{} without a number left out", counted(left_out, "row")))
}

/// Removes the samples that have NaN in a column; returns their number.
fn without_nan(series: &mut Series) -> usize {
    keep(series, |series, n| series.columns.iter().all(|column| !column[n].is_nan()))
}

/// Removes the samples that repeat the time and the values of the one before; returns their number.
fn without_repeats(series: &mut Series) -> usize {
    keep(series, |series, n| {
        let is_repeated = |values: &Vec<f64>| n > 0 && values[n].to_bits() == values[n - 1].to_bits();
        series.time_s.is_empty() || !is_repeated(&series.time_s) || !series.columns.iter().all(is_repeated)
    })
}

/// Keeps the samples that pass a test; returns the number of the others.
fn keep(series: &mut Series, is_kept: impl Fn(&Series, usize) -> bool) -> usize {
    let count = series.columns.first().map_or(0, Vec::len);
    let good: Vec<usize> = (0..count).filter(|n| is_kept(series, *n)).collect();
    if good.len() < count {
        let kept = |values: &Vec<f64>| good.iter().filter_map(|n| values.get(*n).copied()).collect();
        series.columns = series.columns.iter().map(kept).collect();
        series.time_s = kept(&series.time_s);
    }
    count - good.len()
}

/// Returns the times of a clock at which every wanted column has a value.
fn common(series: &[Series], wanted: &[Wanted], clock: usize, time_s: &[f64]) -> Vec<f64> {
    let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
    for wanted in wanted.iter().filter(|wanted| wanted.at.0 != clock) {
        let times = &series[wanted.at.0].time_s;
        let Some((first, last)) = times.first().zip(times.last()) else { return Vec::new() };
        from = from.max(*first);
        to = if wanted.is_input { to } else { to.min(*last) };
    }
    // A skew between channels must not cost the first and the last sample.
    let margin = SAME_PERIOD * median_step(time_s);
    time_s.iter().copied().filter(|t| *t >= from - margin && *t <= to + margin).collect()
}

/// Returns the median step between times; infinite for fewer than two.
pub(super) fn median_step(time_s: &[f64]) -> f64 {
    let mut steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    if steps.is_empty() { f64::INFINITY } else { upper_median(&mut steps) }
}

/// Facts on the values of a column at the times of the clock.
#[derive(Debug, Clone, Default)]
struct Facts {
    /// Number of values that were held over a gap.
    held: usize,
    /// Largest distance between a time of the clock and the nearest sample that it was computed from \[s\].
    distance: f64,
}

/// A column as a function of time.
struct Track<'a> {
    series: &'a Series,
    of: &'a [f64],
    is_input: bool,
    holds: bool,
    gap_s: f64,
    /// Time by which a value acts early: an input that is logged after an output in the same period of a robot.
    early_s: f64,
}

impl<'a> Track<'a> {
    fn new(series: &'a Series, wanted: &Wanted, holds: bool, early: f64) -> Self {
        let gap_s = GAP * median_step(&series.time_s);
        Self {
            series,
            of: &series.columns[wanted.at.1],
            is_input: wanted.is_input,
            holds,
            gap_s,
            early_s: if wanted.is_input && holds { early } else { 0.0 },
        }
    }

    /// Returns the values at increasing times; NaN in a gap.
    fn values(&self, time_s: &[f64]) -> (Vec<f64>, Facts) {
        let (mut at, mut facts) = (0, Facts::default());
        let values = time_s.iter().map(|t| self.value(*t, &mut at, &mut facts).unwrap_or(f64::NAN)).collect();
        (values, facts)
    }

    /// Returns the value at a time; `at` is the sample before it, which moves on with increasing times. `None` in a gap.
    fn value(&self, t: f64, at: &mut usize, facts: &mut Facts) -> Option<f64> {
        let time = &self.series.time_s;
        while time.get(*at + 1).is_some_and(|next| *next <= t + self.early_s) {
            *at += 1;
        }
        let (before, value) = (*time.get(*at)?, *self.of.get(*at)?);
        let Some((after, next)) = time.get(*at + 1).zip(self.of.get(*at + 1)) else { return Some(value) };
        if self.is_input || before >= t {
            return Some(value);
        }
        let step = after - before;
        if step > self.gap_s {
            facts.held += 1;
            return self.holds.then_some(value);
        }
        facts.distance = facts.distance.max((t - before).min(after - t));
        Some(value + (next - value) * (t - before) / step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(time_s: &[f64], values: &[f64]) -> Series {
        Series { time_s: time_s.to_vec(), columns: vec![values.to_vec()] }
    }

    fn wanted() -> [Wanted; 2] {
        let of = |n: usize, name: &str, is_input| Wanted { at: (n, 0), name: name.to_owned(), is_input };
        [of(0, "voltage", true), of(1, "speed", false)]
    }

    #[test]
    fn outputs_are_interpolated_to_the_clock_of_the_input() {
        let input = series(&[0.0, 1.0, 2.0, 3.0, 4.0], &[1.0, 1.0, 2.0, 2.0, 2.0]);
        let output = series(&[0.5, 1.5, 2.5, 3.5], &[5.0, 15.0, 25.0, 35.0]);
        let merged = merged(vec![input, output], &wanted(), false);
        assert_eq!(merged.time_s, [1.0, 2.0, 3.0]);
        assert_eq!(merged.columns, [[1.0, 2.0, 2.0], [10.0, 20.0, 30.0]]);
        assert_eq!(merged.interpolated, Some(1.0), "the output has the rate of the clock");
        assert!(merged.notes[0].contains("clock of voltage (1.000 Hz)"), "{:?}", merged.notes);
    }

    #[test]
    fn an_input_that_is_logged_when_it_changes_holds_on_the_clock_of_the_output() {
        let input = series(&[0.0, 2.5], &[0.0, 7.0]);
        let output = series(&[0.0, 1.0, 2.0, 3.0, 4.0], &[0.0, 0.0, 0.0, 1.0, 2.0]);
        let merged = merged(vec![input, output], &wanted(), true);
        assert_eq!(merged.columns, [[0.0, 0.0, 0.0, 7.0, 7.0], [0.0, 0.0, 0.0, 1.0, 2.0]]);
        assert_eq!(merged.interpolated, None);
    }

    #[test]
    fn gaps_hold_in_logs_of_changes_and_are_left_out_otherwise() {
        let times: Vec<f64> = (0..9).map(f64::from).collect();
        let input = series(&times, &[1.0; 9]);
        let output = series(&[0.0, 1.0, 2.0, 7.0, 8.0], &[0.0, 0.0, 0.0, 3.0, 4.0]);
        let held = merged(vec![input.clone(), output.clone()], &wanted(), true);
        assert_eq!(held.columns[1], [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 3.0, 4.0]);
        let cut = merged(vec![input, output], &wanted(), false);
        assert_eq!(cut.time_s, [0.0, 1.0, 2.0, 7.0, 8.0]);
        assert!(cut.notes.iter().any(|note| note.contains("4 samples in gaps")), "{:?}", cut.notes);
    }

    #[test]
    fn a_slower_output_counts_by_its_own_samples() {
        let times: Vec<f64> = (0..101).map(f64::from).collect();
        let slow: Vec<f64> = (0..26).map(|n| 4.0 * f64::from(n) + 0.5).collect();
        let input = series(&times, &times);
        let merged = merged(vec![input, series(&slow, &slow)], &wanted(), false);
        assert_eq!(merged.interpolated, Some(0.25));
        assert!(merged.time_s.iter().zip(&merged.columns[1]).all(|(t, value)| (t - value).abs() < 1e-12));
    }

    #[test]
    fn an_input_that_is_logged_late_in_a_period_acts_in_it() {
        // Both have gaps, as in logs of changes; the voltage is written 1 ms after the speed.
        let speed = series(&[0.0, 0.02, 0.04, 0.06, 0.08, 0.1], &[0.0, 0.0, 1.0, 2.0, 3.0, 4.0]);
        let input = series(&[0.001, 0.041], &[0.0, 7.0]);
        let merged = merged(vec![input, speed], &wanted(), true);
        assert_eq!(merged.columns[0], [0.0, 0.0, 7.0, 7.0, 7.0, 7.0]);
    }

    #[test]
    fn rows_without_times_lose_nan_together() {
        let of = |values: &[f64]| Series { time_s: Vec::new(), columns: vec![values.to_vec()] };
        let merged = merged(vec![of(&[1.0, f64::NAN, 3.0, 4.0]), of(&[5.0, 6.0, f64::NAN, 8.0])], &wanted(), false);
        assert_eq!(merged.columns, [[1.0, 4.0], [5.0, 8.0]]);
    }

    #[test]
    fn equal_times_are_not_touched() {
        let (input, output) = (series(&[0.0, 0.1], &[1.0, 2.0]), series(&[0.0, 0.1], &[3.0, 4.0]));
        let merged = merged(vec![input, output], &wanted(), false);
        assert_eq!((merged.columns, merged.notes.len()), (vec![vec![1.0, 2.0], vec![3.0, 4.0]], 0));
    }
}
