//! Inputs that come late: what a delayed voltage is over each step, as the straight line with the same mean and the same
//! first moment.
//!
//! With a dead time that is no whole number of samples the voltage changes within a step. The line keeps the change's
//! size and its instant; against the exact solution a step then misses `Δv (h/τ)² / 200` of what it moves at most, τ the
//! fastest time constant.

use super::dual::Number;
use super::extended::{Extended, Setting};
use super::parameter::Parameter;
use super::simulate::Drive;
use super::terminal::Terminal;
use std::borrow::Cow;

/// How a recording begins.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Beginning {
    /// Voltage before the first sample \[V\].
    pub voltage: f64,
    /// The sample at which the voltage first moves by more than a twentieth of what it ever moves from there.
    pub first_movement: usize,
}

/// The part of its largest change that is a movement of the voltage.
const MOVEMENT: f64 = 0.05;

impl Beginning {
    /// Of a recording: zero volts before a motor at rest, else what the first sample has.
    #[must_use]
    pub fn of(voltage: &[f64], at_rest: bool) -> Self {
        let before = if at_rest { 0.0 } else { voltage.first().copied().unwrap_or(0.0) };
        let largest = voltage.iter().fold(0.0, |m: f64, v| m.max((v - before).abs()));
        let moved = voltage.iter().position(|v| (v - before).abs() > MOVEMENT * largest);
        Self { voltage: before, first_movement: moved.unwrap_or(voltage.len()) }
    }
}

/// A voltage in pieces, one a step, each a line between what the drive gives at its ends; with when it acts.
pub(crate) struct Late<'a, T> {
    pub drive: &'a Drive<'a>,
    /// What the drive makes of what it is told.
    pub terminal: Terminal<T>,
    /// Whether pieces are lines to the next sample; else they are held.
    lines: bool,
    /// The voltage told before the first piece.
    before: f64,
    /// When pieces begin \[s\]; that of the first is 0.
    time: Cow<'a, [f64]>,
    /// By how much later all of it acts \[s\].
    dead_time: T,
    /// By how much later still the piece of the first movement begins, the one before it lasting on; `None` where the
    /// model has no such latency.
    latency: Option<T>,
    first_movement: usize,
}

/// The voltage of a motor as it comes late, in pieces between samples; `time` is that of each.
#[inline(always)]
pub(crate) fn late<'a, T: Number>(
    motor: &Extended<T>,
    drive: &'a Drive<'a>,
    setting: Setting,
    time: impl Into<Cow<'a, [f64]>>,
) -> Late<'a, T> {
    Late {
        drive,
        terminal: Terminal::of(motor),
        lines: setting.method.uses_next_input(),
        before: setting.beginning.voltage,
        time: time.into(),
        dead_time: motor.get(Parameter::DeadTime),
        latency: setting.extent.has(Parameter::Latency).then(|| motor.get(Parameter::Latency)),
        first_movement: setting.beginning.first_movement,
    }
}

/// The times of the samples of a recording from the first on.
pub(crate) fn sample_times(drive: &Drive<'_>) -> Vec<f64> {
    let mut time = vec![0.0];
    let mut now = 0.0;
    for n in 1..drive.voltage.len() {
        now += drive.step(n - 1);
        time.push(now);
    }
    time
}

/// Changes nearer to the beginning of a step than this part of it are at its beginning.
const ROUNDING: f64 = 1e-9;

