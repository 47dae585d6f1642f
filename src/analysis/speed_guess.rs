//! A first-order lag read off the speed: `J ω̇ = (K/R) v − (B + K²/R) ω − T`, the motor without inductance, sampled by exact
//! steps. Rough, but where a refinement may begin.

use crate::record::Record;
use crate::{Error, Result};
use nalgebra::{Matrix3, Vector3};

/// Returns L, K and J of a motor with R = 1 Ω and no friction that about does what the speed shows.
///
/// # Errors
/// As [`lag_by_speed`].
pub(crate) fn guess_by_speed(record: &Record) -> Result<[f64; 3]> {
    let [gain, constant] = lag_by_speed(record)?;
    Ok([0.3 * record.period_s(), 1.0 / gain, constant / (gain * gain)])
}

/// Returns gain \[rad/s per unit of the input\] and time constant \[s\] of the first-order lag that about does what the speed
/// shows.
///
/// # Errors
/// `Data` where the speed does not follow the input.
pub(crate) fn lag_by_speed(record: &Record) -> Result<[f64; 2]> {
    lag(record)
        .and_then(|[decay, by_input, _]| Some([by_input.abs() / (1.0 - decay), constant(record, decay)?]))
        .filter(|[gain, _]| gain.is_finite() && *gain > 0.0)
        .ok_or_else(|| Error::data("the speed does not follow the input", "Check the recording."))
}

/// Returns R, L, K, B and J of a motor that about does what the speed shows under a recorded load torque, which gives the scale of
/// torques: with next to no viscous friction, because back-EMF and friction brake alike. `None` where the speed does not follow
/// both.
pub(crate) fn guess_by_load(record: &Record) -> Option<[f64; 5]> {
    let [decay, by_input, by_torque] = lag(record)?;
    let brake = (1.0 - decay) / -by_torque;
    let per_volt = brake * by_input / (1.0 - decay);
    let (k, r) = (brake / per_volt, brake / (per_volt * per_volt));
    let motor = [r, 0.3 * record.period_s() * r, k, 1e-3 * brake, brake * constant(record, decay)?];
    motor.iter().all(|value| value.is_finite() && *value > 0.0).then_some(motor)
}

/// Returns whether a load torque was recorded that varies.
pub(crate) fn load_varies(record: &Record) -> bool {
    let torque = record.samples().torque.as_deref().unwrap_or_default();
    torque.iter().any(|t| t.to_bits() != torque[0].to_bits())
}

fn constant(record: &Record, decay: f64) -> Option<f64> {
    let constant = -record.period_s() / decay.ln();
    constant.is_finite().then_some(constant)
}

/// Returns a, b and c of `ω⁺ = a ω + b u + c T` by least squares; c is zero where no load torque was recorded that varies.
fn lag(record: &Record) -> Option<[f64; 3]> {
    let (speed, input) = (record.samples().speed.as_deref().unwrap_or_default(), record.input());
    let torque = record.samples().torque.as_deref().filter(|_| load_varies(record));
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (n, pair) in speed.windows(2).enumerate() {
        let row = Vector3::new(pair[0], input[n], torque.map_or(0.0, |torque| torque[n]));
        matrix += row * row.transpose();
        right += row * pair[1];
    }
    if torque.is_none() {
        matrix[(2, 2)] = 1.0;
    }
    // Units differ by decades.
    let scale = matrix.diagonal().map(|v| if v > 0.0 { v.sqrt() } else { 1.0 });
    let scaled = Matrix3::from_fn(|a, b| matrix[(a, b)] / (scale[a] * scale[b]));
    let solved = scaled.lu().solve(&right.component_div(&scale))?.component_div(&scale);
    Some([solved[0].clamp(0.01, 0.9999), solved[1], solved[2]])
}
