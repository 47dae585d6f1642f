//! Cross-correlation test of residuals and input: if the residuals depend on the input, the model lacks an effect of the input.
//!
//! The residuals are regressed on the input at lags of 0 to 20 samples and on its means over successively longer windows
//! before. Autocorrelated residuals are correlated with any input by chance (M. S. Bartlett, 1935). Residuals and input are
//! therefore prewhitened by the autoregression of the noise, with its order by BIC (D. Cochrane, G. H. Orcutt, 1949; G. E. P.
//! Box, G. M. Jenkins, 1970). With filtered residuals e and regressors X the statistic is `zᵀ(σ² XᵀX + H Hᵀ)⁻¹ z`, `z = Xᵀe`.
//! It follows χ² with the rank of X as degrees of freedom if the model is complete. `H = Xᵀ D` accounts for the standard errors
//! of the parameters; the columns of D are the output sensitivities to independent errors of the parameters.

use motorfit_core::numeric::{autoregression, chi_square_limit, count, dot, running_sums, sum};
use motorfit_estimate::Products;
use multiversion::multiversion;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// The result of the test of residuals against the input.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct ResidualInputTest {
    /// True if the residuals do not depend on the input.
    #[serde(rename = "independent")]
    pub is_independent: bool,
    /// Test statistic; its expectation is the number of degrees of freedom if the residuals do not depend on the input.
    pub statistic: f64,
    /// Threshold that the statistic exceeds with a probability of 1e-4 if the residuals do not depend on the input.
    pub threshold: f64,
    /// Percentage of the variance of the residuals that the input explains beyond chance \[%\].
    pub explained_percent: f64,
}

/// Largest lag of the input \[samples\].
const LAGS: usize = 20;
/// Smallest ratio of the number of samples to the largest lag of the windowed means.
const PART_MAX: usize = 5;
/// Largest lag of the windowed means \[samples\].
const LAG_MAX: usize = 1000;
/// Highest order of the prewhitening filter.
const ORDER_MAX: usize = 20;
/// Number of samples per coefficient of the filter.
const SAMPLES_PER_ORDER: usize = 20;
/// Effective number of samples per regressor, against overfitting.
const SAMPLES_PER_COLUMN: f64 = 5.0;
/// Largest number of samples in the test; more make no practical difference.
const SAMPLES_MAX: usize = 50_000;
/// Smallest eigenvalue of the normal matrix, relative to the largest, of a direction that the input excites.
const EIGENVALUE_MIN: f64 = 1e-10;

/// Residuals with their regressors and sensitivities, all of the same length.
#[derive(Debug, Clone, Copy)]
pub struct Residuals<'a> {
    /// Measured minus simulated values; arbitrary at excluded samples.
    pub values: &'a [f64],
    /// Regressors made from the input.
    pub regressors: &'a Regressors,
    /// Mask of the samples, false if excluded; empty if none is excluded.
    pub counting: &'a [bool],
    /// Output sensitivities to the errors of the parameters, one signal for each independent error.
    pub sensitivities: &'a [Vec<f64>],
}

/// The regressors made from an input, shared by the residuals of both channels.
#[derive(Debug, Clone)]
pub struct Regressors {
    /// Input minus its first value.
    voltage: Vec<f64>,
    columns: Columns,
    /// Products of the columns over the samples from [`LAGS`] on, whose lags are within the recording.
    late: Products,
    /// Normal matrix of the columns about their means.
    normal: Normal,
}

impl Regressors {
    /// Makes the regressors from the input of a recording: the voltage \[V\], or the current \[A\] if that is the input.
    #[must_use]
    pub fn new(voltage: &[f64]) -> Self {
        let size = voltage.len().min(SAMPLES_MAX);
        let voltage: Vec<f64> = voltage[..size].iter().map(|v| v - voltage[0]).collect();
        let columns = Columns::new(&voltage);
        let all: Vec<usize> = (0..size).collect();
        let (early, late) = all.split_at(LAGS.min(size));
        let [early, late] = [early, late].map(|rows| Products::new(&columns.all(), rows));
        Self { voltage, normal: Normal::new(&early.and(&late).about_means()), late, columns }
    }
}

/// Tests residuals against the input. Returns `None` for too few samples, signals of different lengths, a constant input, or an
/// independence that is inconclusive because the residuals are too strongly correlated.
#[must_use]
pub fn residual_input_test(residuals: &Residuals<'_>) -> Option<ResidualInputTest> {
    let Regressors { voltage, .. } = residuals.regressors;
    let size = residuals.values.len().min(SAMPLES_MAX);
    if size < 2 || voltage.len() != size || residuals.sensitivities.iter().any(|signal| signal.len() < size) {
        return None;
    }
    let counts = |n: usize| residuals.counting.get(n).copied().unwrap_or(true);
    let values: Vec<f64> = (0..size).map(|n| if counts(n) { residuals.values[n] } else { 0.0 }).collect();
    let Noise { filter, is_separated } = noise(&values, residuals.regressors);
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
    let explained = std::iter::once(values.as_slice()).chain(residuals.sensitivities.iter().map(|s| &s[..size]));
    let explained: Vec<Vec<f64>> = explained.map(|signal| centred(filtered(signal, &filter))).collect();
    let explained: Vec<&[f64]> = explained.iter().map(Vec::as_slice).collect();
    let products = if filter.is_empty() && rows.len() == size - LAGS {
        // Both channels have the same regressors.
        residuals.regressors.late.beside(&residuals.regressors.columns.all(), &explained, LAGS)
    } else {
        // Filtering commutes with lags and means.
        let columns = Columns::new(&filtered(voltage, &filter));
        Products::new(&[columns.all(), explained.clone()].concat(), &rows)
    };
    let products = products.about_means();
    let variance = products[(regressors, regressors)] / count(rows.len());
    let allowed = products.view((0, regressors + 1), (regressors, explained.len() - 1));
    let matrix = products.view((0, 0), (regressors, regressors)) * variance + allowed * allowed.transpose();
    let z = products.view((0, regressors), (regressors, 1)).column(0).into_owned();
    let (solution, rank) = Normal::new(&matrix).solve(&z)?;
    let (statistic, threshold) = (z.dot(&solution), chi_square_limit(rank));
    let explained_percent = 100.0 * ((statistic - count(rank)) / count(rows.len())).clamp(0.0, 1.0);
    let is_independent = statistic <= threshold;
    let found = ResidualInputTest { statistic, threshold, explained_percent, is_independent };
    (statistic.is_finite() && (is_separated || !is_independent)).then_some(found)
}

