//! Tests whether residuals depend on the voltage: if they do, the model misses how the voltage acts.
//!
//! The residuals are regressed on the voltage: as it was up to 20 samples before, and on its means over ever longer
//! stretches before that. Residuals that are correlated among themselves are correlated with any voltage by chance
//! (M. S. Bartlett 1935); so all is filtered first by what makes white what the voltage does not explain, an
//! autoregression whose order is Schwarz's (G. E. P. Box, G. M. Jenkins 1970; D. Cochrane, G. H. Orcutt 1949). With
//! filtered residuals e and columns X the statistic is `zᵀ(σ² XᵀX + H Hᵀ)⁻¹ z`, `z = Xᵀe`, which follows χ² with the rank
//! of X where nothing is missed. `H = Xᵀ D` is what the standard errors of the parameters explain: the columns of D are
//! how the output moves with each of their principal errors.

use crate::estimate::products_about_means;
use crate::numeric::{autoregression, chi_square_limit, count, dot, running_sums, sum};
use multiversion::multiversion;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// The test of residuals against the voltage.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct ResidualInputTest {
    /// True if the residuals do not depend on the voltage.
    #[serde(rename = "independent")]
    pub is_independent: bool,
    /// The statistic: about its degrees of freedom where the residuals do not depend on the voltage.
    pub statistic: f64,
    /// The value that it exceeds with a probability of one in ten thousand.
    pub threshold: f64,
    /// The part of the residuals that the voltage explains \[%\], beyond the part explained by chance.
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
    /// Measured less simulated values; any value where a sample does not count.
    pub values: &'a [f64],
    /// The voltage.
    pub regressors: &'a Regressors,
    /// Which samples count; empty when all do.
    pub counting: &'a [bool],
    /// Output sensitivities to the errors of the parameters, one signal for each independent error.
    pub sensitivities: &'a [Vec<f64>],
}

/// A voltage \[V\] as residuals of both channels are regressed on it.
#[derive(Debug, Clone)]
pub struct Regressors {
    /// From the first sample on.
    voltage: Vec<f64>,
    columns: Columns,
    /// Of the columns about their means.
    normal: Normal,
}

impl Regressors {
    /// Of the voltage of a recording, or of the current where that is the input.
    #[must_use]
    pub fn new(voltage: &[f64]) -> Self {
        let size = voltage.len().min(SAMPLES_MAX);
        let voltage: Vec<f64> = voltage[..size].iter().map(|v| v - voltage[0]).collect();
        let columns = Columns::new(&voltage);
        let all: Vec<usize> = (0..size).collect();
        Self { voltage, normal: Normal::new(&products_about_means(&columns.all(), &all)), columns }
    }
}

/// Tests residuals against the voltage; `None` for too few samples, signals of different lengths, a voltage that does not
/// change, or residuals so correlated that nothing shows whether the voltage or noise made them.
#[must_use]
pub fn residual_input_test(residuals: &Residuals<'_>) -> Option<ResidualInputTest> {
    let Regressors { voltage, .. } = residuals.regressors;
    let size = residuals.values.len().min(SAMPLES_MAX);
    if size < 2 || voltage.len() != size || residuals.sensitivities.iter().any(|signal| signal.len() < size) {
        return None;
    }
    let counts = |n: usize| residuals.counting.get(n).copied().unwrap_or(true);
    let values: Vec<f64> = (0..size).map(|n| if counts(n) { residuals.values[n] } else { 0.0 }).collect();
    let Noise { filter, is_told } = noise(&values, residuals.regressors);
    let reach = filter.len();
    let mut run = 0;
    let rows = (0..size).filter(|&n| {
        run = if counts(n) { run + 1 } else { 0 };
        n >= LAGS + reach && run > reach
    });
    let rows: Vec<usize> = rows.collect();
    let regressors = residuals.regressors.columns.all().len();
    if count(rows.len()) < SAMPLES_PER_COLUMN * count(regressors) {
        return None;
    }
    // The columns of what is filtered are the filtered columns.
    let columns = Columns::new(&filtered(voltage, &filter));
    let mut all = columns.all();
    let explained = std::iter::once(values.as_slice()).chain(residuals.sensitivities.iter().map(|s| &s[..size]));
    let explained: Vec<Vec<f64>> = explained.map(|signal| centred(filtered(signal, &filter))).collect();
    all.extend(explained.iter().map(Vec::as_slice));
    let products = products_about_means(&all, &rows);
    let variance = products[(regressors, regressors)] / count(rows.len());
    let allowed = products.view((0, regressors + 1), (regressors, explained.len() - 1));
    let matrix = products.view((0, 0), (regressors, regressors)) * variance + allowed * allowed.transpose();
    let z = products.view((0, regressors), (regressors, 1)).column(0).into_owned();
    let (solution, rank) = Normal::new(&matrix).solve(&z)?;
    let (statistic, threshold) = (z.dot(&solution), chi_square_limit(rank));
    let explained_percent = 100.0 * ((statistic - count(rank)) / count(rows.len())).clamp(0.0, 1.0);
    let is_independent = statistic <= threshold;
    let found = ResidualInputTest { statistic, threshold, explained_percent, is_independent };
    (statistic.is_finite() && (is_told || !is_independent)).then_some(found)
}

/// A signal at each lag, and its means over longer and longer windows before; before the start it was zero.
#[derive(Debug, Clone)]
struct Columns {
    size: usize,
    /// The signal from its longest lag before the start on.
    signal: Vec<f64>,
    /// Its means over each window.
    means: Vec<Vec<f64>>,
}

