//! Signals of a recording from the columns of one or more tables: time from a sample rate, speed from position by central
//! differences, removal of rows that are not samples, joining of files.

use crate::heading::Quantity;
use crate::lines::Lines;
use crate::measured_at::MeasuredAt;
use crate::position::position_ratio;
use crate::samples::{NamedSignal, Samples};
use crate::source::Source;
use motorfit_core::numeric::{count, extremes, upper_median};
use motorfit_core::setting::text;
use motorfit_core::text::{counted, engineering};
use motorfit_core::{Error, Result};
use std::ops::Range;

/// Signals of a table by quantity, in SI units: all those of a recording, or some of them.
#[derive(Debug)]
pub(super) struct Signals {
    pub source: Source,
    pub list: Vec<(Quantity, Vec<f64>)>,
    /// Lines of rows that could not be read and were skipped, in increasing order.
    pub left_out: Vec<u64>,
    /// True for each signal of a model that is an input.
    pub inputs: Vec<bool>,
    /// Outputs that were measured at some of the samples only.
    pub measured_at: Vec<MeasuredAt>,
    /// True if the inputs hold over gaps in time: a robot that is late changes nothing.
    pub holds: bool,
}

/// Returns the signal of a model.
fn named((quantity, values): (Quantity, Vec<f64>), inputs: &[bool]) -> NamedSignal {
    let number = if let Quantity::Signal(number) = quantity { usize::from(number) } else { usize::MAX };
    NamedSignal { number, is_input: inputs.get(number).copied().unwrap_or(false), values }
}

impl Signals {
    /// Returns the signals without rows at the end that were never filled, and with the time of a sample rate \[Hz\] if there
    /// is no time column.
    ///
    /// # Errors
    /// Returns a `Data` error if time follows from the rate and rows between the samples were skipped.
    pub(super) fn timed(mut self, rate_hz: Option<f64>) -> Result<Self> {
        self.drop_trailing_zeros();
        if let (None, Some(rate)) = (self.get(Quantity::Time), rate_hz) {
            let lines = &self.source.lines;
            let (first, last) = (lines.get(0), lines.get(lines.len().saturating_sub(1)));
            let is_inside = |line: &&u64| Some(**line) > first && Some(**line) < last;
            if let Some(&line) = self.left_out.iter().find(is_inside) {
                let message = "time is counted in rows, but this row cannot be read and may or may not be a sample";
                let hint = text!(
                    "Remove the line if it is a message of the logger, or cut the recording there; a time column needs \
                     no " [Rate] "."
                );
                return Err(Error::data(message, hint).at_line(line));
            }
            let time = (0..lines.len()).map(|n| count(n) / rate).collect();
            self.list.insert(0, (Quantity::Time, time));
            self.source.notes.push(format!("time computed from a sample rate of {}", engineering(rate, "Hz", 6)));
        }
        Ok(self)
    }

    /// Returns the signals of a range of samples.
    pub(super) fn part(&self, range: Range<usize>) -> Self {
        let cut = |(quantity, signal): &(Quantity, Vec<f64>)| (*quantity, signal[range.clone()].to_vec());
        let source = Source { lines: self.source.lines.of(range.clone()), ..self.source.clone() };
        let list = self.list.iter().map(cut).collect();
        let of_part = |of: &MeasuredAt| MeasuredAt { samples: of.samples[range.clone()].to_vec(), ..*of };
        let measured_at = self.measured_at.iter().map(of_part).collect();
        Self { source, list, left_out: Vec::new(), inputs: self.inputs.clone(), measured_at, holds: self.holds }
    }

    /// Returns the number of rows between a sample and the next one that could not be read.
    pub(super) fn left_out_after(lines: &Lines, left_out: &[u64], sample: usize) -> usize {
        let Some((from, to)) = lines.get(sample).zip(lines.get(sample + 1)) else { return 0 };
        left_out.partition_point(|line| *line < to).saturating_sub(left_out.partition_point(|line| *line <= from))
    }

    /// Returns the signal of a quantity.
    pub(super) fn get(&self, quantity: Quantity) -> Option<&Vec<f64>> {
        self.list.iter().find(|(q, _)| *q == quantity).map(|(_, signal)| signal)
    }

