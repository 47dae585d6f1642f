//! The drive: what it makes of the voltages that it is told.

use super::dual::Number;
use super::extended::Extended;
use super::parameter::Parameter;

/// A drive with a deadband, a saturation, another gain for negative voltages, and an offset.
#[derive(Clone, Copy)]
pub(crate) struct Terminal<T> {
    pub deadband: T,
    pub saturation: T,
    pub reverse_gain: T,
    pub offset: T,
}

impl<T: Number> Terminal<T> {
    #[inline(always)]
    pub(crate) fn of(motor: &Extended<T>) -> Self {
        Self {
            deadband: motor.get(Parameter::Deadband),
            saturation: motor.get(Parameter::Saturation),
            reverse_gain: motor.get(Parameter::NegativeGain),
            offset: motor.get(Parameter::Offset),
        }
    }

    /// The voltage at the motor.
    #[inline(always)]
    pub(crate) fn gives(self, voltage: f64) -> T {
        let told = T::constant(voltage.abs());
        let reached = if self.saturation.value() < told.value() { self.saturation } else { told };
        let left = reached - self.deadband;
        let given = if left.value() > 0.0 { left } else { T::constant(0.0) };
        let turned = if voltage < 0.0 { -(self.reverse_gain * given) } else { given };
        turned + self.offset
    }
}