impl Columns {
    fn new(signal: &[f64]) -> Self {
        let size = signal.len();
        // About their mean, so that sums lose no digits.
        let mean = sum(signal) / count(size);
        let early = std::iter::repeat_n(&0.0, LAG_MAX);
        let signal: Vec<f64> = early.chain(signal).map(|value| value - mean).collect();
        let sums = running_sums(std::iter::once(0.0).chain(signal.iter().copied()));
        let longest = LAG_MAX.min(size / PART_MAX);
        let edges = std::iter::successors(Some(LAGS + 1), |edge| Some(edge * 5 / 4));
        let edges: Vec<usize> = edges.take_while(|edge| *edge == LAGS + 1 || *edge <= longest).collect();
        let mean = |window: &[usize]| {
            let at = |lag: usize| &sums[LAG_MAX + 1 - lag..][..size];
            let share = 1.0 / count(window[1] - window[0]);
            at(window[0]).iter().zip(at(window[1])).map(|(to, from)| (to - from) * share).collect()
        };
        Self { size, means: edges.windows(2).map(mean).collect(), signal }
    }

    /// Every column from the first sample on.
    fn all(&self) -> Vec<&[f64]> {
        let lags = (0..=LAGS).map(|lag| &self.signal[LAG_MAX - lag..][..self.size]);
        lags.chain(self.means.iter().map(Vec::as_slice)).collect()
    }
}

/// The filter that makes the noise white.
struct Noise {
    filter: Vec<f64>,
    /// True if it was told apart from what the voltage explains: where not, it may take that for noise.
    is_told: bool,
}

/// The autoregression of the noise: of what the columns do not explain, or, where independent samples are so few that the
/// columns would explain noise, of all.
fn noise(values: &[f64], regressors: &Regressors) -> Noise {
    let Regressors { columns, normal, .. } = regressors;
    let columns = columns.all();
    let mut rest = centred(values.to_vec());
    let z = DVector::from_iterator(columns.len(), columns.iter().map(|column| dot(column, &rest)));
    let Some((solution, _)) = normal.solve(&z) else {
        return Noise { filter: schwarz(values), is_told: false };
    };
    for (column, factor) in columns.iter().zip(solution.iter()) {
        rest.iter_mut().zip(*column).for_each(|(rest, x)| *rest -= factor * x);
    }
    let rest = centred(rest);
    let lag1 = (dot(&rest[1..], &rest) / dot(&rest, &rest)).clamp(0.0, 1.0);
    let independent = count(rest.len()) * (1.0 - lag1) / (1.0 + lag1);
    let enough = independent >= SAMPLES_PER_COLUMN * count(columns.len());
    Noise { filter: schwarz(if enough { &rest } else { values }), is_told: enough }
}

/// A symmetric matrix, to be solved over the directions that it has.
#[derive(Debug, Clone)]
struct Normal {
    /// Factors that make its diagonal ones.
    scale: DVector<f64>,
    /// The inverse of the scaled matrix over its directions.
    inverse: DMatrix<f64>,
    /// The number of its directions.
    rank: usize,
}

impl Normal {
    fn new(matrix: &DMatrix<f64>) -> Self {
        let scale = matrix.diagonal().map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 0.0 });
        let size = scale.len();
        let scaled = DMatrix::from_fn(size, size, |a, b| matrix[(a, b)] * scale[a] * scale[b]);
        // No eigenvalue is below one over the trace of the inverse, and none above the trace of the matrix.
        let inverse = scaled.clone().cholesky().map(|root| root.inverse());
        if let Some(inverse) = inverse.filter(|i| 1.0 / i.trace() > EIGENVALUE_MIN * scaled.trace()) {
            return Self { scale, inverse, rank: size };
        }
        let SymmetricEigen { eigenvalues, eigenvectors } = SymmetricEigen::new(scaled);
        let least = EIGENVALUE_MIN * eigenvalues.max();
        let (mut inverse, mut rank) = (DMatrix::zeros(size, size), 0);
        for (direction, value) in eigenvectors.column_iter().zip(eigenvalues.iter()).filter(|(_, v)| **v > least) {
            inverse += direction * direction.transpose() / *value;
            rank += 1;
        }
        Self { scale, inverse, rank }
    }

    /// `M⁻¹ z` over the directions that `M` has, and how many these are; `None` without any.
    fn solve(&self, z: &DVector<f64>) -> Option<(DVector<f64>, usize)> {
        let solution = (&self.inverse * z.component_mul(&self.scale)).component_mul(&self.scale);
        (self.rank > 0).then_some((solution, self.rank))
    }
}

/// Returns the coefficients of the autoregression of a signal, their number by Schwarz's criterion.
fn schwarz(values: &[f64]) -> Vec<f64> {
    let order_max = ORDER_MAX.min(values.len() / SAMPLES_PER_ORDER);
    autoregression(values, order_max, count(values.len()).ln()).coefficients
}

/// Returns the innovations of a signal under the autoregression; before its start the signal has its first value.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl+avx2+fma", "x86_64+avx2+fma"))]
fn filtered(signal: &[f64], filter: &[f64]) -> Vec<f64> {
    let mut left = signal.to_vec();
    for (lag, a) in (1..).zip(filter) {
        let (early, late) = left.split_at_mut(lag.min(signal.len()));
        for left in early {
            *left -= a * signal[0];
        }
        for (left, before) in late.iter_mut().zip(signal) {
            *left -= a * before;
        }
    }
    left
}

/// A signal less its mean.
fn centred(mut signal: Vec<f64>) -> Vec<f64> {
    let mean = sum(&signal) / count(signal.len());
    signal.iter_mut().for_each(|value| *value -= mean);
    signal
}
