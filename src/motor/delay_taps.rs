//! A delayed voltage on an even clock as three taps and a shift, the form that the kernel and the shaders use.
//!
//! The taps are the contributions of one volt at each of three samples to a step of [`DelayedVoltage`], which serves any
//! clock at three times the cost. Steps that the taps do not cover (at the end of the start latency and where linear pieces
//! begin) are computed by it beforehand. Shader: `shaders/delay.wgsl`.

use super::delay::{DelayedVoltage, StepVoltage, sample_times};
use super::drive::DriveNonlinearity;
use super::extended::Extended;
use super::parameter::Parameter;
use super::remainder::Remainder;
use super::settings::{InputHistory, SimulationSettings};
use super::simulate::SimulationInput;
use std::sync::Arc;

/// Index that no step has.
const NEVER: usize = usize::MAX;
/// Number of samples of a delay that exceeds any recording.
const LONGER: isize = 1_000_000_000;

/// The taps by which a delayed voltage enters the steps of a motor.
#[derive(Clone, Copy)]
pub(crate) struct DelayTaps {
    /// Dead time in samples, rounded down: step n uses the samples from n − `whole` − 1 on.
    pub whole: isize,
    /// Change of both states per volt of each of the three samples.
    pub gains: [[f64; 3]; 2],
    /// Index of the step in which the first movement begins after the start latency; `None` without a start latency.
    pub movement: Option<usize>,
    /// Steps that the taps do not cover, with the change of both states in them: the two before the first movement, the
    /// step of the movement, and those in which linear pieces begin. A later entry replaces an earlier one.
    pub special: [(usize, [f64; 2]); 5],
}

/// Returns the times of the samples \[s\] if [`DelayTaps::new`] needs them, else an empty list; they are the same for all
/// motors.
pub(crate) fn tap_times(drive: &SimulationInput<'_>, settings: SimulationSettings) -> Arc<[f64]> {
    let needed = settings.method.uses_next_input() || settings.features.has(Parameter::Latency);
    if needed { sample_times(drive) } else { Arc::default() }
}

impl DelayTaps {
    /// Computes the taps of a motor; `time` is the result of [`tap_times`].
    pub(crate) fn new(
        motor: &Extended,
        drive: SimulationInput<'_>,
        settings: SimulationSettings,
        time: Arc<[f64]>,
    ) -> Self {
        let (h, lines) = (drive.step_s[0], settings.method.uses_next_input());
        let responses = Remainder::new(motor, settings.method);
        let whole_step = responses.over(h);
        let steps = motor.get(Parameter::DeadTime) / h;
        let whole = whole_steps(steps).unwrap_or(LONGER);
        let fraction_left = 1.0 - (steps - steps.floor());
        let gains = [0, 1].map(|axis| {
            taps([whole_step, responses.over(fraction_left * h)].map(|of| of.map(|r| r[axis])), fraction_left, h)
        });
        let movement = settings.features.has(Parameter::Latency).then(|| {
            let steps = (motor.get(Parameter::DeadTime) + motor.get(Parameter::Latency)) / h;
            whole_steps(steps).map_or(NEVER, |steps| settings.history.first_movement.saturating_add_signed(steps))
        });
        let mut voltage = DelayedVoltage::new(motor, drive, settings, time);
        let mut delay = Self { whole, gains, movement, special: NONE };
        for (entry, back) in [2, 1].into_iter().enumerate() {
            if let Some(at) = movement.and_then(|at| at.checked_sub(back)).filter(|at| *at < drive.voltage.len()) {
                delay.special[entry] = (at, delay.before_movement(at, &voltage, settings.history));
            }
        }
        let begin = if lines { [whole - 1, whole].map(|at| usize::try_from(at).ok()) } else { [None; 2] };
        // A lower bound of the piece that acts in the step saves the search from the first piece.
        let piece = settings.history.first_movement.saturating_sub(2);
        for (entry, (at, mut piece)) in (2..).zip([(movement, piece), (begin[0], 0), (begin[1], 0)]) {
            if let Some(at) = at.filter(|at| *at < drive.voltage.len()) {
                let StepVoltage { ends: [start, end], added } = voltage.step_voltage(at, &mut piece);
                let [held, ramp] = whole_step;
                let added = added.unwrap_or_default();
                let change = [0, 1].map(|axis| start * held[axis] + (end - start) / h * ramp[axis] + added[axis]);
                delay.special[entry] = (at, change);
            }
        }
        delay
    }

    /// Returns the change of both states in a step before the first movement, some of whose three samples come after it.
    fn before_movement(&self, at: usize, voltage: &DelayedVoltage<'_, f64>, history: InputHistory) -> [f64; 2] {
        let mut three = [0.0; 3];
        Commanded { voltage: &voltage.drive.voltage[..history.first_movement], history }.copy(
            at,
            self.whole + 1,
            &mut three,
        );
        let given = three.map(|volts| voltage.nonlinearity.output(volts));
        self.gains.map(|taps| taps[0] * given[0] + (taps[1] * given[1] + taps[2] * given[2]))
    }

    /// Writes the voltages at the motor \[V\] that enter the steps from `start` on; the three samples of step n begin at
    /// index n − `start`.
    #[inline(always)]
    pub(crate) fn fill(&self, commanded: Commanded<'_>, drive: DriveNonlinearity<f64>, start: usize, row: &mut [f64]) {
        let Commanded { voltage, history } = commanded;
        let back = self.whole + 1;
        // Until the first movement acts, the voltage is the one before it.
        let moves = self.movement.unwrap_or(0).saturating_sub(start).min(row.len());
        let (still, moving) = row.split_at_mut(moves);
        Commanded { voltage: &voltage[..history.first_movement], history }.copy(start, back, still);
        commanded.copy(start + moves, back, moving);
        for voltage in row {
            *voltage = drive.output(*voltage);
        }
    }
}

const NONE: [(usize, [f64; 2]); 5] = [(NEVER, [0.0; 2]); 5];

/// Commanded voltages and the voltage before them; the last voltage is kept afterwards.
#[derive(Clone, Copy)]
pub(crate) struct Commanded<'a> {
    pub voltage: &'a [f64],
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

/// Returns the gains of three samples in one state, from its responses `[step, ramp]` over a step and over the fraction
/// `fraction_left` of it that remains when the next sample arrives. They equal those of [`DelayedVoltage::step_voltage`] for
/// constant or linear pieces.
fn taps([[held, ramp], [held_rest, ramp_rest]]: [[f64; 2]; 2], fraction_left: f64, h: f64) -> [f64; 3] {
    // A zero-order hold has no ramp.
    if ramp == 0.0 {
        return [held - held_rest, held_rest, 0.0];
    }
    // At the start of the step the voltage has gone the fraction `fraction_left` of the way from the first sample to the
    // second.
    let [bend, bend_rest] = [ramp / h, ramp_rest / h];
    [(1.0 - fraction_left) * held - bend + bend_rest, fraction_left * held + bend - 2.0 * bend_rest, bend_rest]
}

/// Returns a delay in steps, rounded down; `None` if it is longer than any recording.
fn whole_steps(steps: f64) -> Option<isize> {
    #[expect(clippy::cast_possible_truncation, reason = "checked")]
    let whole = (steps.abs() < 1e9).then_some(steps.floor() as isize);
    whole
}
