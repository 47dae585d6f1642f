//! Static nonlinearity of the drive: deadband, saturation, a separate gain for negative voltages, offset.
//!
//! `u = max(min(|v|, vs) − vd, 0)`, multiplied by −gn for v < 0; then `+ v0`, all in \[V\] except gn. Shader:
//! `shaders/drive.wgsl`. The formula is tested by `the_drive_acts_on_the_voltage` in `tests/evaluate/extensions/meaning.rs`.

use super::dual::Number;
use super::extended::Extended;
use super::features::ModelFeatures;
use super::parameter::Parameter;

/// The parameters of a drive; arrays as values hold the drives of several motors, a lane each.
#[derive(Clone, Copy)]
pub struct DriveNonlinearity<T> {
    deadband: T,
    saturation: T,
    negative_gain: T,
    offset: T,
}

impl<T: Copy> DriveNonlinearity<T> {
    /// Returns the drive of a motor.
    #[inline(always)]
    pub fn of(motor: &Extended<T>) -> Self {
        Self {
            deadband: motor.get(Parameter::Deadband),
            saturation: motor.get(Parameter::Saturation),
            negative_gain: motor.get(Parameter::NegativeGain),
            offset: motor.get(Parameter::Offset),
        }
    }

    /// Returns true if the drive of a model is nonlinear, that is, more than an offset.
    pub fn is_nonlinear(features: ModelFeatures) -> bool {
        features.has_any(&[Parameter::Deadband, Parameter::Saturation, Parameter::NegativeGain])
    }
}

impl<T: Number> DriveNonlinearity<T> {
    /// Returns the voltage \[V\] at the motor for a commanded voltage \[V\].
    #[inline(always)]
    pub fn output(self, voltage: f64) -> T {
        let size = T::constant(voltage.abs());
        let saturated = if self.saturation.value() < size.value() { self.saturation } else { size };
        let above_deadband = saturated - self.deadband;
        let reduced = if above_deadband.value() > 0.0 { above_deadband } else { T::constant(0.0) };
        let signed = if voltage < 0.0 { -(self.negative_gain * reduced) } else { reduced };
        signed + self.offset
    }
}

impl<const L: usize> DriveNonlinearity<[f64; L]> {
    /// Returns the drive of one motor.
    #[inline(always)]
    pub(crate) fn lane(&self, lane: usize) -> DriveNonlinearity<f64> {
        let Self { deadband, saturation, negative_gain, offset } = self;
        DriveNonlinearity {
            deadband: deadband[lane],
            saturation: saturation[lane],
            negative_gain: negative_gain[lane],
            offset: offset[lane],
        }
    }

    /// Replaces the commanded voltage \[V\] of each motor by the voltage at the motor.
    #[inline(always)]
    pub fn drive(&self, voltages: &mut [f64; L]) {
        for (lane, voltage) in voltages.iter_mut().enumerate() {
            *voltage = self.lane(lane).output(*voltage);
        }
    }

    /// Returns the voltages \[V\] at all motors for one commanded voltage \[V\].
    #[inline(always)]
    pub fn outputs(&self, voltage: f64) -> [f64; L] {
        let mut outputs = [0.0; L];
        for (lane, outputs) in outputs.iter_mut().enumerate() {
            *outputs = self.lane(lane).output(voltage);
        }
        outputs
    }
}
