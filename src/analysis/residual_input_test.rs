//! Whether residuals depend on the voltage: if they do, the model misses how the voltage acts.
//!
//! The residuals are regressed on the voltage: as it was up to 20 samples before, and on its means over ever longer
//! stretches before that. Residuals that are correlated among themselves are correlated with any voltage by chance
//! (M. S. Bartlett 1935); so all is filtered first by what makes white what the voltage does not explain, an
//! autoregression whose order is Schwarz's (G. E. P. Box, G. M. Jenkins 1970; D. Cochrane, G. H. Orcutt 1949). With
//! filtered residuals e and columns X the statistic is `zᵀ(σ² XᵀX + H Hᵀ)⁻¹ z`, `z = Xᵀe`, which follows χ² with the rank
//! of X where nothing is missed. `H = Xᵀ D` is what the standard errors of the parameters explain: the columns of D are
//! how the output moves with each of their principal errors.

use crate::numeric::{chi_square_limit, count, dot, sum};
use multiversion::multiversion;
use nalgebra::{DMatrix, DVector, Dyn, SymmetricEigen};

/// The test of residuals against the voltage.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct ResidualInputTest {
    /// Whether the residuals do not depend on the voltage.
    #[serde(rename = "independent")]
    pub is_independent: bool,
    /// The statistic: about its degrees of freedom where the residuals do not depend on the voltage.
    pub statistic: f64,
    /// What it exceeds once in ten thousand times then.
    pub threshold: f64,
    /// How much of what is left the voltage explains \[%\], beyond what it explains by chance.
    pub explained_percent: f64,
}

/// Lags of the voltage, from none.
const LAGS: usize = 20;
/// Its means begin there and reach a quarter further each, to this part of the recording and so many samples at most.
const PART_MAX: usize = 5;
const LAG_MAX: usize = 1000;
/// The highest order of the filter, and samples that each of it needs.
const ORDER_MAX: usize = 20;
const SAMPLES_PER_ORDER: usize = 20;
/// Independent samples that each column needs, lest it be fitted to noise.
const SAMPLES_PER_COLUMN: f64 = 5.0;
/// Samples that are looked at: more show no more that matters.
const SAMPLES_MAX: usize = 50_000;
/// Directions of the voltage with less than this part of the most are none.
const EIGENVALUE_MIN: f64 = 1e-10;

/// Residuals with what may explain them; all of one length.
#[derive(Debug, Clone, Copy)]
pub struct Residuals<'a> {
    /// What was measured less what was simulated; any value where it does not count.
    pub values: &'a [f64],
    /// The voltage.
    pub regressors: &'a Regressors,
    /// Which samples count; empty when all do.
    pub counting: &'a [bool],
    /// How the output moves with the errors of the parameters, one signal for each independent error.
    pub sensitivities: &'a [Vec<f64>],
}

/// A voltage \[V\] as residuals of both channels are regressed on it.
#[derive(Debug, Clone)]
pub struct Regressors {
    /// From the first sample on.
    voltage: Vec<f64>,
    /// Its columns, each less its mean.
    columns: Vec<Vec<f64>>,
    normal: Normal,
}

impl Regressors {
    /// Of the voltage of a recording, or of the current where that is the input.
    #[must_use]
    pub fn new(voltage: &[f64]) -> Self {
        let size = voltage.len().min(SAMPLES_MAX);
        let voltage: Vec<f64> = voltage[..size].iter().map(|v| v - voltage[0]).collect();
        let all: Vec<usize> = (0..size).collect();
        let columns: Vec<Vec<f64>> = columns(&voltage).iter().map(|column| centred(column, &all)).collect();
        Self { voltage, normal: Normal::new(&products(&columns)), columns }
    }
}

