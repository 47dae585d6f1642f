//! The values of a motor with its extensions, of one number type or of several motors side by side.

use super::linear::Parameters;
use super::parameter::{Extensions, Parameter};

/// A motor with its extensions. With arrays as values it is several motors side by side, a lane each.
#[derive(Debug, Clone, Copy)]
pub struct Extended<T = f64> {
    /// R, L, K, B, J.
    pub motor: [T; 5],
    /// The extensions in the order of [`Parameter::EXTENSIONS`].
    pub extensions: [T; Parameter::EXTENSIONS.len()],
}

impl Extended {
    /// Makes a motor of values.
    #[must_use]
    pub fn new(parameters: &Parameters, extensions: &Extensions) -> Self {
        Self { motor: parameters.to_array(), extensions: extensions.to_array() }
    }
}

impl<T: Copy> Extended<T> {
    /// Returns the value of one parameter.
    #[must_use]
    pub fn get(&self, parameter: Parameter) -> T {
        let n = parameter as usize;
        if n < self.motor.len() { self.motor[n] } else { self.extensions[n - self.motor.len()] }
    }

    /// Changes the value of one parameter.
    pub fn set(&mut self, parameter: Parameter, value: T) {
        let n = parameter as usize;
        if n < self.motor.len() {
            self.motor[n] = value;
        } else {
            self.extensions[n - self.motor.len()] = value;
        }
    }

    /// Returns the motor with `change` applied to every value.
    #[must_use]
    pub fn map<U>(&self, change: impl Fn(T) -> U) -> Extended<U> {
        Extended { motor: self.motor.map(&change), extensions: self.extensions.map(&change) }
    }
}

impl<const L: usize> Extended<[f64; L]> {
    /// Puts motors side by side.
    pub(crate) fn side_by_side(motors: &[Extended; L]) -> Self {
        Self {
            motor: std::array::from_fn(|p| std::array::from_fn(|lane| motors[lane].motor[p])),
            extensions: std::array::from_fn(|p| std::array::from_fn(|lane| motors[lane].extensions[p])),
        }
    }

    /// Returns one of the motors.
    #[inline(always)]
    pub(crate) fn lane(&self, lane: usize) -> Extended {
        self.map(|values| values[lane])
    }
}
