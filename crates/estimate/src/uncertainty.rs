//! Uncertainty of an estimate: covariance, standard errors, confidence intervals, correlations, directions that are not
//! identifiable, and the whiteness test of the residuals.
//!
//! The Fisher information in the coordinates of the parameters (logarithms for R, L, K, B and J, multiples of the range for
//! those of extensions) is `JᵀJ` with errors in units of σ. For white residuals its inverse is the Cramér–Rao bound on
//! the covariance of the estimates; for correlated residuals [`super::sandwich`] widens it.

use super::fit::Fit;
use super::fitted::Fitted;
use super::triangle::dot;
use motorfit_core::coordinate::Coordinate;
use motorfit_core::numeric::{count, peak};
use motorfit_motor::Axis;
use multiversion::multiversion;
use multiversion::target::target_cfg_f;
use nalgebra::{DMatrix, SymmetricEigen};

/// Uncertainty of an estimate. Its vectors have one entry for each free parameter of the space, in that order.
#[derive(Debug, Clone, PartialEq)]
pub struct Uncertainty {
    /// Standard errors in the unit of the parameter; `None` for a parameter at a bound or not identifiable.
    pub std_error: Vec<Option<f64>>,
    /// 95 % confidence intervals, symmetric in the coordinate of the parameter.
    pub ci95: Vec<Option<[f64; 2]>>,
    /// Correlations of the estimates; `None` where a standard error is `None`.
    pub correlation: Vec<Vec<Option<f64>>>,
    /// Condition number of the Fisher information in the coordinates; infinite if it is singular.
    pub condition: f64,
    /// Number of independent combinations of the free parameters that are identifiable.
    pub rank: usize,
    /// Unidentifiable directions in the coordinates of the parameters: a joint step along one leaves the output unchanged.
    pub unidentifiable: Vec<Vec<f64>>,
    /// True for each parameter that takes part in an unidentifiable direction.
    pub open: Vec<bool>,
    /// Covariance of the coordinates within the identifiable directions; zero for a parameter at a bound.
    pub covariance: Vec<Vec<f64>>,
    /// Whiteness test of the residuals of each output, the worst of its recordings; `None` if an output was not tested.
    pub whiteness: Vec<Option<Whiteness>>,
    /// Largest ratio of a standard error to that of white residuals; 1 if none was widened.
    pub widened_by: f64,
}

/// Ljung–Box whiteness test of the residuals of a channel.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Whiteness {
    /// True if the statistic is below the 99.9 % quantile for white residuals.
    #[serde(rename = "white")]
    pub is_white: bool,
    /// Statistic `N(N+2) Σ r_k²/(N−k)` over 20 lags: about 20 for white residuals, above 45.3 with probability 0.001.
    #[serde(rename = "ljung_box")]
    pub statistic: f64,
    /// Autocorrelation of the residuals at lag 1.
    pub lag1: f64,
}

impl Uncertainty {
    /// Returns the variance inflation of correlated residuals, `(1 + ρ)/(1 − ρ)` with ρ the correlation at lag 1; the largest of all
    /// outputs, at least 1.
    #[must_use]
    pub fn variance_inflation(&self) -> f64 {
        let lags = self.whiteness.iter().flatten().map(|white| white.lag1.clamp(0.0, 0.999));
        lags.map(|lag| (1.0 + lag) / (1.0 - lag)).fold(1.0, f64::max)
    }

    /// Sets the standard error, interval and correlations of the free parameter `place` to `None`.
    #[doc(hidden)]
    pub fn forget(&mut self, place: usize) {
        (self.std_error[place], self.ci95[place]) = (None, None);
        self.correlation[place].fill(None);
        self.correlation.iter_mut().for_each(|row| row[place] = None);
    }
}

