//! Linear least squares with few regressors, by the normal equations and Cholesky decomposition.

/// Largest number of regressors.
pub(super) const WIDTH: usize = 8;

/// Regularization of each regressor relative to its sum of squares, for regressors that are linearly dependent.
const DAMPING: f64 = 1e-9;

/// A row of regressors; unused ones are 0.
pub(super) type Row = [f64; WIDTH];

/// Normal equations: the lower triangle of XᵀX, and Xᵀy.
#[derive(Debug, Clone, Default)]
pub(super) struct Sums {
    products: [[f64; WIDTH]; WIDTH],
    right: Row,
}

impl Sums {
    /// Adds an equation: a row of regressors and the response.
    pub(super) fn add(&mut self, row: &Row, value: f64) {
        // Rows away from edges have few nonzero entries.
        for (k, of) in row.iter().enumerate().filter(|(_, of)| **of != 0.0) {
            self.products[k][..=k].iter_mut().zip(row).for_each(|(sum, other)| *sum += of * other);
            self.right[k] += of * value;
        }
    }

    /// Returns the least-squares solution; coefficients of regressors that are always 0 are 0.
    pub(super) fn solve(&self) -> Solution {
        let mut lower = [[0.0; WIDTH]; WIDTH];
        for k in 0..WIDTH {
            for j in 0..=k {
                let known: f64 = (0..j).map(|m| lower[k][m] * lower[j][m]).sum();
                let rest = self.products[k][j] - known;
                lower[k][j] = if j < k {
                    if lower[j][j] > 0.0 { rest / lower[j][j] } else { 0.0 }
                } else {
                    let own = self.products[k][k];
                    (rest + DAMPING * own).max(0.1 * DAMPING * own).sqrt()
                };
            }
        }
        let mut coefficients = forward(&lower, &self.right);
        for k in (0..WIDTH).rev() {
            let known: f64 = (k + 1..WIDTH).map(|m| lower[m][k] * coefficients[m]).sum();
            coefficients[k] = if lower[k][k] > 0.0 { (coefficients[k] - known) / lower[k][k] } else { 0.0 };
        }
        Solution { coefficients, lower }
    }
}

/// Solves a lower triangular system by forward substitution.
fn forward(lower: &[Row; WIDTH], right: &Row) -> Row {
    let mut found = *right;
    for k in 0..WIDTH {
        let known: f64 = (0..k).map(|m| lower[k][m] * found[m]).sum();
        found[k] = if lower[k][k] > 0.0 { (found[k] - known) / lower[k][k] } else { 0.0 };
    }
    found
}

/// Least-squares solution: the coefficients and the Cholesky factor.
#[derive(Debug, Clone, Default)]
pub(super) struct Solution {
    pub coefficients: Row,
    lower: [Row; WIDTH],
}

impl Solution {
    /// Returns the prediction for a row of regressors.
    pub(super) fn predicted(&self, row: &Row) -> f64 {
        self.coefficients.iter().zip(row).map(|(c, x)| c * x).sum()
    }

    /// Returns the leverage `xᵀ (XᵀX)⁻¹ x` of a row.
    pub(super) fn leverage(&self, row: &Row) -> f64 {
        forward(&self.lower, row).iter().map(|y| y * y).sum()
    }
}
