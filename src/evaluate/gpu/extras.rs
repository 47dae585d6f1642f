//! Motors with extensions on the device: which parts of the shader they need, the constants of a candidate behind its
//! step maps, and what goes to the CPU instead.

use super::shader::LANES;
use crate::evaluate::late::Taps;
use crate::evaluate::{Problem, Signals};
use crate::motor::{Extended, Extent, Parameter, WINDOW_MAX};

/// Parts of a shader for motors with extensions, beyond friction and the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Extras {
    /// Whether brushes take their drop.
    pub brushes: bool,
    /// Whether the voltage acts late.
    pub delayed: bool,
    /// Which sensors average.
    pub averages: [bool; 2],
}

/// Entries of a step map, and of each slot of constants behind the maps of a block.
pub(super) const FIELDS: usize = 12;
/// Entries of the state of a block between rounds: state and running sums.
pub(super) const STATES: usize = 4;
/// Words of a job.
pub(super) const JOB: usize = 15;
/// The sensors' windows, in samples.
const WINDOWS: [Parameter; 2] = [Parameter::CurrentAverage, Parameter::SpeedAverage];
/// Samples up to which f32 counts.
const SAMPLES_MAX: usize = 1 << 24;
/// A voltage that no drive reaches, for those that reach any.
const VOLTS_MAX: f64 = 1e30;

impl Extras {
    /// Those of a model; `None` for the linear motor.
    pub(super) fn of(extent: Extent) -> Option<Self> {
        (!extent.is_linear()).then(|| Self {
            brushes: extent.has(Parameter::BrushDrop),
            delayed: extent.is_delayed(),
            averages: WINDOWS.map(|window| extent.has(window)),
        })
    }

    /// All there are.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..16_u8).map(|bits| Self {
            brushes: bits & 1 != 0,
            delayed: bits & 2 != 0,
            averages: [bits & 4 != 0, bits & 8 != 0],
        })
    }

    /// What a block has behind its step maps.
    pub(super) fn slots(self) -> &'static [Slot] {
        match (self.averages != [false; 2], self.delayed) {
            (false, false) => &[Slot::Drive],
            (true, false) => &[Slot::Drive, Slot::Averages],
            (false, true) => &[Slot::Drive, Slot::Taps, Slot::Special],
            (true, true) => &[Slot::Drive, Slot::Averages, Slot::Taps, Slot::Special],
        }
    }

    /// Sensors that average.
    pub(super) fn channels(self) -> usize {
        self.averages.into_iter().filter(|averages| *averages).count()
    }
}

/// A group of a candidate's constants for one recording, [`FIELDS`] entries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Slot {
    /// Limits of the reactions, load, and what the drive makes of a voltage.
    Drive,
    /// Of each sensor's window whole samples, the part of the oldest, and one over it.
    Averages,
    /// Whole samples of the dead time, the step of the first movement, and what one volt of each of three samples adds.
    Taps,
    /// Steps whose voltage no taps give, and what it adds.
    Special,
}

/// A candidate's constants for one recording, slot after slot.
pub(super) type Constants = [[f64; FIELDS]; 4];

impl Extras {
    /// The constants of a motor; `time` is that of [`crate::evaluate::late::late_times`].
    pub(super) fn constants(self, problem: &Problem, signals: &Signals, motor: &Extended, time: &[f64]) -> Constants {
        let taps = self.delayed.then(|| Taps::new(signals, problem.setting(signals), motor, time));
        let first = problem.first_active(signals);
        let mut constants = Constants::default();
        for (slot, own) in self.slots().iter().zip(&mut constants) {
            match (slot, &taps) {
                (Slot::Drive, _) => put_drive(own, motor),
                (Slot::Averages, _) => put_averages(own, motor),
                (Slot::Taps, Some(taps)) => put_taps(own, taps, first, signals.len()),
                (Slot::Special, Some(taps)) => put_special(own, taps, first, signals.len()),
                (_, None) => {}
            }
        }
        constants
    }
}

