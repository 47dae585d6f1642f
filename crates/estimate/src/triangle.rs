//! Streaming least squares: the triangular factor R of a QR factorization of rows that arrive in blocks.
//!
//! Each block of rows is folded into R by Householder reflections (G. H. Golub, C. F. Van Loan, Matrix Computations, 5.2;
//! T. Elden, H. Park 1994 for the streaming form). Memory does not grow with the number of rows.
//!
//! Cost: two passes over two columns for each pair of columns.

use motorfit_motor::multiply_add;
use multiversion::multiversion;
use multiversion::target::target_cfg_f;

/// Largest number of columns.
pub(super) const COLUMNS_MAX: usize = 13;
/// Rows folded in at once: with eight columns a block fills half of a first-level cache.
pub(super) const BLOCK: usize = 256;

/// Upper triangular matrix, row-major.
pub(super) type Upper = [[f64; COLUMNS_MAX]; COLUMNS_MAX];

/// The triangular factor R of the rows added.
pub(super) struct Triangle {
    /// For each pivot column, the end of the columns that its reflection is applied to (exclusive).
    ends: Vec<usize>,
    r: Upper,
    /// Buffer of rows to be folded in, stored by columns.
    block: Vec<[f64; BLOCK]>,
}

impl Triangle {
    /// Makes an empty factor in which every column is a regressor of all later columns.
    pub(super) fn new(columns: usize) -> Self {
        Self::of_ends(vec![columns; columns])
    }

    /// Makes an empty factor of `common` columns, which are regressors of all others, followed by two groups of `own`
    /// columns that are independent of each other: two factorizations that share their leading columns.
    pub(super) fn of_two(common: usize, own: usize) -> Self {
        let columns = common + 2 * own;
        Self::of_ends(
            (0..columns).map(|n| if (common..common + own).contains(&n) { common + own } else { columns }).collect(),
        )
    }

    fn of_ends(ends: Vec<usize>) -> Self {
        let block = vec![[0.0; BLOCK]; ends.len()];
        Self { ends, r: [[0.0; COLUMNS_MAX]; COLUMNS_MAX], block }
    }

    /// Adds rows, given as slices of their columns.
    pub(super) fn add(&mut self, columns: &[&[f64]]) {
        let rows = columns.first().map_or(0, |column| column.len());
        for start in (0..rows).step_by(BLOCK) {
            let count = BLOCK.min(rows - start);
            for (block, column) in self.block.iter_mut().zip(columns) {
                block[..count].copy_from_slice(&column[start..start + count]);
                block[count..].fill(0.0);
            }
            fold_in(self);
        }
    }

    /// Returns R and the Euclidean norm of each column, which reflections preserve.
    pub(super) fn finish(self) -> (Upper, [f64; COLUMNS_MAX]) {
        let norm = |column: usize| self.r.iter().map(|row| row[column] * row[column]).sum::<f64>().sqrt();
        (self.r, std::array::from_fn(norm))
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl+avx2+fma", "x86_64+avx2+fma"))]
fn fold_in(triangle: &mut Triangle) {
    fold::<{ target_cfg_f!(target_feature = "fma") }>(triangle);
}

/// Folds the buffered block into R.
#[inline(always)]
fn fold<const FMA: bool>(Triangle { ends, r, block }: &mut Triangle) {
    for (pivot, &end) in ends.iter().enumerate() {
        let (before, rest) = block.split_at_mut(pivot + 1);
        let own = &before[pivot];
        let below = dot::<FMA>(own, own);
        if below == 0.0 {
            continue;
        }
        let head = r[pivot][pivot];
        let norm = (head * head + below).sqrt();
        let reflected = if head > 0.0 { -norm } else { norm };
        // v = (head − reflected, own); H = I − 2 v vᵀ / vᵀv.
        let v0 = head - reflected;
        let scale = 2.0 / (v0 * v0 + below);
        r[pivot][pivot] = reflected;
        for (value, other) in r[pivot][pivot + 1..end].iter_mut().zip(rest) {
            let along = scale * (v0 * *value + dot::<FMA>(own, other));
            *value -= along * v0;
            for (value, own) in other.iter_mut().zip(own) {
                *value = multiply_add::<FMA>(-along, *own, *value);
            }
        }
    }
}

/// Returns the dot product, summed in sixteen lanes so that it vectorizes and additions do not depend on each other.
#[inline(always)]
pub(super) fn dot<const FMA: bool>(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<16>(), b.as_chunks::<16>());
    let mut sums = [0.0; 16];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..16 {
            sums[lane] = multiply_add::<FMA>(a[lane], b[lane], sums[lane]);
        }
    }
    sums.iter().sum::<f64>() + a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum::<f64>()
}

/// Solves `R x = right` for the leading `size` columns of a triangle; `None` if it is singular.
pub(super) fn solve<const N: usize>(r: &[[f64; N]; N], size: usize, right: &[f64]) -> Option<Vec<f64>> {
    let mut x = vec![0.0; size];
    for row in (0..size).rev() {
        let known: f64 = (row + 1..size).map(|column| r[row][column] * x[column]).sum();
        x[row] = (right[row] - known) / r[row][row];
    }
    x.iter().all(|v| v.is_finite()).then_some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ill_conditioned_fit_is_solved() {
        // 1000 rows of a nearly rank-deficient system with a known solution (condition 1e8): normal equations would lose
        // it.
        let truth = [2.0, -3.0, 0.5];
        let mut columns = [const { Vec::new() }; 4];
        for n in 0..1000_u32 {
            let t = f64::from(n) / 1000.0;
            let row = [1.0, t, t + 1e-8 * (37.0 * t).sin()];
            let y: f64 = row.iter().zip(truth).map(|(a, x)| a * x).sum();
            columns.iter_mut().zip(row.into_iter().chain([y])).for_each(|(column, value)| column.push(value));
        }
        let mut triangle = Triangle::new(4);
        triangle.add(&columns.each_ref().map(Vec::as_slice));
        let (r, norms) = triangle.finish();
        let right = [r[0][3], r[1][3], r[2][3]];
        let found = solve(&r, 3, &right).unwrap();
        for (found, truth) in found.iter().zip(truth) {
            assert!((found - truth).abs() < 1e-6, "{found} {truth}");
        }
        assert!(r[3][3].abs() < 1e-13 * norms[3]);
    }
}