impl Whiteness {
    /// Tests the residuals of a channel whose root mean square is `size`; `None` if there are at most 40 residuals or they
    /// are rounding errors.
    #[must_use]
    pub fn of(residuals: &[f64], size: f64) -> Option<Self> {
        let n = count(residuals.len());
        if residuals.len() <= 2 * LAGS {
            return None;
        }
        let products = products(residuals);
        // Rounding errors are not white, but do not indicate a model error.
        if (products[0] / n).sqrt() < ROUNDING * size {
            return None;
        }
        let correlations = products.map(|product| product / products[0]);
        let correlations = &correlations[1..];
        let sum: f64 = correlations.iter().enumerate().map(|(k, r)| r * r / (n - count(k + 1))).sum();
        let statistic = n * (n + 2.0) * sum;
        statistic.is_finite().then_some(Self { statistic, lag1: correlations[0], is_white: statistic <= CHI2 })
    }
}

/// Number of lags of the whiteness test.
const LAGS: usize = 20;
/// 99.9 % quantile of χ² with 20 degrees of freedom, one for each lag.
const CHI2: f64 = 45.31;
/// Standard error along a direction of the coordinates from which the direction is unidentifiable: a factor of e, or the
/// range of an extension parameter.
const SPREAD_MAX: f64 = 1.0;
/// Standard error along a direction whose information is rounding error.
const SPREAD_OPEN: f64 = 1e3;
/// Ratio of the information of a direction to the largest at which it is rounding error and the direction unidentifiable.
const INFORMATION_MIN: f64 = 1e-13;
/// Ratio of residuals to the signal below which residuals are rounding errors.
const ROUNDING: f64 = 1e-10;
/// Effective sample size, as a fraction of the samples, below which residuals are not tested.
pub const EFFECTIVE_RATIO_MIN: f64 = 0.9;
/// 97.5 % quantile of the standard normal distribution, which bounds two-sided 95 % intervals.
const Z95: f64 = 1.959_963_984_540_054;

/// Share of a direction from which a parameter takes part in it.
const TAKES_PART: f64 = 0.05;

/// Returns the uncertainty of an estimate without a test of the residuals. `free` holds the unknowns that are not at a
/// bound.
pub(super) fn uncertainty(fit: &Fit<'_>, values: &[f64], matrix: &DMatrix<f64>, free: &[usize]) -> Uncertainty {
    let space = &fit.axes;
    let axes = space.len();
    let quantile = student95(fit.count().saturating_sub(free.len()));
    let moving: Vec<usize> = free.iter().copied().filter(|n| *n < axes).collect();
    let states: Vec<usize> = free.iter().copied().filter(|n| *n >= axes).collect();
    let information = marginal(matrix, &moving, &states).0;
    let Inverse { known: covariance, unknown: along, condition, directions: unknown } = invert(&information);
    let place = |axis: usize| moving.iter().position(|n| *n == axis);
    let magnitudes: Vec<f64> =
        moving.iter().enumerate().map(|(p, n)| magnitude(&space[*n], values[*n], information[(p, p)])).collect();
    // The part of a parameter that is small in each direction may be long all the same.
    let variance = |a: usize, b: usize| covariance[(a, b)] + along[(a, b)];
    let known = |p: usize| {
        variance(p, p) < SPREAD_MAX * SPREAD_MAX
            && unknown.iter().all(|direction| !takes_part(direction, &magnitudes, p))
    };
    let error = |axis: usize| {
        let p = place(axis).filter(|&p| known(p))?;
        Some(variance(p, p).sqrt()).filter(|error| error.is_finite())
    };
    let correlation = |a: usize, b: usize| {
        let (pa, pb) = (place(a)?, place(b)?);
        Some(variance(pa, pb) / (error(a)? * error(b)?))
    };
    let spread = |direction: &Vec<f64>| (0..axes).map(|axis| place(axis).map_or(0.0, |p| direction[p])).collect();
    Uncertainty {
        std_error: (0..axes).map(|n| error(n).map(|e| e * space[n].slope(values[n]))).collect(),
        ci95: (0..axes).map(|n| error(n).map(|e| space[n].around(values[n], quantile * e))).collect(),
        correlation: (0..axes).map(|a| (0..axes).map(|b| correlation(a, b)).collect()).collect(),
        condition,
        rank: moving.len() - unknown.len(),
        unidentifiable: unknown.iter().map(spread).collect(),
        open: (0..axes).map(|axis| place(axis).is_some_and(|p| !known(p))).collect(),
        covariance: spread_matrix(&covariance, &moving, axes),
        whiteness: vec![None; fit.problem.outputs()],
        widened_by: 1.0,
    }
}