    /// Removes and returns the signal of a quantity.
    fn take(&mut self, quantity: Quantity) -> Option<Vec<f64>> {
        let at = self.list.iter().position(|(q, _)| *q == quantity)?;
        Some(self.list.remove(at).1)
    }

    /// Removes rows at the end whose time is zero: the logger never filled them.
    fn drop_trailing_zeros(&mut self) {
        let Some(time) = self.get(Quantity::Time) else { return };
        let kept = time.len() - time.iter().rev().take_while(|t| **t == 0.0).count();
        if kept > 0 && kept < time.len() && time[kept - 1] > 0.0 {
            let kept: Vec<usize> = (0..kept).collect();
            self.keep(&kept, "with time 0 at the end");
        }
    }

    /// Removes samples that repeat the time of the sample before.
    pub(super) fn drop_repeats(&mut self) {
        let Some(time) = self.get(Quantity::Time) else { return };
        let kept: Vec<usize> = (0..time.len()).filter(|&n| n == 0 || (time[n] - time[n - 1]).abs() > 0.0).collect();
        if kept.len() < time.len() {
            self.keep(&kept, "of repeated time");
        }
    }

    /// Removes all samples but those with the indices `kept`, with a note; `what` describes the removed rows.
    fn keep(&mut self, kept: &[usize], what: &str) {
        let dropped = self.list.first().map_or(0, |(_, signal)| signal.len()) - kept.len();
        for (_, signal) in &mut self.list {
            *signal = kept.iter().map(|&n| signal[n]).collect();
        }
        for of in &mut self.measured_at {
            of.samples = kept.iter().map(|&n| of.samples[n]).collect();
        }
        self.source.lines = self.source.lines.of(kept.iter().copied());
        self.source.notes.push(format!("{} {what} left out", counted(dropped, "row")));
    }

    /// Joins the signals with those of another file: appends them in time if both have the same quantities, merges them if no
    /// quantity is in both.
    ///
    /// # Errors
    /// Returns a `Data` error if the files share some quantities but not all, or are to be merged and have different times.
    pub(super) fn joined(mut self, mut other: Self) -> Result<Self> {
        let quantities =
            |signals: &Self| signals.list.iter().map(|(q, _)| *q).filter(|q| *q != Quantity::Time).collect::<Vec<_>>();
        let (ours, theirs) = (quantities(&self), quantities(&other));
        let both = theirs.iter().filter(|q| ours.contains(q)).count();
        let time = other.take(Quantity::Time).unwrap_or_default();
        if both == 0 {
            self.check_same_times(&time)?;
            self.list.append(&mut other.list);
            self.measured_at.append(&mut other.measured_at);
        } else if both == ours.len() && both == theirs.len() {
            self.append_measured_at([self.count(), time.len()], other.measured_at);
            self.append_later(time, other.list);
        } else {
            let names: Vec<String> = theirs.iter().map(ToString::to_string).collect();
            let message = format!("holds {}; the files before hold some of these, but not all", names.join(", "));
            let hint = text!(
                "Files of one recording hold either the same quantities (one after the other in time) or different \
                 ones (at the same times); select the columns with " [Columns] "."
            );
            return Err(Error::data(message, hint));
        }
        let have: Vec<Quantity> = self.source.columns.iter().map(|column| column.quantity).collect();
        self.source.columns.extend(other.source.columns.into_iter().filter(|column| !have.contains(&column.quantity)));
        self.source.ignored.append(&mut other.source.ignored);
        self.source.notes.append(&mut other.source.notes);
        self.source.last_line_open |= other.source.last_line_open;
        Ok(self)
    }

    /// Returns the number of samples.
    fn count(&self) -> usize {
        self.list.first().map_or(0, |(_, signal)| signal.len())
    }

    /// Appends the samples at which outputs were measured in a later file, which has `more` samples after `own`.
    fn append_measured_at(&mut self, [own, more]: [usize; 2], later: Vec<MeasuredAt>) {
        let is_new = |of: &&MeasuredAt| self.measured_at.iter().all(|known| known.quantity != of.quantity);
        let new: Vec<Quantity> = later.iter().filter(is_new).map(|of| of.quantity).collect();
        self.measured_at.extend(new.into_iter().map(|quantity| MeasuredAt { quantity, samples: vec![true; own] }));
        for of in &mut self.measured_at {
            match later.iter().find(|other| other.quantity == of.quantity) {
                Some(other) => of.samples.extend(&other.samples),
                None => of.samples.resize(own + more, true),
            }
        }
    }

