//! Dead time and start latency: the delayed voltage over each step, on any clock.
//!
//! With a dead time that is not a multiple of the step length the voltage changes within a step. The response over such a
//! step is that to the voltage at its start, plus the response to each later change until the end of the step
//! ([`super::remainder`]); this is exact for a zero-order and a first-order hold. A negative dead time models a voltage
//! that was recorded late.

use super::drive::DriveNonlinearity;
use super::dual::Number;
use super::extended::Extended;
use super::friction::Bend;
use super::parameter::Parameter;
use super::remainder::Remainder;
use super::settings::SimulationSettings;
use super::simulate::SimulationInput;
use std::sync::Arc;

/// A delayed voltage as a piecewise function with one piece for each sample: constant for a zero-order hold, linear between
/// the outputs of the drive at its ends for a first-order hold.
pub struct DelayedVoltage<'a, T> {
    /// Inputs and clock of the simulation.
    pub drive: SimulationInput<'a>,
    /// Static nonlinearity from the commanded voltage to the output of the drive.
    pub nonlinearity: DriveNonlinearity<T>,
    /// True for a first-order hold, false for a zero-order hold.
    first_order_hold: bool,
    /// Voltage commanded before the first piece \[V\].
    before: f64,
    /// Time at which each piece begins without delay \[s\]; zero for the first.
    time: Arc<[f64]>,
    /// Delay of all pieces \[s\].
    dead_time: T,
    /// Additional delay \[s\] of the first movement, during which the voltage of the piece before it is kept; `None` for a
    /// model without start latency.
    latency: Option<T>,
    first_movement: usize,
    remainder: Remainder<T>,
}

/// The voltage over a step.
pub(crate) struct StepVoltage<T> {
    /// Voltage at the start of the step, and at its end if the first piece continued to it \[V\].
    pub ends: [T; 2],
    /// Change of both states due to the pieces that begin within the step, and the fraction of the step at which the first does;
    /// `None` if there are none.
    pub bend: Option<Bend<T>>,
}

/// The changes of the voltage within a step that were not taken yet.
pub struct Changes<T> {
    /// As in [`StepVoltage`].
    pub ends: [T; 2],
    first: usize,
    piece: usize,
    /// Start of the step and its length \[s\].
    from: f64,
    h: f64,
    /// Voltage of the last piece at the start of the step \[V\] and its rate \[V/s\].
    before: [T; 2],
}

/// A change of the voltage within a step.
pub struct Change<T> {
    /// Change of the value \[V\].
    pub jump: T,
    /// Change of the slope \[V/s\].
    pub bend: T,
    /// Time until the end of the step \[s\].
    pub left: T,
}

/// Returns the times of the samples of a recording relative to the first \[s\].
pub fn sample_times(drive: &SimulationInput<'_>) -> Arc<[f64]> {
    let mut time = vec![0.0];
    let mut now = 0.0;
    for n in 1..drive.voltage.len() {
        now += drive.step(n - 1);
        time.push(now);
    }
    time.into()
}

/// Fraction of a step within which a change is taken to be at its start or end.
const ROUNDING: f64 = 1e-9;

impl<'a, T: Number> DelayedVoltage<'a, T> {
    /// Makes a delayed voltage; `time` holds the times of the samples \[s\].
    #[inline(always)]
    pub fn new(
        motor: &Extended<T>,
        drive: SimulationInput<'a>,
        settings: SimulationSettings,
        time: Arc<[f64]>,
    ) -> Self {
        let SimulationSettings { features, method, history } = settings;
        Self {
            drive,
            nonlinearity: DriveNonlinearity::of(motor),
            first_order_hold: method.uses_next_input(),
            before: history.voltage,
            time,
            dead_time: motor.get(Parameter::DeadTime),
            latency: features.has(Parameter::Latency).then(|| motor.get(Parameter::Latency)),
            first_movement: history.first_movement,
            remainder: Remainder::new(motor, method),
        }
    }

