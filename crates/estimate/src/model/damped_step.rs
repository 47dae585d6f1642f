//! Damped steps of Levenberg–Marquardt, scaled by the diagonal (D. W. Marquardt 1963).

use nalgebra::{DMatrix, DVector};

/// Longest step of a coordinate of a parameter: a factor of e, or the range of the parameter.
const TRUST: f64 = 1.0;

/// Returns a damped step in which none of the first `axes` coordinates exceeds [`TRUST`]: a larger one is clipped, and the others are
/// solved for again. `None` if the matrix is not positive definite.
pub(super) fn damped_step(
    matrix: &DMatrix<f64>,
    gradient: &DVector<f64>,
    mut free: Vec<usize>,
    (damping, axes): (f64, usize),
) -> Option<DVector<f64>> {
    let mut clipped = DVector::zeros(gradient.len());
    loop {
        let left = gradient - matrix * &clipped;
        let step = solve(matrix, &left, &free, damping)?;
        let longest =
            free.iter().copied().filter(|n| *n < axes).max_by(|a, b| step[*a].abs().total_cmp(&step[*b].abs()));
        let Some(n) = longest.filter(|n| step[*n].abs() > TRUST) else { return Some(clipped + step) };
        clipped[n] = TRUST.copysign(step[n]);
        free.retain(|other| *other != n);
        if free.is_empty() {
            return Some(clipped);
        }
    }
}

/// Solves `(M + damping diag M) step = gradient` for the free unknowns; `None` if the matrix is not positive definite.
fn solve(matrix: &DMatrix<f64>, gradient: &DVector<f64>, free: &[usize], damping: f64) -> Option<DVector<f64>> {
    let largest = free.iter().map(|n| matrix[(*n, *n)]).fold(0.0, f64::max);
    let floor = (1e-14 * largest).max(f64::MIN_POSITIVE);
    let mut part = DMatrix::from_fn(free.len(), free.len(), |a, b| matrix[(free[a], free[b])]);
    for n in 0..free.len() {
        let diagonal = part[(n, n)].max(floor);
        part[(n, n)] = diagonal * (1.0 + damping);
    }
    let right = DVector::from_fn(free.len(), |n, _| gradient[free[n]]);
    let solution = part.cholesky()?.solve(&right);
    if !solution.iter().all(|value| value.is_finite()) {
        return None;
    }
    let mut step = DVector::zeros(gradient.len());
    free.iter().zip(solution.iter()).for_each(|(n, value)| step[*n] = *value);
    Some(step)
}
