//! Numbers with a bound of their error. It is never below the rounding of the number, so that sums and products do not count their own
//! rounding.

use std::ops::{Add, Mul, Sub};

/// A value and a bound of its absolute error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounded {
    pub value: f64,
    pub error: f64,
}

impl Bounded {
    #[inline(always)]
    pub fn new(value: f64, error: f64) -> Self {
        Self { value, error }
    }

    /// Returns a number that is exact but for its rounding.
    #[inline(always)]
    pub fn rounded(value: f64) -> Self {
        Self::new(value, f64::EPSILON * value.abs())
    }
}

impl Add for Bounded {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.value + other.value, self.error + other.error)
    }
}

impl Sub for Bounded {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.value - other.value, self.error + other.error)
    }
}

/// A product with a number that is exact.
impl Mul<f64> for Bounded {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self::new(self.value * factor, self.error * factor.abs())
    }
}

impl Mul for Bounded {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let error = self.value.abs() * other.error + other.value.abs() * self.error;
        Self::new(self.value * other.value, error)
    }
}
