//! Initial estimates from the speed: the first-order lag `J dω/dt = (K/R) v − (B + K²/R) ω − T`, the motor without inductance,
//! discretized exactly and estimated by least squares (ARX). They are biased by noise, but suffice as starts of a refinement.

use motorfit_core::{Error, Result};
use motorfit_record::Record;
use nalgebra::{Matrix3, Vector3};

/// Returns initial estimates of L, K and J of the normalized motor with R = 1 Ω and no friction.
///
/// # Errors
/// Returns the same errors as [`lag_by_speed`].
pub(crate) fn guess_by_speed(record: &Record) -> Result<[f64; 3]> {
    let [gain, constant] = lag_by_speed(record)?;
    Ok([0.3 * record.period_s(), 1.0 / gain, constant / (gain * gain)])
}

/// Estimates the gain \[rad/s per unit of the input\] and the time constant \[s\] of the first-order lag from input to speed.
///
/// # Errors
/// Returns `Data` if the speed does not follow the input.
pub(crate) fn lag_by_speed(record: &Record) -> Result<[f64; 2]> {
    lag(record)
        .and_then(|[decay, by_input, _]| Some([by_input.abs() / (1.0 - decay), constant(record, decay)?]))
        .filter(|[gain, _]| gain.is_finite() && *gain > 0.0)
        .ok_or_else(|| Error::data("the speed does not follow the input", "Check the recording."))
}

/// Returns initial estimates of R, L, K, B and J from the speed under a recorded load torque, which gives the scale of torques.
/// Viscous friction is set to 0.1 % of the total damping, since back-EMF and friction have the same effect on the speed. `None`
/// if the speed does not follow both the input and the torque.
pub(crate) fn guess_by_load(record: &Record) -> Option<[f64; 5]> {
    let [decay, by_input, by_torque] = lag(record)?;
    let brake = (1.0 - decay) / -by_torque;
    let per_volt = brake * by_input / (1.0 - decay);
    let (k, r) = (brake / per_volt, brake / (per_volt * per_volt));
    let motor = [r, 0.3 * record.period_s() * r, k, 1e-3 * brake, brake * constant(record, decay)?];
    motor.iter().all(|value| value.is_finite() && *value > 0.0).then_some(motor)
}

/// Returns true if a recorded load torque varies.
pub(crate) fn load_varies(record: &Record) -> bool {
    let torque = record.samples().torque.as_deref().unwrap_or_default();
    torque.iter().any(|t| t.to_bits() != torque[0].to_bits())
}

/// Returns the time constant of a decay per sample \[s\].
fn constant(record: &Record, decay: f64) -> Option<f64> {
    let constant = -record.period_s() / decay.ln();
    constant.is_finite().then_some(constant)
}

/// Estimates a, b and c of `ω⁺ = a ω + b u + c T` by least squares; c is zero without a varying load torque.
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
    // The columns differ by decades; scaling them improves the conditioning.
    let scale = matrix.diagonal().map(|v| if v > 0.0 { v.sqrt() } else { 1.0 });
    let scaled = Matrix3::from_fn(|a, b| matrix[(a, b)] / (scale[a] * scale[b]));
    let solved = scaled.lu().solve(&right.component_div(&scale))?.component_div(&scale);
    Some([solved[0].clamp(0.01, 0.9999), solved[1], solved[2]])
}