/// Tests residuals against the voltage; `None` for too few samples, signals of different lengths, a voltage that does not
/// change, or residuals so correlated that nothing shows whether the voltage or noise made them.
#[must_use]
pub fn residual_input_test(residuals: &Residuals<'_>) -> Option<ResidualInputTest> {
    let Regressors { voltage, columns: unfiltered, .. } = residuals.regressors;
    let size = residuals.values.len().min(SAMPLES_MAX);
    if size < 2 || voltage.len() != size || residuals.sensitivities.iter().any(|signal| signal.len() < size) {
        return None;
    }
    let counts = |n: usize| residuals.counting.get(n).copied().unwrap_or(true);
    let values: Vec<f64> = (0..size).map(|n| if counts(n) { residuals.values[n] } else { 0.0 }).collect();
    let Noise { filter, is_told } = noise(&values, residuals.regressors);
    let reach = filter.len();
    let mut run = 0;
    let rows: Vec<usize> = (0..size)
        .filter(|&n| {
            run = if counts(n) { run + 1 } else { 0 };
            n >= LAGS + reach && run > reach
        })
        .collect();
    if count(rows.len()) < SAMPLES_PER_COLUMN * count(unfiltered.len()) {
        return None;
    }
    let ready = |signal: &[f64]| centred(&filtered(&signal[..size], &filter), &rows);
    let error = ready(&values);
    // The columns of what is filtered are the filtered columns.
    let voltage: Vec<Vec<f64>> =
        columns(&filtered(&voltage[..size], &filter)).iter().map(|column| centred(column, &rows)).collect();
    let sensitivities: Vec<Vec<f64>> = residuals.sensitivities.iter().map(|signal| ready(signal)).collect();
    let variance = dot(&error, &error) / count(rows.len());
    let allowed = DMatrix::from_fn(voltage.len(), sensitivities.len(), |a, m| dot(&voltage[a], &sensitivities[m]));
    let matrix = products(&voltage) * variance + &allowed * allowed.transpose();
    let z = against(&voltage, &error);
    let (solution, rank) = Normal::new(&matrix).solve(&z)?;
    let (statistic, threshold) = (z.dot(&solution), chi_square_limit(rank));
    let explained = 100.0 * ((statistic - count(rank)) / count(rows.len())).clamp(0.0, 1.0);
    let is_independent = statistic <= threshold;
    (statistic.is_finite() && (is_told || !is_independent)).then_some(ResidualInputTest {
        statistic,
        threshold,
        explained_percent: explained,
        is_independent,
    })
}

/// A signal at each lag, and its means over longer and longer stretches before; before the start it was zero.
fn columns(signal: &[f64]) -> Vec<Vec<f64>> {
    let size = signal.len();
    let lag = |lag: usize| {
        let mut column = vec![0.0; lag.min(size)];
        column.extend_from_slice(&signal[..size - column.len()]);
        column
    };
    let mut columns: Vec<Vec<f64>> = (0..=LAGS).map(lag).collect();
    // sums[n] is that of the first n.
    let mut sums = vec![0.0];
    for value in signal {
        sums.push(sums[sums.len() - 1] + value);
    }
    let mut from = LAGS + 1;
    while from * 5 / 4 <= LAG_MAX.min(size / PART_MAX) {
        let to = from * 5 / 4;
        let early = sums[1..=to - from].iter().map(|sum| sum / count(to - from));
        let late = sums[to - from + 1..].iter().zip(&sums[1..]);
        let mut column = vec![0.0; from];
        column.extend(early.chain(late.map(|(sum, before)| (sum - before) / count(to - from))).take(size - from));
        columns.push(column);
        from = to;
    }
    columns
}

/// What makes the noise white.
struct Noise {
    filter: Vec<f64>,
    /// Whether it was told apart from what the voltage explains: where not, it may take that for noise.
    is_told: bool,
}

/// The autoregression of the noise: of what the columns do not explain, or, where independent samples are so few that the
/// columns would explain noise, of all.
fn noise(values: &[f64], regressors: &Regressors) -> Noise {
    let Regressors { columns, normal, .. } = regressors;
    let all: Vec<usize> = (0..values.len()).collect();
    let mut rest = centred(values, &all);
    let Some((solution, _)) = normal.solve(&against(columns, &rest)) else {
        return Noise { filter: autoregression(values), is_told: false };
    };
    for (column, factor) in columns.iter().zip(solution.iter()) {
        rest.iter_mut().zip(column).for_each(|(rest, x)| *rest -= factor * x);
    }
    let lag1 = (dot(&rest[1..], &rest) / dot(&rest, &rest)).clamp(0.0, 1.0);
    let independent = count(rest.len()) * (1.0 - lag1) / (1.0 + lag1);
    let enough = independent >= SAMPLES_PER_COLUMN * count(columns.len());
    Noise { filter: autoregression(if enough { &rest } else { values }), is_told: enough }
}

