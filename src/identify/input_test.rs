//! Whether residuals depend on the voltage: if they do, the model misses how the voltage acts.
//!
//! The residuals are regressed on the voltage at lags 0 to 20. Residuals that are correlated among themselves are
//! correlated with any voltage by chance (M. S. Bartlett 1935); so both are filtered first by what makes the residuals
//! white, an autoregression whose order is Schwarz's (G. E. P. Box, G. M. Jenkins 1970). With filtered residuals e and
//! lagged voltages X the statistic is `zᵀ(σ² XᵀX + H Hᵀ)⁻¹ z`, `z = Xᵀe`, which follows χ² with the rank of X where
//! nothing is missed. `H = Xᵀ D` is what the standard errors of the parameters explain: the columns of D are how the
//! output moves with each of their principal errors.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// The test of residuals against the voltage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InputTest {
    /// The statistic: about its degrees of freedom where the residuals do not depend on the voltage.
    pub statistic: f64,
    /// What it exceeds once in ten thousand times then.
    pub threshold: f64,
    /// How much of what is left the voltage explains \[%\], beyond what it explains by chance.
    pub explained_percent: f64,
    /// Whether the residuals do not depend on the voltage.
    pub is_independent: bool,
}

/// Lags of the voltage, from none.
const LAGS: usize = 20;
/// The highest order of the filter, and samples that each of it needs.
const ORDER_MAX: usize = 20;
const SAMPLES_PER_ORDER: usize = 20;
/// Samples that each lag needs.
const SAMPLES_PER_LAG: usize = 5;
/// Directions of the voltage with less than this part of the most are none.
const EIGENVALUE_MIN: f64 = 1e-10;
/// Quantile of the normal distribution that is exceeded once in ten thousand times.
const Z: f64 = 3.719;

/// Residuals with what may explain them; all of one length.
#[derive(Debug, Clone, Copy)]
pub struct Residuals<'a> {
    /// What was measured less what was simulated; any value where it does not count.
    pub values: &'a [f64],
    /// Voltage \[V\].
    pub voltage: &'a [f64],
    /// Which samples count; empty when all do.
    pub counting: &'a [bool],
    /// How the output moves with the errors of the parameters, one signal for each independent error.
    pub moves: &'a [Vec<f64>],
}

/// Tests residuals against the voltage; `None` for too few samples or a voltage that does not change.
#[must_use]
pub fn input_test(residuals: &Residuals<'_>) -> Option<InputTest> {
    let counts = |n: usize| residuals.counting.get(n).copied().unwrap_or(true);
    let blanked: Vec<f64> =
        residuals.values.iter().enumerate().map(|(n, e)| if counts(n) { *e } else { 0.0 }).collect();
    let filter = autoregression(&blanked);
    let reach = filter.len();
    let mut gap = 0;
    let rows: Vec<usize> = (0..blanked.len())
        .filter(|&n| {
            gap = if counts(n) { gap + 1 } else { 0 };
            n >= LAGS + reach && gap > reach
        })
        .collect();
    if rows.len() < SAMPLES_PER_LAG * (LAGS + 1) {
        return None;
    }
    let error = centred(&filtered(&blanked, &filter), &rows);
    let voltage = filtered(residuals.voltage, &filter);
    let middle = voltage.iter().sum::<f64>() / count(voltage.len());
    let voltage: Vec<f64> = voltage.iter().map(|v| v - middle).collect();
    let moves: Vec<Vec<f64>> =
        residuals.moves.iter().map(|signal| centred(&filtered(signal, &filter), &rows)).collect();
    let means: Vec<f64> = (0..=LAGS).map(|lag| sum(&rows, |n| voltage[n - lag]) / count(rows.len())).collect();
    let variance = dot(&error, &error) / count(rows.len());
    // What is centred needs no mean of the other taken from it.
    let with = |lag: usize, other: &[f64]| rows.iter().zip(other).map(|(n, e)| voltage[n - lag] * e).sum::<f64>();
    let z = DVector::from_fn(LAGS + 1, |a, _| with(a, &error));
    let gram = symmetric(LAGS + 1, |a, b| {
        sum(&rows, |n| voltage[n - a] * voltage[n - b]) - count(rows.len()) * means[a] * means[b]
    });
    let allowed = DMatrix::from_fn(LAGS + 1, moves.len(), |a, m| with(a, &moves[m]));
    let (statistic, rank) = quadratic(&(gram * variance + &allowed * allowed.transpose()), &z)?;
    let threshold = chi2(rank);
    let explained = 100.0 * ((statistic - count(rank)) / count(rows.len())).clamp(0.0, 1.0);
    let is_independent = statistic <= threshold;
    statistic.is_finite().then_some(InputTest { statistic, threshold, explained_percent: explained, is_independent })
}

