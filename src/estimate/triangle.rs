//! Least squares by orthogonal rotations, rows coming in as they are made: the triangle R of a QR factorization.
//!
//! Blocks of rows are folded into the triangle by Householder reflections (G. H. Golub, C. F. Van Loan, Matrix
//! Computations, 5.2; T. Elden, H. Park 1994 for the streaming form). Memory does not grow with the rows.

/// Columns at most.
pub(super) const COLUMNS_MAX: usize = 12;
/// Rows folded in at once.
const BLOCK: usize = 64;

/// The triangle of the rows that were pushed so far.
pub(super) struct Triangle {
    columns: usize,
    /// Upper triangle, row-major.
    r: [[f64; COLUMNS_MAX]; COLUMNS_MAX],
    /// Rows that wait, column by column.
    block: Vec<[f64; BLOCK]>,
    waiting: usize,
    /// Sums of squares of each column.
    squares: [f64; COLUMNS_MAX],
}

impl Triangle {
    pub(super) fn new(columns: usize) -> Self {
        let r = [[0.0; COLUMNS_MAX]; COLUMNS_MAX];
        Self { columns, r, block: vec![[0.0; BLOCK]; columns], waiting: 0, squares: [0.0; COLUMNS_MAX] }
    }

    #[inline]
    pub(super) fn push(&mut self, row: &[f64]) {
        for (column, value) in self.block.iter_mut().zip(row) {
            column[self.waiting] = *value;
        }
        self.waiting += 1;
        if self.waiting == BLOCK {
            self.fold();
        }
    }

    /// Folds the waiting rows in.
    fn fold(&mut self) {
        for column in &mut self.block {
            column[self.waiting..].fill(0.0);
        }
        for (n, column) in self.block.iter().enumerate() {
            self.squares[n] += dot(column, column);
        }
        for pivot in 0..self.columns {
            let (before, rest) = self.block.split_at_mut(pivot + 1);
            let own = &before[pivot];
            let below = dot(own, own);
            if below == 0.0 {
                continue;
            }
            let head = self.r[pivot][pivot];
            let norm = (head * head + below).sqrt();
            let turned = if head > 0.0 { -norm } else { norm };
            // v = (head − turned, own); H = I − 2 v vᵀ / vᵀv.
            let v0 = head - turned;
            let scale = 2.0 / (v0 * v0 + below);
            self.r[pivot][pivot] = turned;
            for (column, other) in (pivot + 1..self.columns).zip(rest) {
                let along = scale * (v0 * self.r[pivot][column] + dot(own, other));
                self.r[pivot][column] -= along * v0;
                for (value, own) in other.iter_mut().zip(own) {
                    *value -= along * own;
                }
            }
        }
        self.waiting = 0;
    }

    /// R and the norm of each column, after the last row.
    pub(super) fn finish(mut self) -> ([[f64; COLUMNS_MAX]; COLUMNS_MAX], [f64; COLUMNS_MAX]) {
        self.fold();
        (self.r, self.squares.map(f64::sqrt))
    }
}

/// Sums in eight lanes, so that it vectorizes.
#[inline(always)]
fn dot(a: &[f64; BLOCK], b: &[f64; BLOCK]) -> f64 {
    let mut sums = [0.0; 8];
    for (a, b) in a.chunks_exact(8).zip(b.chunks_exact(8)) {
        for lane in 0..8 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    sums.iter().sum()
}

/// Solves `R x = right` for the leading `size` columns of a triangle; `None` where it is singular.
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
    fn it_solves_an_ill_conditioned_fit() {
        // 1000 rows of a nearly dependent system with a known solution: normal equations would lose it (condition 1e8).
        let truth = [2.0, -3.0, 0.5];
        let mut triangle = Triangle::new(4);
        for n in 0..1000_u32 {
            let t = f64::from(n) / 1000.0;
            let row = [1.0, t, t + 1e-8 * (37.0 * t).sin()];
            let y: f64 = row.iter().zip(truth).map(|(a, x)| a * x).sum();
            triangle.push(&[row[0], row[1], row[2], y]);
        }
        let (r, norms) = triangle.finish();
        let right = [r[0][3], r[1][3], r[2][3]];
        let found = solve(&r, 3, &right).unwrap();
        for (found, truth) in found.iter().zip(truth) {
            assert!((found - truth).abs() < 1e-6, "{found} {truth}");
        }
        assert!(r[3][3].abs() < 1e-13 * norms[3]);
    }
}