/// A signal at each lag and its means over successively longer windows before; the signal is zero before its start.
#[derive(Debug, Clone)]
struct Columns {
    size: usize,
    /// Signal minus its mean, from the longest lag before the start.
    signal: Vec<f64>,
    /// Means over each window.
    means: Vec<Vec<f64>>,
}

impl Columns {
    fn new(signal: &[f64]) -> Self {
        let size = signal.len();
        // Subtracting the mean keeps the running sums accurate.
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

    /// Returns all columns from the first sample on.
    fn all(&self) -> Vec<&[f64]> {
        let lags = (0..=LAGS).map(|lag| &self.signal[LAG_MAX - lag..][..self.size]);
        lags.chain(self.means.iter().map(Vec::as_slice)).collect()
    }
}

/// The filter that whitens the noise.
struct Noise {
    /// Coefficients of the autoregression.
    filter: Vec<f64>,
    /// True if the effect of the input was removed from the residuals before the filter was estimated.
    is_separated: bool,
}

/// Estimates the autoregression of the noise from the residuals of the regression on the input. If the effective sample size is
/// too small for this regression, it is estimated from the residuals of the model.
fn noise(values: &[f64], regressors: &Regressors) -> Noise {
    let Regressors { columns, normal, .. } = regressors;
    let columns = columns.all();
    let mut rest = centred(values.to_vec());
    let z = DVector::from_iterator(columns.len(), columns.iter().map(|column| dot(column, &rest)));
    let Some((solution, _)) = normal.solve(&z) else {
        return Noise { filter: whitening(values), is_separated: false };
    };
    for (column, factor) in columns.iter().zip(solution.iter()) {
        rest.iter_mut().zip(*column).for_each(|(rest, x)| *rest -= factor * x);
    }
    let rest = centred(rest);
    let lag1 = (dot(&rest[1..], &rest) / dot(&rest, &rest)).clamp(0.0, 1.0);
    let effective = count(rest.len()) * (1.0 - lag1) / (1.0 + lag1);
    let enough = effective >= SAMPLES_PER_COLUMN * count(columns.len());
    Noise { filter: whitening(if enough { &rest } else { values }), is_separated: enough }
}

/// The pseudoinverse of a symmetric positive semidefinite matrix.
#[derive(Debug, Clone)]
struct Normal {
    /// Factors that scale the diagonal to ones.
    scale: DVector<f64>,
    /// Pseudoinverse of the scaled matrix.
    inverse: DMatrix<f64>,
    /// Numerical rank of the matrix.
    rank: usize,
}

impl Normal {
    fn new(matrix: &DMatrix<f64>) -> Self {
        let scale = matrix.diagonal().map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 0.0 });
        let size = scale.len();
        let scaled = DMatrix::from_fn(size, size, |a, b| matrix[(a, b)] * scale[a] * scale[b]);
        // All eigenvalues are between the inverse of the trace of the inverse and the trace of the matrix.
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

    /// Returns the solution of `M x = z` over the excited directions and the rank of `M`; `None` for rank 0.
    fn solve(&self, z: &DVector<f64>) -> Option<(DVector<f64>, usize)> {
        let solution = (&self.inverse * z.component_mul(&self.scale)).component_mul(&self.scale);
        (self.rank > 0).then_some((solution, self.rank))
    }
}

/// Returns the coefficients of the autoregression of a signal, with the order by BIC.
fn whitening(values: &[f64]) -> Vec<f64> {
    let order_max = ORDER_MAX.min(values.len() / SAMPLES_PER_ORDER);
    autoregression(values, order_max, count(values.len()).ln()).coefficients
}

/// Returns the innovations of a signal under an autoregression; the first value of the signal extends before its start.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl+avx2+fma", "x86_64+avx2+fma"))]
fn filtered(signal: &[f64], filter: &[f64]) -> Vec<f64> {
    let mut innovations = signal.to_vec();
    for (lag, a) in (1..).zip(filter) {
        let (early, late) = innovations.split_at_mut(lag.min(signal.len()));
        for innovation in early {
            *innovation -= a * signal[0];
        }
        for (innovation, before) in late.iter_mut().zip(signal) {
            *innovation -= a * before;
        }
    }
    innovations
}

/// Returns a signal minus its mean.
fn centred(mut signal: Vec<f64>) -> Vec<f64> {
    let mean = sum(&signal) / count(signal.len());
    signal.iter_mut().for_each(|value| *value -= mean);
    signal
}
