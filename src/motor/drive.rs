//! The drive: deadband, saturation, a gain of its own for negative voltages, offset.
//!
//! `u = min(|v|, vs) − vd`, at least 0, negative and times gn where v < 0; then `+ v0`. Twin: `shaders/drive.wgsl`. Its
//! meaning is held by `the_drive_acts_on_the_voltage` in `tests/extensions/meaning.rs`.

use super::dual::Number;
use super::extended::Extended;
use super::features::ModelFeatures;
use super::parameter::Parameter;

/// The parameters of a drive. With arrays as values it is the drives of several motors, a lane each.
#[derive(Clone, Copy)]
pub(crate) struct DriveNonlinearity<T> {
    deadband: T,
    saturation: T,
    negative_gain: T,
    offset: T,
}

impl<T: Copy> DriveNonlinearity<T> {
    #[inline(always)]
    pub(crate) fn of(motor: &Extended<T>) -> Self {
        Self {
            deadband: motor.get(Parameter::Deadband),
            saturation: motor.get(Parameter::Saturation),
            negative_gain: motor.get(Parameter::NegativeGain),
            offset: motor.get(Parameter::Offset),
        }
    }

    /// Returns whether a model's voltage at the motor is more than that of the recording plus an offset.
    pub(crate) fn bends(features: ModelFeatures) -> bool {
        features.has_any(&[Parameter::Deadband, Parameter::Saturation, Parameter::NegativeGain])
    }
}

impl<T: Number> DriveNonlinearity<T> {
    /// Returns the voltage at the motor for a commanded one.
    #[inline(always)]
    pub(crate) fn output(self, voltage: f64) -> T {
        let size = T::constant(voltage.abs());
        let reached = if self.saturation.value() < size.value() { self.saturation } else { size };
        let left = reached - self.deadband;
        let given = if left.value() > 0.0 { left } else { T::constant(0.0) };
        let signed = if voltage < 0.0 { -(self.negative_gain * given) } else { given };
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

    /// Returns the voltages at all motors for a commanded one.
    #[inline(always)]
    pub(crate) fn outputs(&self, voltage: f64) -> [f64; L] {
        let mut given = [0.0; L];
        for (lane, given) in given.iter_mut().enumerate() {
            *given = self.lane(lane).output(voltage);
        }
        given
    }
}
