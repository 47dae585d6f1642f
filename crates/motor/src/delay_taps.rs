//! A delayed voltage on an even clock as three taps and a shift, the form that the kernel and the shaders use.
//!
//! The taps are the contributions of one volt at each of three samples to a step of [`DelayedVoltage`], which serves any
//! clock at three times the cost. Steps that the taps do not cover (at the end of the start latency and where linear pieces
//! begin) are computed by it beforehand. Shader: `shaders/delay.wgsl`.

use super::delay::{DelayedVoltage, StepVoltage};
use super::drive::DriveNonlinearity;
use super::extended::Extended;
use super::parameter::Parameter;
use super::settings::{InputHistory, SimulationSettings};
use super::simulate::SimulationInput;
use super::transition_integral::{Dynamics, TransitionIntegrals};
use std::sync::Arc;

/// Index that no step has.
const NEVER: usize = usize::MAX;
/// Number of samples of a delay that exceeds any recording.
const LONGER: isize = 1_000_000_000;

/// The taps by which a delayed voltage enters the steps of a motor.
#[derive(Clone, Copy)]
pub struct DelayTaps {
    /// Dead time in samples, rounded down: step n uses the samples from n − `whole` − 1 on.
    pub whole: isize,
    /// Change of both states per volt of each of the three samples.
    pub gains: [[f64; 3]; 2],
    /// Index of the step in which the first movement begins after the start latency; `None` without a start latency.
    pub movement: Option<usize>,
    /// Fraction of a step at which the voltage changes; 0 under a first-order hold, whose lines do not jump.
    pub bend_at: f64,
    /// Steps that the taps do not cover: the two before the first movement, the step of the movement, and those in which linear
    /// pieces begin. A later entry replaces an earlier one.
    pub special: [SpecialStep; 5],
}

/// A step that the taps do not cover.
#[derive(Clone, Copy)]
pub struct SpecialStep {
    /// Index of the step.
    pub at: usize,
    /// Change of both states.
    pub change: [f64; 2],
    /// Part of it that is due to the change of the voltage at the fraction `bend_at` of the step.
    pub added: [f64; 2],
}

/// Returns true if [`DelayTaps::new`] needs the times of the samples.
pub fn needs_times(settings: SimulationSettings) -> bool {
    settings.method.uses_next_input()
}

/// The gains of the three samples for `L` motors side by side, and their responses to the voltage over a step.
pub struct TapGains<const L: usize> {
    /// Change of both states per volt of each of the three samples.
    pub gains: [[[f64; L]; 2]; 3],
    /// Response to a unit step and to a unit ramp over a step.
    step: [[f64; L]; 2],
    ramp: [[f64; L]; 2],
    /// Response to a unit step over the rest of the step in which the first movement begins.
    movement: [[f64; L]; 2],
}

impl<const L: usize> TapGains<L> {
    /// Computes the gains for the steps of a recording on an even clock.
    #[inline(always)]
    pub fn new(motors: &Extended<[f64; L]>, h: f64, settings: SimulationSettings) -> Self {
        // Closures would not be compiled for the SIMD level.
        let (zero, method) = ([[0.0; L]; 2], settings.method);
        let (dynamics, delay) = (Dynamics::new(&motors.motor, method.input), motors.get(Parameter::DeadTime));
        let (mut left, mut rest, mut moving) = ([0.0; L], [0.0; L], [0.0; L]);
        for n in 0..L {
            left[n] = left_of_step(delay[n] / h);
            rest[n] = left[n] * h;
        }
        let mut new = Self { gains: [zero; 3], step: zero, ramp: zero, movement: zero };
        if method.uses_next_input() {
            let [step, ramp] = TransitionIntegrals::<L, 2>::new(&dynamics, [h; L], method).responses(&dynamics);
            let [_, ramp_rest] = TransitionIntegrals::<L, 2>::new(&dynamics, rest, method).responses(&dynamics);
            for axis in 0..2 {
                for n in 0..L {
                    // At the start of the step the voltage has gone the fraction `left` of the way from the first sample to the
                    // second.
                    let [bend, bend_rest] = [ramp[axis][n] / h, ramp_rest[axis][n] / h];
                    new.gains[0][axis][n] = (1.0 - left[n]) * step[axis][n] - bend + bend_rest;
                    new.gains[1][axis][n] = left[n] * step[axis][n] + bend - 2.0 * bend_rest;
                    new.gains[2][axis][n] = bend_rest;
                }
            }
            return Self { step, ramp, ..new };
        }
        let [step] = TransitionIntegrals::<L, 1>::new(&dynamics, [h; L], method).responses(&dynamics);
        let [step_rest] = TransitionIntegrals::<L, 1>::new(&dynamics, rest, method).responses(&dynamics);
        for axis in 0..2 {
            for n in 0..L {
                new.gains[0][axis][n] = step[axis][n] - step_rest[axis][n];
                new.gains[1][axis][n] = step_rest[axis][n];
            }
        }
        if settings.features.has(Parameter::Latency) {
            let latency = motors.get(Parameter::Latency);
            for n in 0..L {
                moving[n] = left_of_step((delay[n] + latency[n].max(0.0)) / h) * h;
            }
            [new.movement] = TransitionIntegrals::<L, 1>::new(&dynamics, moving, method).responses(&dynamics);
        }
        Self { step, ..new }
    }
}

