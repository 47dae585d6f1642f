//! Dual numbers: forward-mode automatic differentiation.
//!
//! Reference: A. Griewank, A. Walther, Evaluating Derivatives (2008), ch. 3.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Number type that one-step maps and simulations are generic in.
pub trait Number:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Mul<f64, Output = Self>
{
    /// Returns a number with zero derivatives.
    fn constant(value: f64) -> Self;
    /// Returns the value without its derivatives.
    fn value(self) -> f64;

    /// Returns the absolute value.
    #[must_use]
    #[inline(always)]
    fn abs(self) -> Self {
        if self.value() < 0.0 { -self } else { self }
    }

    /// Returns the number clipped to ±`limit`. At the limit itself the derivatives are those of the number, because a motor
    /// at rest sticks.
    #[must_use]
    #[inline(always)]
    fn clip(self, limit: Self) -> Self {
        if self.value().abs() <= limit.value() {
            self
        } else if self.value() > 0.0 {
            limit
        } else {
            -limit
        }
    }

    /// Returns `a b + c`; fused if `FMA` is true and the type supports it.
    #[must_use]
    #[inline(always)]
    fn multiply_add<const FMA: bool>(a: Self, b: Self, c: Self) -> Self {
        a * b + c
    }
}

/// Returns `a b + c`, fused if `FMA` is true.
#[inline(always)]
pub fn multiply_add<const FMA: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FMA { a.mul_add(b, c) } else { a * b + c }
}

impl Number for f64 {
    /// Clips with two selections of one instruction each; the limit is the second operand and may be in memory.
    #[inline(always)]
    fn clip(self, limit: Self) -> Self {
        let low = if self > -limit { self } else { -limit };
        if low < limit { low } else { limit }
    }

    #[inline(always)]
    fn multiply_add<const FMA: bool>(a: Self, b: Self, c: Self) -> Self {
        multiply_add::<FMA>(a, b, c)
    }

    #[inline(always)]
    fn constant(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn value(self) -> f64 {
        self
    }
}

/// A value and its derivatives with respect to `P` variables.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual<const P: usize> {
    /// The value.
    pub value: f64,
    /// The derivatives of the value.
    pub derivatives: [f64; P],
}

impl<const P: usize> Dual<P> {
    #[inline(always)]
    fn new(value: f64, derivative: impl Fn(usize) -> f64) -> Self {
        Self { value, derivatives: std::array::from_fn(derivative) }
    }
}

impl<const P: usize> Number for Dual<P> {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self { value, derivatives: [0.0; P] }
    }

    #[inline(always)]
    fn value(self) -> f64 {
        self.value
    }
}

impl<const P: usize> Add for Dual<P> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.value + other.value, |p| self.derivatives[p] + other.derivatives[p])
    }
}

impl<const P: usize> Sub for Dual<P> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.value - other.value, |p| self.derivatives[p] - other.derivatives[p])
    }
}

impl<const P: usize> Mul for Dual<P> {
    type Output = Self;

    #[inline(always)]
    #[expect(clippy::suspicious_arithmetic_impl, reason = "the product rule adds")]
    fn mul(self, other: Self) -> Self {
        let slope = |p: usize| self.derivatives[p] * other.value + self.value * other.derivatives[p];
        Self::new(self.value * other.value, slope)
    }
}

impl<const P: usize> Mul<f64> for Dual<P> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self::new(self.value * factor, |p| self.derivatives[p] * factor)
    }
}

impl<const P: usize> Div for Dual<P> {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let (value, inverse) = (self.value / other.value, 1.0 / other.value);
        Self::new(value, |p| (self.derivatives[p] - value * other.derivatives[p]) * inverse)
    }
}

impl<const P: usize> Neg for Dual<P> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.value, |p| -self.derivatives[p])
    }
}
