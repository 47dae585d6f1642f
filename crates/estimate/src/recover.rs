//! Conversion of two discrete-time transfer functions to motor parameters.
//!
//! The first samples h₁, h₂, h₃ of the impulse response (vectors of current and speed) give `Φ = [h₂ h₃][h₁ h₂]⁻¹`,
//! `A = ln(Φ)/h` and the continuous-time input vector b. Besides the denominator `s² + α₁ s + α₀` the transfer functions
//! have four coefficients: β₁ s + β₀ of the current and γ₁ s + γ₀ of the speed. γ₁ is zero in the model. Dropping it
//! reaches the Cramér–Rao bound, which reading the entries of A directly does not: `L = 1/β₁`, `B/J = β₀/β₁`,
//! `R = L(α₁ − B/J)`, `K/J = γ₀/β₁`, `K²/J = α₀ L − R·B/J`.

use super::failure::SmFailure;
use motorfit_motor::{Discretization, Parameters, inverse, matrix_logarithm, product, times};

/// Discrete-time transfer functions: the denominator `A(z) = 1 + a₁ z⁻¹ + a₂ z⁻²` and the numerators of current and speed.
pub(super) struct Sampled {
    pub denominator: [f64; 2],
    /// Coefficients from z⁰ on for a first-order hold, else from z⁻¹ on.
    pub numerators: [Vec<f64>; 2],
}

pub(super) fn recover(sampled: &Sampled, h: f64, method: Discretization) -> std::result::Result<Parameters, SmFailure> {
    let ([a1, a2], foh) = (sampled.denominator, method.uses_next_input());
    // Jury's stability conditions.
    if !(a2 < 1.0 && 1.0 + a1 + a2 > 0.0 && 1.0 - a1 + a2 > 0.0) {
        return Err(SmFailure::Unstable);
    }
    let response = [0, 1].map(|channel| {
        let b = &sampled.numerators[channel];
        let (b0, b1, b2) = if foh { (b[0], b[1], b[2]) } else { (0.0, b[0], b[1]) };
        let h1 = b1 - a1 * b0;
        let h2 = b2 - a1 * h1 - a2 * b0;
        [h1, h2, -a1 * h2 - a2 * h1]
    });
    let [[i1, i2, i3], [w1, w2, w3]] = response;
    let determinant = i1 * w2 - i2 * w1;
    let phi = [
        (i2 * w2 - i3 * w1) / determinant,
        (i3 * i1 - i2 * i2) / determinant,
        (w2 * w2 - w3 * w1) / determinant,
        (w3 * i1 - w2 * i2) / determinant,
    ];
    if !phi.iter().all(|v| v.is_finite()) {
        return Err(SmFailure::RankDeficient);
    }
    let d = [phi[0] - 1.0, phi[1], phi[2], phi[3] - 1.0];
    let a = if method == Discretization::Euler {
        d.map(|v| v / h)
    } else {
        matrix_logarithm(phi, h).ok_or(SmFailure::NoRealLogarithm)?
    };
    let mut b = times(product(a, inverse(d)), [i1, w1]);
    if foh {
        b = times(product(a, inverse(d)), b).map(|v| h * v);
    }
    motor(a, b)
}

/// Returns the motor of `ẋ = A x + b v`; the s-term of the speed's numerator is dropped.
fn motor(a: [f64; 4], b: [f64; 2]) -> std::result::Result<Parameters, SmFailure> {
    let (alpha1, alpha0) = (-(a[0] + a[3]), a[0] * a[3] - a[1] * a[2]);
    let (beta1, beta0) = (b[0], a[1] * b[1] - a[3] * b[0]);
    let gamma0 = a[2] * b[0] - a[0] * b[1];
    let l = 1.0 / beta1;
    let b_over_j = beta0 / beta1;
    let r = l * (alpha1 - b_over_j);
    let k_over_j = gamma0 / beta1;
    let k = (alpha0 * l - r * b_over_j) / k_over_j;
    let j = k / k_over_j;
    let found = Parameters { r, l, k, b: j * b_over_j, j };
    if found.to_array().iter().all(|v| v.is_finite() && *v > 0.0) { Ok(found) } else { Err(SmFailure::NotAMotor) }
}
