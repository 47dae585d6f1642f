//! Damped steps of Levenberg–Marquardt, scaled by the diagonal (D. W. Marquardt 1963).

use nalgebra::{DMatrix, DVector};

/// Longest step of the coordinate of a parameter: a factor of e, or the range of the parameter.
const TRUST: f64 = 1.0;

/// Returns a step over the unknowns `free` in which none of the first `axes` coordinates exceeds [`TRUST`]: a larger one is clipped,
/// and the others are solved for again. Scaling the complete step would hardly move it when one parameter has little influence.
pub(super) fn trusted_step(
    matrix: &DMatrix<f64>,
    gradient: &DVector<f64>,
    mut free: Vec<usize>,
    (damping, axes): (f64, usize),
) -> Option<DVector<f64>> {
    let mut edge = DVector::zeros(gradient.len());
    loop {
        let left = gradient - matrix * &edge;
        let step = damped_step(matrix, &left, &free, damping)?;
        let longest =
            free.iter().copied().filter(|n| *n < axes).max_by(|a, b| step[*a].abs().total_cmp(&step[*b].abs()));
        match longest.filter(|n| step[*n].abs() > TRUST) {
            Some(n) => edge[n] = TRUST.copysign(step[n]),
            None => return Some(edge + step),
        }
        free.retain(|n| edge[*n] == 0.0);
    }
}

/// Returns `(JᵀJ + λ diag JᵀJ)⁻¹ Jᵀe` over the unknowns that may move, zero for the others; `None` if it has no solution.
fn damped_step(matrix: &DMatrix<f64>, gradient: &DVector<f64>, free: &[usize], damping: f64) -> Option<DVector<f64>> {
    // Scaling by the diagonal makes the step independent of units.
    let scale: Vec<f64> = free.iter().map(|&n| matrix[(n, n)].sqrt()).collect();
    let divisor = |n: usize| if scale[n] > 0.0 { scale[n] } else { 1.0 };
    let system = DMatrix::from_fn(free.len(), free.len(), |a, b| {
        let own = if a == b { damping } else { 0.0 };
        matrix[(free[a], free[b])] / (divisor(a) * divisor(b)) + own
    });
    let right = DVector::from_fn(free.len(), |a, _| gradient[free[a]] / divisor(a));
    let solved = system.cholesky()?.solve(&right);
    let mut step = DVector::zeros(matrix.nrows());
    for (n, &unknown) in free.iter().enumerate() {
        step[unknown] = solved[n] / divisor(n);
    }
    step.iter().all(|v| v.is_finite()).then_some(step)
}