/// Returns the fraction of a step that remains when a change arrives that is delayed by a number of steps.
#[inline(always)]
fn left_of_step(steps: f64) -> f64 {
    1.0 - (steps - steps.floor())
}

impl DelayTaps {
    /// Makes the taps of a motor with the gains of a lane; `time` holds the times of the samples \[s\] if [`needs_times`] is true.
    pub fn new<const L: usize>(
        motor: &Extended,
        of: (&TapGains<L>, usize),
        drive: SimulationInput<'_>,
        settings: SimulationSettings,
        time: Arc<[f64]>,
    ) -> Self {
        let (TapGains { gains, .. }, lane) = of;
        let (h, dead_time) = (drive.step_s[0], motor.get(Parameter::DeadTime));
        let whole = whole_steps(dead_time / h).unwrap_or(LONGER);
        let gains = [0, 1].map(|axis| [gains[0][axis][lane], gains[1][axis][lane], gains[2][axis][lane]]);
        let latency = settings.features.has(Parameter::Latency).then(|| motor.get(Parameter::Latency).max(0.0));
        let first_movement = settings.history.first_movement;
        let steps = latency.map(|latency| whole_steps((dead_time + latency) / h));
        let movement = steps.map(|steps| steps.map_or(NEVER, |steps| first_movement.saturating_add_signed(steps)));
        // With a negative dead time the movement may begin before the recording.
        let is_earlier = steps.flatten().is_some_and(|steps| first_movement.checked_add_signed(steps).is_none());
        let uses_next = settings.method.uses_next_input();
        let bend_at = if uses_next { 0.0 } else { 1.0 - left_of_step(dead_time / h) };
        let mut delay = Self { whole, gains, movement, bend_at, special: NONE };
        let nonlinearity = DriveNonlinearity::of(motor);
        let commanded = Commanded { voltage: drive.voltage, history: settings.history };
        for (entry, back) in [2, 1].into_iter().enumerate() {
            if let Some(at) = movement.and_then(|at| at.checked_sub(back)).filter(|at| *at < drive.voltage.len()) {
                delay.special[entry] = delay.before_movement(at, commanded, nonlinearity);
            }
        }
        if uses_next {
            let voltage = DelayedVoltage::new(motor, drive, settings, time);
            delay.set_special(voltage, of, settings.history.first_movement);
        } else if let Some(at) = movement.filter(|at| *at < drive.voltage.len() && !is_earlier) {
            let left = |delay_s: f64| left_of_step(delay_s / h);
            let begins_later = left(dead_time) < left(dead_time + latency.unwrap_or(0.0));
            let change = delay.at_movement((at, begins_later), of, commanded, nonlinearity);
            delay.special[2] = SpecialStep { at, change, added: [0.0; 2] };
        }
        delay
    }

    /// Sets the steps of the first movement and of the beginning of linear pieces under a first-order hold.
    fn set_special<const L: usize>(
        &mut self,
        mut voltage: DelayedVoltage<'_, f64>,
        (TapGains { step, ramp, .. }, lane): (&TapGains<L>, usize),
        first_movement: usize,
    ) {
        let drive = voltage.drive;
        let begin = [self.whole - 1, self.whole].map(|at| usize::try_from(at).ok());
        // A lower bound of the piece that acts in the step saves the search from the first piece.
        let piece = first_movement.saturating_sub(2);
        for (entry, (at, mut piece)) in (2..).zip([(self.movement, piece), (begin[0], 0), (begin[1], 0)]) {
            if let Some(at) = at.filter(|at| *at < drive.voltage.len()) {
                let StepVoltage { ends: [start, end], bend } = voltage.step_voltage(at, &mut piece);
                let added = bend.map_or([0.0; 2], |bend| bend.added);
                let rate = (end - start) / drive.step_s[0];
                let change = [0, 1].map(|axis| start * step[axis][lane] + rate * ramp[axis][lane] + added[axis]);
                self.special[entry] = SpecialStep { at, change, added: [0.0; 2] };
            }
        }
    }

    /// Returns the change of both states in the step of the first movement under a zero-order hold: the voltage before it, then
    /// that of the piece which is due by then, then that of the piece which begins in this step, if it is a later one.
    fn at_movement<const L: usize>(
        &self,
        (at, begins_later): (usize, bool),
        (TapGains { gains, step, movement, .. }, lane): (&TapGains<L>, usize),
        Commanded { voltage, history }: Commanded<'_>,
        drive: DriveNonlinearity<f64>,
    ) -> [f64; 2] {
        let still = history.first_movement.checked_sub(1).map_or(history.voltage, |n| voltage[n]);
        let begins = at.saturating_add_signed(-self.whole);
        let of = |piece: usize| drive.output(voltage[piece.min(voltage.len() - 1)]);
        let (still, due, next) = (drive.output(still), of(begins.saturating_sub(1)), of(begins));
        [0, 1].map(|axis| {
            let [over_step, moving, rest] = [step, movement, &gains[1]].map(|of| of[axis][lane]);
            let later = if begins_later { [due - still, next - due] } else { [next - still, 0.0] };
            over_step * still + moving * later[0] + rest * later[1]
        })
    }