    /// Returns the time at which a piece begins to act, relative to `from` \[s\]; `None` after the last piece.
    #[inline(always)]
    fn begins<N: Number>(&self, delay: (N, Option<N>), piece: usize, from: f64) -> Option<N> {
        let (dead_time, latency) = delay;
        let own = dead_time + N::constant(*self.time.get(piece)? - from);
        let Some(latency) = latency.filter(|_| piece >= self.first_movement) else { return Some(own) };
        let earliest = dead_time + N::constant(self.time[self.first_movement] - from) + latency;
        Some(if own.value() < earliest.value() { earliest } else { own })
    }

    /// Returns the time at which a piece begins to act, relative to `from` \[s\], without derivatives.
    #[inline(always)]
    fn begins_at(&self, piece: usize, from: f64) -> Option<f64> {
        self.begins((self.dead_time.value(), self.latency.map(T::value)), piece, from)
    }

    /// Advances `cursor` to the piece that acts at the start of step `n`. Cursors count pieces from 1; 0 is the voltage
    /// before the first. The cursor only grows with `n`.
    #[inline(always)]
    pub fn advance(&self, n: usize, cursor: &mut usize) {
        // A change at the start belongs to this step: otherwise the derivative with respect to the delay is zero here.
        let early = -ROUNDING * self.drive.step(n);
        while self.begins_at(*cursor, self.time[n]).is_some_and(|begin| begin < early) {
            *cursor += 1;
        }
    }

    /// Returns the commanded voltage of step `n` \[V\] if it is constant over the step.
    #[inline(always)]
    pub fn constant(&self, n: usize, cursor: usize) -> Option<f64> {
        let (from, latest) = (self.time[n], self.drive.step(n) * (1.0 - ROUNDING));
        let [voltage, _] = self.commanded(cursor);
        let mut piece = cursor;
        while self.commanded(piece).iter().all(|v| v.to_bits() == voltage.to_bits()) {
            match self.begins_at(piece, from) {
                Some(end) if end < latest => piece += 1,
                _ => return Some(voltage),
            }
        }
        None
    }

    /// Returns the end of the steps `n..end` over which the voltage is constant under a zero-order hold without slopes, `n` if
    /// it changes in the step `n`, and advances `cursor` to the last piece of this voltage. The first of `run_ends` that are left
    /// is the end of the run of equal voltages that the piece is in.
    #[inline(always)]
    pub fn constant_until(&self, [n, end]: [usize; 2], cursor: &mut usize, run_ends: &mut &[usize]) -> usize {
        self.advance(n, cursor);
        if *cursor > 0 || self.drive.voltage[0].to_bits() == self.before.to_bits() {
            while let [first, rest @ ..] = run_ends
                && *first < (*cursor).max(1)
            {
                *run_ends = rest;
            }
            *cursor = run_ends.first().copied().unwrap_or(*cursor);
        }
        let next = *cursor;
        let Some(begin) = self.begins_at(next, 0.0) else { return end };
        let is_later = |n: usize| begin - self.time[n] >= self.drive.step(n) * (1.0 - ROUNDING);
        let mut until = n;
        while until < end && is_later(until) {
            until += 1;
        }
        until
    }

    /// Returns the voltage at the motor \[V\] from the piece before `cursor` on.
    #[inline(always)]
    pub fn output(&self, cursor: usize) -> T {
        self.nonlinearity.output(self.commanded(cursor)[0])
    }

    /// Returns the voltage of step `n`; `cursor` as in [`Self::advance`].
    #[inline(always)]
    pub(crate) fn step_voltage(&mut self, n: usize, cursor: &mut usize) -> StepVoltage<T> {
        self.advance(n, cursor);
        match self.constant(n, *cursor) {
            Some(voltage) => StepVoltage { ends: [self.nonlinearity.output(voltage); 2], bend: None },
            None => self.step_voltage_from(n, *cursor),
        }
    }

