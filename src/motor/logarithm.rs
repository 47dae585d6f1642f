//! From a sampled motor back to a continuous one: `A = ln(Φ)/h` of a real 2×2 matrix.
//!
//! With `σ = tr Φ / 2`, `M = Φ − σI`, `Δ = σ² − det Φ`: `A = [½ ln(det Φ) I + f M]/h`, where `f = atan2(w, σ)/w`,
//! `w = √−Δ` for complex eigenvalues and `f = atanh(w/σ)/w`, `w = √Δ` for real ones. Reference: N. J. Higham,
//! Functions of Matrices (2008), ch. 11.

/// Why there is no real principal logarithm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum LogarithmError {
    /// The determinant is zero or negative.
    Determinant,
    /// A real eigenvalue is zero or negative.
    Eigenvalue,
    /// An entry is not finite.
    NotFinite,
}

/// The generator `A` \[1/s\] of the transition matrix `phi` (row-major) over `h` seconds.
///
/// # Errors
/// A [`LogarithmError`] when no real principal logarithm exists.
pub fn matrix_logarithm(phi: [f64; 4], h: f64) -> Result<[f64; 4], LogarithmError> {
    if phi.iter().any(|v| !v.is_finite()) || !(h.is_finite() && h > 0.0) {
        return Err(LogarithmError::NotFinite);
    }
    let sigma = 0.5 * (phi[0] + phi[3]);
    let determinant = phi[0] * phi[3] - phi[1] * phi[2];
    if determinant <= 0.0 {
        return Err(LogarithmError::Determinant);
    }
    let half_difference = 0.5 * (phi[0] - phi[3]);
    // σ² − det Φ without its cancellation.
    let delta = half_difference * half_difference + phi[1] * phi[2];
    let w = delta.abs().sqrt();
    if delta >= 0.0 && sigma <= w {
        return Err(LogarithmError::Eigenvalue);
    }
    let f = if w < 1e-8 * sigma.abs() {
        1.0 / sigma // both branches tend to it; the next term is relatively (w/σ)²/3 < 1e-16
    } else if delta < 0.0 {
        w.atan2(sigma) / w
    } else {
        (w / sigma).atanh() / w
    };
    let mean = 0.5 * determinant.ln();
    let m = [half_difference, phi[1], phi[2], -half_difference];
    Ok([(mean + f * m[0]) / h, f * m[1] / h, f * m[2] / h, (mean + f * m[3]) / h])
}
