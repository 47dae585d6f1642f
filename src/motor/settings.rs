//! The settings in which a motor with extensions is simulated.

use super::discretize::Method;
use super::features::ModelFeatures;

/// The input before a recording and up to its first movement.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct InputHistory {
    /// Voltage before the first sample \[V\].
    pub voltage: f64,
    /// The first sample whose voltage differs from that by more than a twentieth of the largest difference.
    pub first_movement: usize,
}

/// The part of its largest change that is a movement of the voltage.
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

/// The settings in which a motor with extensions is simulated.
#[derive(Debug, Clone, Copy)]
pub struct SimulationSettings {
    /// The extensions of the model.
    pub features: ModelFeatures,
    /// The one-step method.
    pub method: Method,
    /// The input before the recording.
    pub history: InputHistory,
}