    /// Returns a step before the first movement, some of whose three samples come after it.
    fn before_movement(
        &self,
        at: usize,
        Commanded { voltage, history }: Commanded<'_>,
        drive: DriveNonlinearity<f64>,
    ) -> SpecialStep {
        let (mut three, before) = ([0.0; 3], &voltage[..history.first_movement]);
        Commanded { voltage: before, history }.copy(at, self.whole + 1, &mut three);
        let given = three.map(|volts| drive.output(volts));
        let change = self.gains.map(|taps| taps[0] * given[0] + (taps[1] * given[1] + taps[2] * given[2]));
        SpecialStep { at, change, added: self.gains.map(|taps| taps[1] * (given[1] - given[0])) }
    }

    /// Returns the end of the steps from `start` on whose commanded voltages are all equal; at most `start` if those of the step
    /// `start` differ. `ends` holds the ends of the runs of equal voltages.
    #[inline(always)]
    pub fn constant_until(&self, Commanded { voltage, history }: Commanded<'_>, ends: &[usize], start: usize) -> usize {
        let moves = self.movement.filter(|at| start < *at);
        let first = start.cast_signed().saturating_sub(self.whole + 1);
        let known = if moves.is_some() { history.first_movement } else { voltage.len() };
        // The last known voltage is kept.
        let run_end = |n: usize| ends.get(ends.partition_point(|end| *end <= n)).copied().filter(|end| *end < known);
        let end = match usize::try_from(first) {
            Ok(first) => run_end(first),
            Err(_) if known > 0 && voltage[0].to_bits() == history.voltage.to_bits() => run_end(0),
            Err(_) => (known > 0).then_some(0),
        };
        let until = end.map_or(usize::MAX, |end| {
            // Step n uses the samples up to n − `whole` + 1.
            usize::try_from(end.cast_signed().saturating_add(self.whole).saturating_sub(1)).unwrap_or(0)
        });
        until.min(moves.unwrap_or(usize::MAX))
    }

    /// Returns the index of the first commanded voltage that enters the step `start` if it and the others up to `count` are
    /// consecutive samples of the recording.
    #[inline(always)]
    pub fn source(&self, Commanded { voltage, history }: Commanded<'_>, start: usize, count: usize) -> Option<usize> {
        let moves = self.movement.unwrap_or(0).saturating_sub(start);
        let known = if moves == 0 { voltage.len() } else { history.first_movement };
        let first = usize::try_from(start.cast_signed() - self.whole - 1).ok()?;
        (first + count <= known && (moves == 0 || moves >= count)).then_some(first)
    }

    /// Writes the commanded voltages \[V\] that enter the steps from `start` on; the three samples of step n begin at index
    /// n − `start`.
    #[inline(always)]
    pub fn fill(&self, commanded: Commanded<'_>, start: usize, row: &mut [f64]) {
        let Commanded { voltage, history } = commanded;
        let back = self.whole + 1;
        // Until the first movement acts, the voltage is the one before it.
        let moves = self.movement.unwrap_or(0).saturating_sub(start).min(row.len());
        let (still, moving) = row.split_at_mut(moves);
        Commanded { voltage: &voltage[..history.first_movement], history }.copy(start, back, still);
        commanded.copy(start + moves, back, moving);
    }
}

const NONE: [SpecialStep; 5] = [SpecialStep { at: NEVER, change: [0.0; 2], added: [0.0; 2] }; 5];

/// Commanded voltages and the voltage before them; the last voltage is kept afterwards.
#[derive(Clone, Copy)]
pub struct Commanded<'a> {
    /// Commanded voltage of each sample \[V\].
    pub voltage: &'a [f64],
    /// The voltage before the first sample.
    pub history: InputHistory,
}

impl Commanded<'_> {
    /// Writes the voltages from sample `from` − `back` on.
    #[inline(always)]
    fn copy(self, from: usize, back: isize, to: &mut [f64]) {
        let Self { voltage, history } = self;
        let at = |n: usize| n.cast_signed().saturating_sub(back);
        let early = usize::try_from(-at(from)).unwrap_or(0).min(to.len());
        let (before, remaining) = to.split_at_mut(early);
        before.fill(history.voltage);
        let known = usize::try_from(at(from + early)).ok().and_then(|n| voltage.get(n..)).unwrap_or_default();
        let (within, after) = remaining.split_at_mut(known.len().min(remaining.len()));
        within.copy_from_slice(&known[..within.len()]);
        after.fill(voltage.last().copied().unwrap_or(history.voltage));
    }
}

/// Returns a delay in steps, rounded down; `None` if it is longer than any recording.
fn whole_steps(steps: f64) -> Option<isize> {
    #[expect(clippy::cast_possible_truncation, reason = "checked")]
    let whole = (steps.abs() < 1e9).then_some(steps.floor() as isize);
    whole
}