/// Returns a matrix over the parameters `moving` as one over all, with zeros elsewhere.
pub(super) fn spread_matrix(matrix: &DMatrix<f64>, moving: &[usize], axes: usize) -> Vec<Vec<f64>> {
    let mut all = vec![vec![0.0; axes]; axes];
    for (a, row) in moving.iter().enumerate() {
        for (b, column) in moving.iter().enumerate() {
            all[*row][*column] = matrix[(a, b)];
        }
    }
    all
}

/// Returns the magnitude of a value in its coordinate, by which steps of parameters with different coordinates are compared: 1 for a
/// logarithm. A value near zero has the magnitude of its error with the others known.
fn magnitude(axis: &Coordinate, value: f64, information: f64) -> f64 {
    if axis.is_logarithmic { 1.0 } else { axis.of(value).abs().max(information.sqrt().recip()).max(f64::MIN_POSITIVE) }
}

/// Returns true for each parameter that takes part in a direction.
pub(super) fn takes_part_in(problem: &dyn Fitted, values: &[f64], direction: &[f64]) -> Vec<bool> {
    let magnitudes: Vec<f64> =
        problem.axes().iter().zip(values).map(|(axis, value)| magnitude(axis, *value, f64::INFINITY)).collect();
    (0..direction.len()).map(|p| direction[p] != 0.0 && takes_part(direction, &magnitudes, p)).collect()
}

/// Returns true if a parameter takes part in a direction: by its coordinate, or by its own magnitude. A small value on a long linear
/// range has a small coordinate, and may scale with the others all the same.
fn takes_part(direction: &[f64], magnitudes: &[f64], p: usize) -> bool {
    let shares: Vec<f64> = direction.iter().zip(magnitudes).map(|(step, size)| step.abs() / size).collect();
    direction[p].abs() >= TAKES_PART || shares[p] >= TAKES_PART * peak(&shares)
}

/// Returns the information on the parameters with the initial states unknown (Schur complement), and the sensitivity
/// `H_ss⁻¹ H_sθ` of the states to each parameter.
pub(super) fn marginal(matrix: &DMatrix<f64>, moving: &[usize], states: &[usize]) -> (DMatrix<f64>, DMatrix<f64>) {
    let part = |rows: &[usize], columns: &[usize]| {
        DMatrix::from_fn(rows.len(), columns.len(), |a, b| matrix[(rows[a], columns[b])])
    };
    let own = part(moving, moving);
    if states.is_empty() {
        return (own, DMatrix::zeros(0, moving.len()));
    }
    let cross = part(moving, states);
    // A state without information would make the block singular. Adding 1e-12 of the trace makes the factorization succeed
    // and leaves the Schur complement unchanged.
    let mut block = part(states, states);
    let ridge = 1e-12 * block.trace().max(f64::MIN_POSITIVE);
    for n in 0..states.len() {
        block[(n, n)] += ridge;
    }
    match block.cholesky() {
        Some(inverse) => {
            let gain = inverse.solve(&cross.transpose());
            (own - &cross * &gain, gain)
        }
        None => (own * f64::NAN, cross.transpose() * f64::NAN),
    }
}

/// The inverse of an information matrix.
pub(super) struct Inverse {
    /// Covariance within the identifiable directions.
    pub known: DMatrix<f64>,
    /// Covariance along the other directions, as far as it is finite.
    pub unknown: DMatrix<f64>,
    /// Condition number; infinite if the matrix is singular.
    pub condition: f64,
    /// Unidentifiable directions.
    pub directions: Vec<Vec<f64>>,
}

