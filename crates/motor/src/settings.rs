//! Settings of the simulation of a motor with extensions.

use super::discretize::Method;
use super::features::ModelFeatures;

/// The input before a recording and the sample of its first movement.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct InputHistory {
    /// Voltage before the first sample \[V\].
    pub voltage: f64,
    /// Index of the first sample whose voltage differs from `voltage` by more than a twentieth of the largest difference.
    pub first_movement: usize,
}

/// Fraction of the largest change of the voltage from which a change counts as a movement.
const MOVEMENT: f64 = 0.05;

impl InputHistory {
    /// Returns the history of a recording: zero volts before a motor at rest, else the voltage of the first sample.
    #[must_use]
    pub fn of(voltage: &[f64], at_rest: bool) -> Self {
        let before = if at_rest { 0.0 } else { voltage.first().copied().unwrap_or(0.0) };
        let largest = voltage.iter().fold(0.0, |m: f64, v| m.max((v - before).abs()));
        let moved = voltage.iter().position(|v| (v - before).abs() > MOVEMENT * largest);
        Self { voltage: before, first_movement: moved.unwrap_or(voltage.len()) }
    }
}

/// Settings of the simulation of a motor with extensions.
#[derive(Debug, Clone, Copy)]
pub struct SimulationSettings {
    /// The extensions of the model.
    pub features: ModelFeatures,
    /// The one-step method.
    pub method: Method,
    /// The input before the recording and its first movement.
    pub history: InputHistory,
}
