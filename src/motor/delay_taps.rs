//! A delayed voltage on an even clock: three taps and a shift, as the kernel and the shaders take it.
//!
//! The taps are the weights of three samples in the line of [`DelayedVoltage`], which holds on any clock; they are a third
//! of its work. Steps that no taps give (where the start latency ends, and where lines begin) are computed by it beforehand.
//! Twin: `shaders/delay.wgsl`.

use super::delay::{DelayedVoltage, sample_times};
use super::discretize::step_maps;
use super::drive::DriveNonlinearity;
use super::extended::Extended;
use super::parameter::Parameter;
use super::settings::{InputHistory, SimulationSettings};
use super::simulate::Drive;
use std::sync::Arc;

/// The number of no step.
const NEVER: usize = usize::MAX;

/// How a delayed voltage enters the steps of one motor.
#[derive(Clone, Copy)]
pub(crate) struct DelayTaps {
    /// Whole samples of the dead time: step n takes the samples from n − `whole` − 1 on.
    pub whole: usize,
    /// The change of both states for one volt of each of the three samples.
    pub gains: [[f64; 3]; 2],
    /// The step in which the first movement begins after the start latency; `None` without one.
    pub movement: Option<usize>,
    /// Steps that no taps give and the change of both states in them: the two before the first movement, that itself, and
    /// those in which lines begin. A later entry replaces an earlier one.
    pub special: [(usize, [f64; 2]); 5],
}

/// Returns the times of the samples where [`DelayTaps::new`] needs them; they are the same for all motors.
pub(crate) fn tap_times(drive: &Drive<'_>, settings: SimulationSettings) -> Arc<[f64]> {
    let needed = settings.method.uses_next_input() || settings.features.has(Parameter::Latency);
    if needed { sample_times(drive) } else { Arc::default() }
}

impl DelayTaps {
    /// `time` holds those of [`tap_times`].
    pub(crate) fn new(motor: &Extended, drive: Drive<'_>, settings: SimulationSettings, time: Arc<[f64]>) -> Self {
        let (h, lines) = (drive.step_s[0], settings.method.uses_next_input());
        let maps = step_maps(&motor.motor.map(|p| [p]), h, settings.features.method(settings.method));
        let gain = |voltages: [f64; 2]| {
            let [first, last] = settings.ends(voltages);
            [0, 1].map(|axis| maps.taps[0][axis][0] * first + maps.taps[1][axis][0] * last)
        };
        let steps = motor.get(Parameter::DeadTime) / h;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a recording is far shorter")]
        let whole = steps.floor().clamp(0.0, 1e9) as usize;
        let taps = weights(steps - steps.floor(), lines).map(gain);
        let movement = settings.features.has(Parameter::Latency).then(|| {
            let steps = (motor.get(Parameter::DeadTime) + motor.get(Parameter::Latency)) / h;
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked")]
            let at = if (0.0..1e9).contains(&steps) { settings.history.first_movement + steps as usize } else { NEVER };
            at
        });
        let mut delay = Self { whole, gains: [0, 1].map(|axis| taps.map(|tap| tap[axis])), movement, special: NONE };
        let voltage = DelayedVoltage::new(motor, drive, settings, time);
        for (entry, back) in [2, 1].into_iter().enumerate() {
            if let Some(at) = movement.and_then(|at| at.checked_sub(back)).filter(|at| *at < drive.voltage.len()) {
                delay.special[entry] = (at, delay.before_movement(at, &voltage, settings.history));
            }
        }
        let begin = if lines { [whole.checked_sub(1), Some(whole)] } else { [None; 2] };
        // The piece that acts there is known but for one or two; from the first piece on it would be found too.
        let piece = settings.history.first_movement.saturating_sub(2);
        for (entry, (at, mut piece)) in (2..).zip([(movement, piece), (begin[0], 0), (begin[1], 0)]) {
            if let Some(at) = at.filter(|at| *at < drive.voltage.len()) {
                delay.special[entry] = (at, gain(voltage.line(at, &mut piece)));
            }
        }
        delay
    }

    /// Returns the change of both states in a step before the first movement, of whose three samples some are later.
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

    /// Writes the voltages at the motor that enter the steps from `start` on: three each, the first of step n at
    /// n − `start`.
    #[inline(always)]
    pub(crate) fn fill(&self, commanded: Commanded<'_>, drive: DriveNonlinearity<f64>, start: usize, row: &mut [f64]) {
        let Commanded { voltage, history } = commanded;
        let back = self.whole + 1;
        // Until the first movement acts, the voltage is that before it.
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

/// Commanded voltages and that before them; the last is held.
#[derive(Clone, Copy)]
pub(crate) struct Commanded<'a> {
    pub voltage: &'a [f64],
    pub history: InputHistory,
}

impl Commanded<'_> {
    /// Writes those from sample `from` − `back` on.
    #[inline(always)]
    fn copy(self, from: usize, back: usize, to: &mut [f64]) {
        let Self { voltage, history } = self;
        let early = back.saturating_sub(from).min(to.len());
        let (before, rest) = to.split_at_mut(early);
        before.fill(history.voltage);
        let known = voltage.get((from + early).saturating_sub(back)..).unwrap_or_default();
        let (within, after) = rest.split_at_mut(known.len().min(rest.len()));
        within.copy_from_slice(&known[..within.len()]);
        after.fill(voltage.last().copied().unwrap_or(history.voltage));
    }
}

/// Returns the weights of three samples for the start and the end of a step's line, `part` of a step late. They are those
/// of [`DelayedVoltage::line`] for constant pieces, or for lines between samples.
fn weights(part: f64, lines: bool) -> [[f64; 2]; 3] {
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
    [0, 1, 2].map(|n| [mean[n] - half(n), mean[n] + half(n)])
}