    /// Returns the voltage of step `n`, at whose start the piece `cursor` acts.
    pub(crate) fn step_voltage_from(&mut self, n: usize, cursor: usize) -> StepVoltage<T> {
        let (mut changes, mut bend) = (self.changes(n, cursor), None);
        while let Some(Change { jump, bend: slope, left }) = self.next_change(&mut changes) {
            let more = self.remainder.change([jump, slope], left);
            let Bend { at, added } =
                bend.unwrap_or_else(|| Bend { at: self.bend_at(n, left), added: [T::constant(0.0); 2] });
            bend = Some(Bend { at, added: [added[0] + more[0], added[1] + more[1]] });
        }
        if self.has_movement(&changes) {
            bend = bend.map(|Bend { added, .. }| Bend { at: T::constant(0.0), added });
        }
        StepVoltage { ends: changes.ends, bend }
    }

    /// Returns the fraction of the step `n` at which a change acts that is `left` \[s\] before its end. Lines, which do not jump, act
    /// from the start.
    #[inline(always)]
    pub fn bend_at(&self, n: usize, left: T) -> T {
        if self.first_order_hold {
            return T::constant(0.0);
        }
        T::constant(1.0) - left * (1.0 / self.drive.step(n))
    }

    /// Returns true if a start latency ends with one of the changes that were taken.
    #[inline(always)]
    pub fn has_movement(&self, changes: &Changes<T>) -> bool {
        self.latency.is_some() && (changes.first..changes.piece).contains(&self.first_movement)
    }

    /// Returns the changes within the step `n`, at whose start the piece `cursor` acts.
    #[inline(always)]
    pub fn changes(&self, n: usize, cursor: usize) -> Changes<T> {
        let (from, h) = (self.time[n], self.drive.step(n));
        let [start, rate] = self.acts(cursor, from);
        Changes { ends: [start, start + rate * h], first: cursor, piece: cursor, from, h, before: [start, rate] }
    }

    /// Returns the next change within a step.
    #[inline(always)]
    pub fn next_change(&self, changes: &mut Changes<T>) -> Option<Change<T>> {
        let Changes { piece, from, h, before, .. } = changes;
        let begin = self.begins((self.dead_time, self.latency), *piece, *from)?;
        if begin.value() >= *h * (1.0 - ROUNDING) {
            return None;
        }
        *piece += 1;
        let after = self.acts(*piece, *from);
        let [jump, bend] = [0, 1].map(|n| after[n] - before[n]);
        *before = after;
        Some(Change { jump: jump + bend * begin, bend, left: T::constant(*h) - begin })
    }

    /// Returns the voltage commanded at both ends of a piece \[V\]; `counted` as in [`Self::advance`].
    #[inline(always)]
    fn commanded(&self, counted: usize) -> [f64; 2] {
        let Some(piece) = counted.checked_sub(1) else { return [self.before; 2] };
        let precedes_latency = self.latency.is_some() && piece + 1 == self.first_movement;
        let is_last = piece + 1 == self.time.len();
        let start = self.drive.voltage[piece];
        [start, if precedes_latency || is_last { start } else { self.end(piece) }]
    }

    /// Returns the voltage commanded at the end of the piece that begins with sample `n` \[V\].
    #[inline(always)]
    pub(crate) fn end(&self, n: usize) -> f64 {
        if self.first_order_hold { self.drive.end(n) } else { self.drive.voltage[n] }
    }

    /// Returns the voltage of a piece at the motor: its value at the time `from` \[V\] and its rate \[V/s\].
    #[inline(always)]
    fn acts(&self, counted: usize, from: f64) -> [T; 2] {
        let commanded = self.commanded(counted);
        let [start, end] = commanded.map(|v| self.nonlinearity.output(v));
        let Some(piece) = counted.checked_sub(1).filter(|_| start.value().to_bits() != end.value().to_bits()) else {
            return [start, T::constant(0.0)];
        };
        let rate = (end - start) * (1.0 / (self.time[piece + 1] - self.time[piece]));
        let age = T::constant(from - self.time[piece]) - self.dead_time;
        [start + rate * age, rate]
    }
}