/// A symmetric matrix, to be solved over the directions that it has.
#[derive(Debug, Clone)]
struct Normal {
    /// What makes its diagonal ones.
    scale: DVector<f64>,
    /// Of the scaled matrix.
    eigen: SymmetricEigen<f64, Dyn>,
}

impl Normal {
    fn new(matrix: &DMatrix<f64>) -> Self {
        let scale = matrix.diagonal().map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 0.0 });
        let size = scale.len();
        let scaled = DMatrix::from_fn(size, size, |a, b| matrix[(a, b)] * scale[a] * scale[b]);
        Self { eigen: SymmetricEigen::new(scaled), scale }
    }

    /// `M⁻¹ z` over the directions that `M` has, and how many these are; `None` without any.
    fn solve(&self, z: &DVector<f64>) -> Option<(DVector<f64>, usize)> {
        let SymmetricEigen { eigenvalues, eigenvectors } = &self.eigen;
        let z = z.component_mul(&self.scale);
        let least = EIGENVALUE_MIN * eigenvalues.max();
        let (mut solution, mut rank) = (DVector::zeros(z.len()), 0);
        for (direction, value) in eigenvectors.column_iter().zip(eigenvalues.iter()).filter(|(_, v)| **v > least) {
            solution += direction * (direction.dot(&z) / value);
            rank += 1;
        }
        (rank > 0).then(|| (solution.component_mul(&self.scale), rank))
    }
}

/// The coefficients `a` of `e[n] ≈ Σ a[k] e[n−1−k]`, by J. P. Burg (1967), which is exact also for what dies away slowly,
/// their number by Schwarz's criterion.
fn autoregression(values: &[f64]) -> Vec<f64> {
    let size = values.len();
    let (mut forward, mut backward) = (values.to_vec(), values.to_vec());
    let (mut best, mut coefficients) = (Vec::new(), Vec::<f64>::new());
    let (mut left, mut least) = (1.0_f64, 0.0);
    for order in 1..=ORDER_MAX.min(size / SAMPLES_PER_ORDER) {
        let (ahead, behind) = (&forward[order..], &backward[order - 1..size - 1]);
        let reflection = 2.0 * dot(ahead, behind) / (dot(ahead, ahead) + dot(behind, behind));
        left *= 1.0 - reflection * reflection;
        if !(reflection.is_finite() && left > 0.0) {
            break;
        }
        for n in (order..size).rev() {
            let (ahead, behind) = (forward[n], backward[n - 1]);
            (forward[n], backward[n]) = (ahead - reflection * behind, behind - reflection * ahead);
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
    let mut values: Vec<f64> = match (rows.first(), rows.last()) {
        // Without a gap, as nearly always.
        (Some(&first), Some(&last)) if last - first + 1 == rows.len() => signal[first..=last].to_vec(),
        _ => rows.iter().map(|n| signal[*n]).collect(),
    };
    let mean = sum(&values) / count(values.len());
    values.iter_mut().for_each(|value| *value -= mean);
    values
}

/// `XᵀX`: a multiplication and an addition for each pair of columns and row.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl+avx2+fma", "x86_64+avx2+fma"))]
fn products(columns: &[Vec<f64>]) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(columns.len(), columns.len());
    for (a, column) in columns.iter().enumerate() {
        for (b, other) in columns[..=a].iter().enumerate() {
            matrix[(a, b)] = dot(column, other);
            matrix[(b, a)] = matrix[(a, b)];
        }
    }
    matrix
}

/// `Xᵀe`.
fn against(columns: &[Vec<f64>], error: &[f64]) -> DVector<f64> {
    DVector::from_fn(columns.len(), |a, _| dot(&columns[a], error))
}