    /// Checks that the times of another file equal those of these signals to 1 % of the shortest step.
    fn check_same_times(&self, time: &[f64]) -> Result<()> {
        let own = self.get(Quantity::Time).map_or(&[][..], Vec::as_slice);
        let period = own.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
        let apart = own.iter().zip(time).position(|(a, b)| (a - b).abs() > 0.01 * period);
        let what = match apart {
            Some(n) => format!("sample {} is at {} s, that of the files before at {} s", n + 1, time[n], own[n]),
            None if own.len() != time.len() => {
                format!("{} samples, {} in the files before", time.len(), own.len())
            }
            None => return Ok(()),
        };
        Err(Error::data(
            what,
            "Files with different quantities must have the same times: export them on one time axis.",
        ))
    }

    /// Appends later samples; a time that restarts is shifted so that it continues one step after the last sample.
    fn append_later(&mut self, mut time: Vec<f64>, list: Vec<(Quantity, Vec<f64>)>) {
        if let Some([.., before, last]) = self.get(Quantity::Time).map(Vec::as_slice)
            && let Some(&first) = time.first()
            && first <= *last
        {
            let shift = 2.0 * last - before - first;
            time.iter_mut().for_each(|t| *t += shift);
            self.source.notes.push(format!("a file whose time restarts is shifted by {}", engineering(shift, "s", 6)));
        }
        for (quantity, mut signal) in list.into_iter().chain([(Quantity::Time, time)]) {
            if let Some((_, own)) = self.list.iter_mut().find(|(q, _)| *q == quantity) {
                own.append(&mut signal);
            }
        }
    }

    /// Checks that a position is not that of a counter that wraps around, because the count at which it wraps is unknown. A
    /// position with a range of more than one turn counts as wrapping if it jumps by more than half of the range while the
    /// median step is less than 5 % of it.
    fn check_counter(&self, position: &[f64]) -> Result<()> {
        let [low, high] = extremes(position);
        let range = high - low;
        let mut steps: Vec<f64> = position.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
        let jump = steps.iter().position(|step| *step > 0.5 * range);
        if steps.len() < 10 || range <= 1.001 * std::f64::consts::TAU {
            return Ok(());
        }
        let usual = upper_median(&mut steps);
        let Some(n) = jump.filter(|_| usual < 0.05 * range) else { return Ok(()) };
        let message = "the position jumps by more than half of its range, like a counter that wraps around";
        let hint =
            "Unwrap the counter in the file, or give a speed; angles within one turn are unwrapped automatically.";
        Err(Error::data(message, hint).at_line(self.source.lines.get(n + 1)))
    }

    /// Returns the signals as samples, and the samples at which outputs were measured if those are not all. A missing voltage or time is
    /// empty; the checks of a recording decide on it.
    ///
    /// # Errors
    /// Returns a `Data` error if the speed is to be computed from a position that wraps around or has one sample only.
    pub(super) fn samples(mut self) -> Result<(Samples, Source, Vec<MeasuredAt>)> {
        let time_s = self.take(Quantity::Time).unwrap_or_default();
        let mut speed = self.take(Quantity::Speed);
        let position = self.take(Quantity::Position);
        if let (Some(speed), Some(position)) = (&speed, &position) {
            let compared = [&time_s[..], &unwrapped(position.clone())[..], &speed[..]];
            let is_complete = self.measured_at.iter().all(|of| of.quantity != Quantity::Position);
            self.source.position_ratio = position_ratio(std::iter::once(compared)).filter(|_| is_complete);
        } else if let Some(position) = position {
            speed = Some(self.speed_from(position, &time_s)?);
            self.source.notes.push("speed is the central difference of the position".to_owned());
            let of_position = self.measured_at.iter_mut().filter(|of| of.quantity == Quantity::Position);
            of_position.for_each(|of| of.quantity = Quantity::Speed);
        }
        let signals = std::mem::take(&mut self.list).into_iter();
        let (signals, list): (Vec<_>, Vec<_>) =
            signals.partition(|(quantity, _)| matches!(quantity, Quantity::Signal(_)));
        self.list = list;
        let samples = Samples {
            named: signals.into_iter().map(|signal| named(signal, &self.inputs)).collect(),
            time_s,
            voltage: self.take(Quantity::Voltage).unwrap_or_default(),
            torque: self.take(Quantity::Torque),
            current: self.take(Quantity::Current),
            speed,
        };
        Ok((samples, self.source, self.measured_at))
    }

