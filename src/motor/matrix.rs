//! Real 2×2 matrices, row by row.

/// A matrix.
pub type Matrix2 = [f64; 4];

/// `a b`.
#[must_use]
pub fn product(a: Matrix2, b: Matrix2) -> Matrix2 {
    [a[0] * b[0] + a[1] * b[2], a[0] * b[1] + a[1] * b[3], a[2] * b[0] + a[3] * b[2], a[2] * b[1] + a[3] * b[3]]
}

/// `m⁻¹`; not finite where there is none.
#[must_use]
pub fn inverse([a, b, c, d]: Matrix2) -> Matrix2 {
    let determinant = a * d - b * c;
    [d, -b, -c, a].map(|v| v / determinant)
}

/// `m v`.
#[must_use]
pub fn times(m: Matrix2, v: [f64; 2]) -> [f64; 2] {
    [m[0] * v[0] + m[1] * v[1], m[2] * v[0] + m[3] * v[1]]
}
