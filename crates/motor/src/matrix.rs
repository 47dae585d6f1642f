//! Real 2×2 matrices, row-major.

/// A real 2×2 matrix, row-major.
pub type Matrix2 = [f64; 4];

/// Returns the product `a b`.
#[must_use]
pub fn product(a: Matrix2, b: Matrix2) -> Matrix2 {
    [a[0] * b[0] + a[1] * b[2], a[0] * b[1] + a[1] * b[3], a[2] * b[0] + a[3] * b[2], a[2] * b[1] + a[3] * b[3]]
}

/// Returns the inverse `m⁻¹`; its entries are not finite if the matrix is singular.
#[must_use]
pub fn inverse([a, b, c, d]: Matrix2) -> Matrix2 {
    let determinant = a * d - b * c;
    [d, -b, -c, a].map(|v| v / determinant)
}

/// Returns the product `m v` of a matrix and a vector.
#[must_use]
pub fn times(m: Matrix2, v: [f64; 2]) -> [f64; 2] {
    [m[0] * v[0] + m[1] * v[1], m[2] * v[0] + m[3] * v[1]]
}

/// Returns the generator `A` \[1/s\] of the transition matrix `phi` over `h` seconds, `A = ln(Φ)/h`. Returns `None` if
/// there is no real principal logarithm (a determinant or a real eigenvalue of zero or less) or an argument is not finite.
///
/// With `σ = tr Φ / 2`, `M = Φ − σI`, `Δ = σ² − det Φ`: `A = [½ ln(det Φ) I + f M]/h`, where `f = atan2(w, σ)/w`,
/// `w = √−Δ` for complex eigenvalues and `f = atanh(w/σ)/w`, `w = √Δ` for real ones. Reference: N. J. Higham,
/// Functions of Matrices (2008), ch. 11.
#[must_use]
pub fn matrix_logarithm(phi: Matrix2, h: f64) -> Option<Matrix2> {
    let sigma = 0.5 * (phi[0] + phi[3]);
    let determinant = phi[0] * phi[3] - phi[1] * phi[2];
    if phi.iter().any(|v| !v.is_finite()) || !(h.is_finite() && h > 0.0) || determinant <= 0.0 {
        return None;
    }
    let half_difference = 0.5 * (phi[0] - phi[3]);
    // This form of σ² − det Φ avoids cancellation.
    let delta = half_difference * half_difference + phi[1] * phi[2];
    let w = delta.abs().sqrt();
    if delta >= 0.0 && sigma <= w {
        return None;
    }
    let f = if w < 1e-8 * sigma.abs() {
        1.0 / sigma // The limit of both branches; the relative error (w/σ)²/3 is below 1e-16.
    } else if delta < 0.0 {
        w.atan2(sigma) / w
    } else {
        (w / sigma).atanh() / w
    };
    let mean = 0.5 * determinant.ln();
    let m = [half_difference, phi[1], phi[2], -half_difference];
    Some([(mean + f * m[0]) / h, f * m[1] / h, f * m[2] / h, (mean + f * m[3]) / h])
}