    /// Returns the speed as differences of a position between the samples at which it was measured.
    fn speed_from(&self, position: Vec<f64>, time_s: &[f64]) -> Result<Vec<f64>> {
        let of = |of: &&MeasuredAt| of.quantity == Quantity::Position;
        let own = self.measured_at.iter().find(of).map(MeasuredAt::indices);
        // If the clock restarts, the checks of time report that instead.
        let is_ordered = time_s.windows(2).all(|t| t[1] >= t[0]);
        let Some(own) = own else {
            if is_ordered {
                self.check_counter(&position)?;
            }
            // Repeated times give infinite speeds here; the later checks of time refuse them and name the line.
            return differences(time_s, unwrapped(position));
        };
        let of_own = |values: &[f64]| own.iter().filter_map(|n| values.get(*n).copied()).collect::<Vec<f64>>();
        let (times, position) = (of_own(time_s), of_own(&position));
        self.check_counter(&position)?;
        let found = differences(&times, unwrapped(position))?;
        let mut speed = vec![0.0; time_s.len()];
        own.iter().zip(found).for_each(|(n, value)| speed[*n] = value);
        Ok(speed)
    }
}

/// Unwraps a position \[rad\] whose range is at most one turn and that jumps by more than half a turn.
fn unwrapped(mut position: Vec<f64>) -> Vec<f64> {
    use std::f64::consts::{PI, TAU};
    let [low, high] = extremes(&position);
    let range = high - low;
    if !(range <= TAU * 1.001 && position.windows(2).any(|w| (w[1] - w[0]).abs() > PI)) {
        return position;
    }
    let mut turns = 0.0;
    let mut last = position[0];
    for value in &mut position[1..] {
        turns -= ((*value - last) / TAU).round();
        last = *value;
        *value += TAU * turns;
    }
    position
}

/// Returns central differences of a position, one-sided at both ends. They have no delay and reduce the amplitude of a sine
/// of angular frequency ω by the fraction `(ω h)²/6`, with the step h.
fn differences(time_s: &[f64], position: Vec<f64>) -> Result<Vec<f64>> {
    let last = position.len().saturating_sub(1);
    if last == 0 || time_s.len() != position.len() {
        return Err(Error::data("at least two positions are needed to compute a speed", "Record longer."));
    }
    Ok((0..=last)
        .map(|n| {
            let (from, to) = (n.saturating_sub(1), (n + 1).min(last));
            (position[to] - position[from]) / (time_s[to] - time_s[from])
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrapped_position_is_unwrapped() {
        let true_position: Vec<f64> = (0..50).map(|n| f64::from(n) * 0.4 - 1.0).collect();
        let wrapped: Vec<f64> = true_position.iter().map(|p| p.rem_euclid(std::f64::consts::TAU)).collect();
        let shifted = unwrapped(wrapped);
        let offset = shifted[0] - true_position[0];
        assert!(shifted.iter().zip(&true_position).all(|(a, b)| (a - b - offset).abs() < 1e-12));
        let counts: Vec<f64> = (0..50).map(f64::from).collect();
        assert_eq!(unwrapped(counts.clone()), counts, "more than a turn has not wrapped");
    }

    #[test]
    fn differences_follow_a_parabola_inside() {
        let time: Vec<f64> = (0..20).map(|n| 0.01 * f64::from(n)).collect();
        let speed = differences(&time, time.iter().map(|t| 3.0 * t * t).collect()).unwrap();
        assert!((1..19).all(|n| (speed[n] - 6.0 * time[n]).abs() < 1e-12));
        assert!((speed[0] - 0.03).abs() < 1e-12, "half a step away at the end");
    }
}
