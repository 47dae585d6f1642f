//! Values of a motor with its extensions, for one motor of any number type or several motors side by side.

use super::linear::Parameters;
use super::parameter::Parameter;

/// A motor with its extensions; arrays as values hold several motors side by side, a lane each.
#[derive(Debug, Clone, Copy)]
pub struct Extended<T = f64> {
    /// Parameters of the motor in the order R, L, K, B, J.
    pub motor: [T; 5],
    /// Parameters of the extensions in the order of [`Parameter::EXTENSIONS`].
    pub extensions: [T; Parameter::EXTENSIONS.len()],
}

/// Makes a motor whose extensions are at their neutral values.
impl From<&Parameters> for Extended {
    fn from(parameters: &Parameters) -> Self {
        Self { motor: parameters.to_array(), extensions: Parameter::EXTENSIONS.map(Parameter::neutral) }
    }
}

impl Extended {
    /// Returns the motor with another value for one parameter.
    #[must_use]
    pub fn with(mut self, parameter: Parameter, value: f64) -> Self {
        self.set(parameter, value);
        self
    }

    /// Returns the parameters of the linear motor.
    #[must_use]
    pub fn parameters(&self) -> Parameters {
        Parameters::from_array(self.motor)
    }
}

impl<T: Copy> Extended<T> {
    /// Returns the value of one parameter.
    #[must_use]
    pub fn get(&self, parameter: Parameter) -> T {
        let n = parameter as usize;
        if n < self.motor.len() { self.motor[n] } else { self.extensions[n - self.motor.len()] }
    }

    /// Sets the value of one parameter.
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
    /// Makes a motor with a lane for each of `motors`.
    #[doc(hidden)]
    pub fn side_by_side(motors: &[Extended; L]) -> Self {
        Self {
            motor: std::array::from_fn(|p| std::array::from_fn(|lane| motors[lane].motor[p])),
            extensions: std::array::from_fn(|p| std::array::from_fn(|lane| motors[lane].extensions[p])),
        }
    }

    /// Returns the motor of one lane.
    #[inline(always)]
    #[doc(hidden)]
    pub fn lane(&self, lane: usize) -> Extended {
        self.map(|values| values[lane])
    }
}