impl<T: Number> Late<'_, T> {
    /// When a piece begins to act, seen from time `from`; the piece after the last never does.
    #[inline(always)]
    fn begins<N: Number>(&self, late: (N, Option<N>), piece: usize, from: f64) -> Option<N> {
        let (dead_time, latency) = late;
        let own = dead_time + N::constant(*self.time.get(piece)? - from);
        let Some(latency) = latency.filter(|_| piece >= self.first_movement) else { return Some(own) };
        let earliest = dead_time + N::constant(self.time[self.first_movement] - from) + latency;
        Some(if own.value() < earliest.value() { earliest } else { own })
    }

    /// The same without derivatives.
    #[inline(always)]
    fn begins_at(&self, piece: usize, from: f64) -> Option<f64> {
        self.begins((self.dead_time.value(), self.latency.map(T::value)), piece, from)
    }

    /// Moves `cursor` on to the piece that acts at the beginning of step `n`, counted from 1 (0: what was before the
    /// first). It only ever grows with n.
    #[inline(always)]
    pub(crate) fn advance(&self, n: usize, cursor: &mut usize) {
        // A change right at the beginning belongs to this step: without it, nothing would tell that it could come later.
        let early = -ROUNDING * self.drive.step(n);
        while self.begins_at(*cursor, self.time[n]).is_some_and(|begin| begin < early) {
            *cursor += 1;
        }
    }

    /// The voltage that the drive is told all over step `n`, if it is one.
    #[inline(always)]
    pub(crate) fn held(&self, n: usize, cursor: usize) -> Option<f64> {
        let (from, latest) = (self.time[n], self.drive.step(n) * (1.0 - ROUNDING));
        let [voltage, _] = self.told(cursor);
        let mut piece = cursor;
        while self.told(piece).iter().all(|v| v.to_bits() == voltage.to_bits()) {
            match self.begins_at(piece, from) {
                Some(end) if end < latest => piece += 1,
                _ => return Some(voltage),
            }
        }
        None
    }

    /// The line for step `n`; `cursor` as in [`Self::advance`].
    #[inline(always)]
    pub(crate) fn line(&self, n: usize, cursor: &mut usize) -> [T; 2] {
        self.advance(n, cursor);
        match self.held(n, *cursor) {
            Some(voltage) => [self.terminal.gives(voltage); 2],
            None => self.line_from(n, *cursor),
        }
    }

    /// Start and end of the line for step `n`, in which the piece `cursor` acts first.
    pub(crate) fn line_from(&self, n: usize, cursor: usize) -> [T; 2] {
        let (from, h) = (self.time[n], self.drive.step(n));
        let zero = T::constant(0.0);
        let (mut sum, mut moment) = (zero, zero);
        let (mut begin, mut piece) = (zero, cursor);
        loop {
            let end = self.begins((self.dead_time, self.latency), piece, from);
            let end = end.filter(|end| end.value() < h * (1.0 - ROUNDING));
            let [start, rate] = self.acts(piece, from);
            if end.is_none() && piece == cursor {
                return [start, start + rate * h];
            }
            let stop = end.unwrap_or_else(|| T::constant(h));
            let (one, two) = (stop - begin, stop * stop - begin * begin);
            let three = stop * stop * stop - begin * begin * begin;
            sum = sum + start * one + rate * two * 0.5;
            moment = moment + start * two * 0.5 + rate * three * (1.0 / 3.0);
            let Some(end) = end else { break };
            (begin, piece) = (end, piece + 1);
        }
        let mean = sum * (1.0 / h);
        let half = (moment - sum * (0.5 * h)) * (6.0 / (h * h));
        [mean - half, mean + half]
    }

    /// What the drive is told at the beginning and at the end of a piece, counted as in [`Self::advance`].
    #[inline(always)]
    fn told(&self, counted: usize) -> [f64; 2] {
        let Some(piece) = counted.checked_sub(1) else { return [self.before; 2] };
        let lasts_on = self.latency.is_some() && piece + 1 == self.first_movement;
        let is_last = piece + 1 == self.time.len();
        let start = self.drive.voltage[piece];
        [start, if lasts_on || is_last { start } else { self.end(piece) }]
    }

    /// What it is told at the end of the piece that begins with sample `n`.
    #[inline(always)]
    pub(crate) fn end(&self, n: usize) -> f64 {
        if self.lines { self.drive.end(n) } else { self.drive.voltage[n] }
    }

    /// What acts: its value at time `from` and its rate.
    #[inline(always)]
    fn acts(&self, counted: usize, from: f64) -> [T; 2] {
        let told = self.told(counted);
        let [start, end] = told.map(|v| self.terminal.gives(v));
        let Some(piece) = counted.checked_sub(1).filter(|_| start.value().to_bits() != end.value().to_bits()) else {
            return [start, T::constant(0.0)];
        };
        let rate = (end - start) * (1.0 / (self.time[piece + 1] - self.time[piece]));
        let age = T::constant(from - self.time[piece]) - self.dead_time;
        [start + rate * age, rate]
    }
}

/// How a delayed voltage of even steps enters a step: the weights of the three samples from `whole` + 1 before it on, for
/// the start and for the end of its line. What [`Late::line`] gives for pieces that are held, or lines between samples.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DelayTaps {
    pub whole: usize,
    pub start: [f64; 3],
    pub end: [f64; 3],
}

impl DelayTaps {
    /// For a dead time in steps.
    pub(crate) fn new(steps: f64, lines: bool) -> Self {
        let (whole, part) = (steps.floor(), steps - steps.floor());
        let rest = 1.0 - part;
        // Means and first moments (in steps) of what each sample adds.
        let (mean, moment) = if lines {
            // Corners at the start, at the sample and at the end of the step.
            let mean = [part / 2.0, 0.5, rest / 2.0];
            let middle = part * part / 3.0 + part * rest / 2.0 + rest * rest / 6.0;
            let moment = [part * part / 6.0, middle, part * rest / 2.0 + rest * rest / 3.0];
            let share = |of: [f64; 3]| [part * of[0], rest * of[0] + of[1] + part * of[2], rest * of[2]];
            (share(mean), share(moment))
        } else {
            ([part, rest, 0.0], [part * part / 2.0, (1.0 - part * part) / 2.0, 0.0])
        };
        let half = |n: usize| 6.0 * (moment[n] - 0.5 * mean[n]);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a recording is far shorter")]
        let whole = whole.clamp(0.0, 1e9) as usize;
        Self {
            whole,
            start: std::array::from_fn(|n| mean[n] - half(n)),
            end: std::array::from_fn(|n| mean[n] + half(n)),
        }
    }
}
