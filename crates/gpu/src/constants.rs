//! The constants of motors with extensions, which shaders read after the step maps; and the conditions under which a problem is
//! evaluated on the CPU instead.

use super::features::{FIELDS, SLOTS, STATES, ShaderFeatures, Slot, WINDOWS};
use super::variant::LANES;
use motorfit_core::numeric::{count, real};
use motorfit_evaluate::{Problem, Signals};
use motorfit_motor::{DelayTaps, Extended, MovingAverage, Parameter, TapGains, WINDOW_MAX};
use std::sync::Arc;

/// Largest number of samples whose indices f32 represents exactly.
const SAMPLES_MAX: usize = 1 << 24;
/// Saturation of a drive that does not saturate \[V\].
const VOLTS_MAX: f64 = 1e30;

/// The constants of a candidate for one recording, slot after slot.
pub(crate) type Constants = [[f64; FIELDS]; SLOTS];

/// Returns the constants of a motor. `time` holds the times of the samples if [`motorfit_motor::needs_times`] is true.
pub(crate) fn constants(
    features: ShaderFeatures,
    problem: &Problem,
    signals: &Signals,
    motor: &Extended,
    time: &Arc<[f64]>,
) -> Constants {
    let mut constants = Constants::default();
    let values = constants.as_flattened_mut();
    values.iter_mut().zip(motor.extensions).for_each(|(own, value)| *own = value.min(VOLTS_MAX));
    if features.averages != [false; 2] {
        let own = &mut constants[features.slot(Slot::Averages)];
        for (own, window) in own.chunks_exact_mut(3).zip(WINDOWS.map(|of| motor.get(of))) {
            let (whole, MovingAverage { part, share }) = MovingAverage::new(window);
            own.copy_from_slice(&[count(whole), part, share]);
        }
    }
    if features.delayed {
        let (drive, settings) = (signals.drive(), problem.settings(signals));
        let gains = TapGains::new(&motor.map(|value| [value]), drive.step_s[0], settings);
        let taps = DelayTaps::new(motor, (&gains, 0), drive, settings, time.clone());
        // Steps are counted from the first simulated sample. The number `samples + 1` marks a step that does not occur.
        let (first, samples) = (problem.first_active(signals), signals.len());
        let own = &mut constants[features.slot(Slot::Taps)];
        own[0] = real(taps.whole.min(samples.cast_signed() + 1) as i64);
        own[1] = count(taps.movement.unwrap_or(0).min(samples + 1).saturating_sub(first));
        own[2..8].copy_from_slice(taps.gains.as_flattened());
        own[8] = taps.bend_at;
        let own = &mut constants[features.slot(Slot::Special)];
        // The first two special steps are those before the first movement, which the shaders handle.
        for (own, step) in own.chunks_exact_mut(3).zip(&taps.special[2..]) {
            let at = step.at.min(samples + 1).checked_sub(first).unwrap_or(samples + 1);
            own.copy_from_slice(&[count(at), step.change[0], step.change[1]]);
        }
    }
    constants
}

/// Returns the length of the ring buffer of past values of a sensor for one recording: a power of two that holds the longest
/// window and one more sample, or all simulated samples if these are fewer.
pub(crate) fn ring(problem: &Problem, signals: &Signals) -> usize {
    let longest = WINDOWS.map(|window| longest(problem, window)).into_iter().fold(1.0, f64::max);
    let active = signals.len() - problem.first_active(signals);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 1 and WINDOW_MAX")]
    let longest = longest.clamp(1.0, WINDOW_MAX) as usize;
    (longest + 1).min(active.max(1)).next_power_of_two()
}

/// Returns the largest value of a parameter within the bounds of a problem, 0 if it is not among its parameters.
fn longest(problem: &Problem, parameter: Parameter) -> f64 {
    let space = problem.space();
    let free = space.free().iter().filter(|axis| axis.parameter == parameter).map(|axis| axis.max);
    let fixed = space.fixed().iter().filter(|fixed| fixed.0 == parameter).map(|fixed| fixed.2);
    free.chain(fixed).fold(0.0, f64::max)
}

/// Returns the bytes of the past sensor values and the states of a candidate, over all recordings.
pub(crate) fn kept_bytes(problem: &Problem, features: ShaderFeatures, number_bytes: usize) -> usize {
    let kept = |signals: &Arc<Signals>| STATES + features.channels() * ring(problem, signals);
    problem.signals().iter().map(|signals| number_bytes * kept(signals)).sum()
}

/// Returns true if the device can evaluate a problem. It cannot evaluate delayed inputs with irregular steps or with a voltage
/// that may jump between steps (of a resampled recording), past sensor values of more than `budget` bytes, or recordings with
/// more samples than f32 can count.
pub(crate) fn is_served(problem: &Problem, number_bytes: usize, budget: usize) -> bool {
    let Some(features) = ShaderFeatures::of(problem.features()) else { return true };
    let uneven = |s: &Signals| !s.step_index.is_empty() || s.has_slopes();
    let refused = |s: &Signals| s.len() > SAMPLES_MAX - 2 || (features.delayed && uneven(s));
    !problem.signals().iter().any(|s| refused(s)) && LANES * kept_bytes(problem, features, number_bytes) <= budget
}

/// Returns true if a sensor window of a candidate exceeds the bounds. The ring buffers are sized by the bounds, so that the
/// device would compute a wrong cost.
pub(crate) fn is_beyond(problem: &Problem, candidate: &[f64]) -> bool {
    let axes = problem.space().free().iter().zip(candidate);
    problem.features().is_averaged()
        && axes.into_iter().any(|(axis, v)| WINDOWS.contains(&axis.parameter) && *v > longest(problem, axis.parameter))
}
