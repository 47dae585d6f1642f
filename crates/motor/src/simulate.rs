//! The scalar f64 simulation: the oracle against which every other evaluator is checked.
//!
//! It computes every sample in order by `x⁺ = x + (D x + gains)`, without shortcuts.

use super::discretize::{Method, StepMap};
use super::linear::Parameters;

/// The input of a simulation: samples of voltage and load torque, and the steps between them.
#[derive(Debug, Clone, Copy)]
pub struct SimulationInput<'a> {
    /// Distinct step lengths \[s\].
    pub step_s: &'a [f64],
    /// Index into `step_s` of the step that follows each sample; empty if all steps are the first.
    pub step_index: &'a [u16],
    /// Voltage at each sample \[V\]; the current \[A\] if that is the input.
    pub voltage: &'a [f64],
    /// Voltage at the end of each step \[V\], used by a first-order hold; empty if it equals the voltage of the next
    /// sample.
    pub voltage_end: &'a [f64],
    /// Load torque at each sample \[N·m\]; empty if there is none.
    pub torque: &'a [f64],
}

impl SimulationInput<'_> {
    /// Returns the index into `step_s` of the step that follows a sample.
    #[must_use]
    #[inline]
    pub fn index(&self, n: usize) -> usize {
        self.step_index.get(n).map_or(0, |&index| usize::from(index))
    }

    /// Returns the length of the step that follows a sample \[s\]; NaN if it is not listed.
    #[must_use]
    #[inline]
    pub fn step(&self, n: usize) -> f64 {
        self.step_s.get(self.index(n)).copied().unwrap_or(f64::NAN)
    }

    /// Returns the voltage at the end of the step that follows a sample \[V\]; NaN if there is no such sample.
    #[inline]
    #[must_use]
    pub fn end(&self, n: usize) -> f64 {
        let next = || n.checked_add(1).and_then(|next| self.voltage.get(next)).or(self.voltage.get(n));
        self.voltage_end.get(n).or_else(next).copied().unwrap_or(f64::NAN)
    }
}

/// Simulates the motor over all samples from the state `initial` = `[i, ω]` and returns current \[A\] and speed \[rad/s\],
/// one value for each sample.
///
/// The values are not finite if the motor diverges or the input has a step index that `step_s` lacks; this is not an error.
#[must_use]
pub fn simulate(
    parameters: &Parameters,
    drive: &SimulationInput<'_>,
    initial: [f64; 2],
    method: impl Into<Method>,
) -> [Vec<f64>; 2] {
    let mut signals = [0, 1].map(|_| Vec::with_capacity(drive.voltage.len()));
    walk(parameters, drive, initial, method, |x| {
        signals.iter_mut().zip(x).for_each(|(signal, value)| signal.push(value));
    });
    signals
}

/// Simulates like [`simulate`] and calls `visit` with the state `[i, ω]` \[A, rad/s\] of each sample.
pub fn walk(
    parameters: &Parameters,
    drive: &SimulationInput<'_>,
    initial: [f64; 2],
    method: impl Into<Method>,
    mut visit: impl FnMut([f64; 2]),
) {
    let method = method.into();
    let maps: Vec<StepMap> = drive.step_s.iter().map(|&h| StepMap::new(parameters, h, method)).collect();
    let mut x = initial;
    for n in 0..drive.voltage.len() {
        visit(x);
        let Some(map) = maps.get(drive.index(n)) else {
            x = [f64::NAN; 2];
            continue;
        };
        let (v, v_next) = (drive.voltage[n], drive.end(n));
        let torque = drive.torque.get(n).copied().unwrap_or(0.0);
        let gain = |axis: usize| map.taps[0][axis] * v + map.taps[1][axis] * v_next + map.torque[axis] * torque;
        x = [
            x[0] + (map.d[0] * x[0] + map.d[1] * x[1] + gain(0)),
            x[1] + (map.d[2] * x[0] + map.d[3] * x[1] + gain(1)),
        ];
    }
}