/// Inverts an information matrix.
pub(super) fn invert(information: &DMatrix<f64>) -> Inverse {
    let size = information.nrows();
    let zeros = DMatrix::zeros(size, size);
    let mut all = Inverse { known: zeros.clone(), unknown: zeros, condition: 1.0, directions: Vec::new() };
    if size == 0 {
        return all;
    }
    let SymmetricEigen { eigenvalues, eigenvectors } = SymmetricEigen::new(information.clone());
    let largest = eigenvalues.iter().copied().fold(0.0, f64::max);
    let smallest = eigenvalues.iter().copied().fold(f64::INFINITY, f64::min);
    for (n, &value) in eigenvalues.iter().enumerate() {
        let direction = eigenvectors.column(n);
        let outer = direction * direction.transpose();
        let is_rounding = value <= INFORMATION_MIN * largest;
        if !is_rounding && value > 1.0 / (SPREAD_MAX * SPREAD_MAX) {
            all.known += outer / value;
        } else {
            all.unknown += outer / if is_rounding { SPREAD_OPEN.powi(-2) } else { value };
            all.directions.push(direction.iter().copied().collect());
        }
    }
    all.condition = if smallest > INFORMATION_MIN * largest { largest / smallest } else { f64::INFINITY };
    all
}

/// Returns the 97.5 % quantile of Student's t by the Cornish–Fisher expansion. The relative error is 1.1e-3 at 5 degrees of
/// freedom and below 6e-4 from 6 on; below 5 the result is too small, by 3 % at 2 and 24 % at 1.
#[must_use]
pub fn student95(freedom: usize) -> f64 {
    let v = count(freedom.max(1));
    let z = Z95;
    let first = (z.powi(3) + z) / 4.0;
    let second = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0;
    let third = (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0;
    z + first / v + second / (v * v) + third / v.powi(3)
}

/// Tests the residuals of every recording and returns the largest statistic of each output.
pub(super) fn whiteness(fit: &Fit<'_>, values: &[f64], initial: &[Vec<f64>]) -> Vec<Option<Whiteness>> {
    let mut worst: Vec<Option<Whiteness>> = vec![None; fit.problem.outputs()];
    for (recording, initial) in initial.iter().enumerate() {
        // Filtered residuals are correlated even if the model is complete, so they are not tested.
        if fit.problem.effective_sample_ratio(recording) < EFFECTIVE_RATIO_MIN {
            continue;
        }
        let residuals = fit.problem.residuals(values, recording, initial);
        for (output, residuals) in residuals.iter().enumerate() {
            let found = Whiteness::of(residuals, fit.problem.rms((recording, output)));
            let is_worse = |w: &Whiteness| worst[output].is_none_or(|of| w.statistic > of.statistic);
            if let Some(found) = found.filter(is_worse) {
                worst[output] = Some(found);
            }
        }
    }
    worst
}

/// Returns the sums of products of the residuals at lags 0 to 20.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl+avx2+fma", "x86_64+avx2+fma"))]
fn products(residuals: &[f64]) -> [f64; LAGS + 1] {
    let mut sums = [0.0; LAGS + 1];
    for (lag, sum) in sums.iter_mut().enumerate() {
        *sum = dot::<{ target_cfg_f!(target_feature = "fma") }>(&residuals[..residuals.len() - lag], &residuals[lag..]);
    }
    sums
}

/// Returns a text with the symbols of the parameters that take part in a direction and the ratios of their steps.
#[must_use]
pub fn describe_direction(direction: &[f64], axes: &[Axis]) -> String {
    let largest = peak(direction);
    let steps = axes.iter().map(|axis| axis.parameter.symbol()).zip(direction.iter().copied());
    let parts: Vec<(&str, f64)> = steps.filter(|(_, step)| step.abs() > 0.05 * largest).collect();
    let smallest = parts.iter().map(|(_, step)| step.abs()).fold(f64::INFINITY, f64::min);
    let sign = parts.first().map_or(1.0, |(_, step)| step.signum());
    let symbols: Vec<&str> = parts.iter().map(|(symbol, _)| *symbol).collect();
    if let [only] = symbols[..] {
        return format!("{only} alone");
    }
    let ratios: Vec<String> =
        parts.iter().map(|(_, step)| motorfit_core::text::significant(sign * step / smallest, 2)).collect();
    format!(
        "{} jointly: steps of their logarithms in the ratio {} leave the fit unchanged",
        symbols.join(", "),
        ratios.join(" : ")
    )
}