/// `zᵀ M⁻¹ z` over the directions that `M` has, and how many these are; `None` without any.
fn quadratic(matrix: &DMatrix<f64>, z: &DVector<f64>) -> Option<(f64, usize)> {
    let scale = matrix.diagonal().map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 0.0 });
    let scaled = symmetric(matrix.nrows(), |a, b| matrix[(a, b)] * scale[a] * scale[b]);
    let z = z.component_mul(&scale);
    let SymmetricEigen { eigenvalues, eigenvectors } = SymmetricEigen::new(scaled);
    let least = EIGENVALUE_MIN * eigenvalues.max();
    let kept = || eigenvalues.iter().enumerate().filter(|(_, value)| **value > least);
    let sum = kept().map(|(n, value)| eigenvectors.column(n).dot(&z).powi(2) / value).sum();
    let rank = kept().count();
    (rank > 0).then_some((sum, rank))
}

/// The coefficients `a` of `e[n] ≈ Σ a[k] e[n−1−k]`, by Levinson and Durbin, their number by Schwarz's criterion.
fn autoregression(values: &[f64]) -> Vec<f64> {
    let size = values.len();
    let highest = ORDER_MAX.min(size / SAMPLES_PER_ORDER);
    let products: Vec<f64> = (0..=highest).map(|lag| dot(&values[..size - lag], &values[lag..])).collect();
    let (mut best, mut coefficients) = (Vec::new(), Vec::<f64>::new());
    let (mut left, mut least) = (1.0_f64, 0.0);
    for order in 1..=highest {
        let known: f64 = coefficients.iter().enumerate().map(|(k, a)| a * products[order - 1 - k]).sum();
        let reflection = (products[order] - known) / (left * products[0]);
        left *= 1.0 - reflection * reflection;
        if !(reflection.is_finite() && left > 0.0) {
            break;
        }
        let reversed: Vec<f64> = coefficients.iter().rev().copied().collect();
        coefficients.iter_mut().zip(reversed).for_each(|(a, b)| *a -= reflection * b);
        coefficients.push(reflection);
        let criterion = count(size) * left.ln() + count(order) * count(size).ln();
        if criterion < least {
            (least, best) = (criterion, coefficients.clone());
        }
    }
    best
}

/// What a signal is less what the autoregression expects of it; before the start it was as at the start.
fn filtered(signal: &[f64], filter: &[f64]) -> Vec<f64> {
    let expected =
        |n: usize| -> f64 { filter.iter().enumerate().map(|(k, a)| a * signal[n.saturating_sub(k + 1)]).sum() };
    (0..signal.len()).map(|n| signal[n] - expected(n)).collect()
}

/// The rows of a signal less their mean.
fn centred(signal: &[f64], rows: &[usize]) -> Vec<f64> {
    let mean = sum(rows, |n| signal[n]) / count(rows.len());
    rows.iter().map(|n| signal[*n] - mean).collect()
}

fn sum(rows: &[usize], term: impl Fn(usize) -> f64) -> f64 {
    rows.iter().map(|n| term(*n)).sum()
}

/// A symmetric matrix by its lower half.
fn symmetric(size: usize, entry: impl Fn(usize, usize) -> f64) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(size, size);
    for a in 0..size {
        for b in 0..=a {
            matrix[(a, b)] = entry(a, b);
            matrix[(b, a)] = matrix[(a, b)];
        }
    }
    matrix
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// What χ² with so many degrees of freedom exceeds once in ten thousand times (E. B. Wilson, M. M. Hilferty 1931); that
/// is too high by 7 % for one degree, 2 % for five, 1 % for ten and more.
pub(super) fn chi2(freedom: usize) -> f64 {
    let part = 2.0 / (9.0 * count(freedom));
    count(freedom) * (1.0 - part + Z * part.sqrt()).powi(3)
}

#[expect(clippy::cast_precision_loss, reason = "counts of samples are far below 2^53")]
pub(super) fn count(n: usize) -> f64 {
    n as f64
}
