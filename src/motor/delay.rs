//! Inputs that come late: what a delayed voltage is over each step, as the straight line with the same mean and the same
//! first moment.
//!
//! With a dead time that is no whole number of samples the voltage changes within a step. The line keeps the change's
//! size and its instant; against the exact solution a step then misses `Δv (h/τ)² / 200` of what it moves at most, τ the
//! fastest time constant.

use super::dual::Number;
use super::simulate::Drive;

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

/// A voltage in pieces, one a step, each a line; with when it acts.
pub(crate) struct Late<'a, T, F> {
    /// The voltage at the start and at the end of a piece.
    pub piece: F,
    /// Voltage before the first piece.
    pub before: T,
    /// When pieces begin \[s\]; that of the first is 0.
    pub time: &'a [f64],
    /// By how much later all of it acts \[s\].
    pub dead_time: T,
    /// By how much later still the piece of the first movement begins, the one before it lasting on; `None` where the
    /// model has no such latency.
    pub latency: Option<T>,
    pub first_movement: usize,
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

impl<T: Number, F: Fn(usize) -> [T; 2]> Late<'_, T, F> {
    /// When a piece begins to act, seen from time `from`; the piece after the last never does.
    #[inline(always)]
    fn begins(&self, piece: usize, from: f64) -> Option<T> {
        let own = self.dead_time + T::constant(*self.time.get(piece)? - from);
        let Some(latency) = self.latency.filter(|_| piece >= self.first_movement) else { return Some(own) };
        let earliest = self.dead_time + T::constant(self.time[self.first_movement] - from) + latency;
        Some(if own.value() < earliest.value() { earliest } else { own })
    }

    /// Start and end of the line for step `n` of length `h`; `cursor` is the piece that acts at its beginning, counted
    /// from 1 (0: what was before the first), and only ever grows with n.
    #[inline(always)]
    pub(crate) fn line(&self, n: usize, h: f64, cursor: &mut usize) -> [T; 2] {
        let from = self.time[n];
        while self.begins(*cursor, from).is_some_and(|begin| begin.value() <= 0.0) {
            *cursor += 1;
        }
        let zero = T::constant(0.0);
        let (mut sum, mut moment) = (zero, zero);
        let (mut begin, mut piece) = (zero, *cursor);
        loop {
            let end = self.begins(piece, from).filter(|end| end.value() < h);
            let [start, rate] = self.acts(piece, from);
            if end.is_none() && piece == *cursor {
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

    /// What acts: its value at time `from` and its rate.
    #[inline(always)]
    fn acts(&self, counted: usize, from: f64) -> [T; 2] {
        let zero = T::constant(0.0);
        let Some(piece) = counted.checked_sub(1) else { return [self.before, zero] };
        let [start, end] = (self.piece)(piece);
        let lasts_on = self.latency.is_some() && piece + 1 == self.first_movement;
        let (Some(next), false) = (self.time.get(piece + 1), lasts_on) else { return [start, zero] };
        if start.value().to_bits() == end.value().to_bits() {
            return [start, zero];
        }
        let rate = (end - start) * (1.0 / (next - self.time[piece]));
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