fn put_drive(own: &mut [f64; FIELDS], motor: &Extended) {
    use Parameter as P;
    let of = [P::BrushDrop, P::Coulomb, P::Load, P::Offset, P::Deadband, P::Saturation, P::NegativeGain];
    own.iter_mut().zip(of).for_each(|(own, of)| *own = motor.get(of).min(VOLTS_MAX));
}

fn put_averages(own: &mut [f64; FIELDS], motor: &Extended) {
    for (own, window) in own.chunks_exact_mut(3).zip(WINDOWS.map(|of| motor.get(of))) {
        let whole = window.clamp(1.0, WINDOW_MAX).floor();
        own.copy_from_slice(&[whole, window - whole, 1.0 / window]);
    }
}

/// Steps count from the `first` that is simulated; of `count` samples none has the number `count + 1`.
fn put_taps(own: &mut [f64; FIELDS], taps: &Taps, first: usize, count: usize) {
    own[0] = number(taps.delay.whole.min(count + 1));
    own[1] = number(taps.movement.unwrap_or(0).min(count + 1).saturating_sub(first));
    own[2..8].copy_from_slice(taps.gains.as_flattened());
}

fn put_special(own: &mut [f64; FIELDS], taps: &Taps, first: usize, count: usize) {
    for (own, (at, gains)) in own.chunks_exact_mut(3).zip(taps.special) {
        let at = at.min(count + 1).checked_sub(first).unwrap_or(count + 1);
        own.copy_from_slice(&[number(at), gains[0], gains[1]]);
    }
}

fn number(n: usize) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "at most SAMPLES_MAX")]
    let number = n as f64;
    number
}

/// Past values that the sensors of a candidate keep of one recording: a power of two, more than the longest window, or
/// all samples.
pub(super) fn ring(problem: &Problem, signals: &Signals) -> usize {
    let longest = WINDOWS.map(|window| longest(problem, window)).into_iter().fold(1.0, f64::max);
    let active = signals.len() - problem.first_active(signals);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 1 and WINDOW_MAX")]
    let longest = longest.clamp(1.0, WINDOW_MAX) as usize;
    (longest + 1).min(active.max(1)).next_power_of_two()
}

/// The largest value of a parameter in the bounds of a problem.
fn longest(problem: &Problem, parameter: Parameter) -> f64 {
    let space = problem.space();
    let free = space.free().iter().filter(|axis| axis.parameter == parameter).map(|axis| axis.max);
    let held = space.fixed().iter().filter(|held| held.0 == parameter).map(|held| held.2);
    free.chain(held).fold(0.0, f64::max)
}

/// Bytes of what the sensors of a candidate keep and its states, over all recordings.
pub(super) fn kept_bytes(problem: &Problem, extras: Extras, number_bytes: usize) -> usize {
    let channels = extras.channels();
    let ring = |signals: &Signals| if channels == 0 { 0 } else { channels * ring(problem, signals) };
    problem.signals().iter().map(|signals| number_bytes * (STATES + ring(signals))).sum()
}

/// Whether the device takes a problem. Not where inputs come late and a recording's clock is uneven or its voltage is a
/// line of its own over each step; where past values of sensors need more than `budget` bytes; nor recordings so long
/// that f32 does not count them.
pub(super) fn is_served(problem: &Problem, number_bytes: usize, budget: usize) -> bool {
    let Some(extras) = Extras::of(problem.extent()) else { return true };
    let uneven = |s: &Signals| !s.step_index.is_empty() || s.has_own_lines();
    let refused = |s: &Signals| s.len() > SAMPLES_MAX - 2 || (extras.delayed && uneven(s));
    !problem.signals().iter().any(|s| refused(s)) && LANES * kept_bytes(problem, extras, number_bytes) <= budget
}

/// Whether a candidate's windows are beyond the bounds, for which its past values are kept: the device computes wrongly.
pub(super) fn is_beyond(problem: &Problem, candidate: &[f64]) -> bool {
    let axes = problem.space().free().iter().zip(candidate);
    problem.extent().is_averaged()
        && axes.into_iter().any(|(axis, v)| WINDOWS.contains(&axis.parameter) && *v > longest(problem, axis.parameter))
}
