//! Uncertainty of an estimate of a model: the inverse information, widened for correlated residuals by a sandwich estimate.
//!
//! The covariance is `H⁻¹ Ω H⁻¹` with `H = Σ XᵀX/σ²` and `Ω = Σ XᵀΓX/σ⁴`; Γ is the covariance of an autoregression fitted to the
//! residuals (J. P. Burg 1967; H. White 1980). White residuals have `Γ = σ² I`, which gives `H⁻¹`.

use super::descent::Descent;
use super::fit::Fit;
use crate::uncertainty::{EFFECTIVE_RATIO_MIN, Whiteness, invert, marginal, student95};
use motorfit_core::numeric::{autoregression, rms};
use nalgebra::DMatrix;

/// Highest order of an autoregression, and the number of samples that each order needs.
const ORDER_MAX: usize = 30;
const SAMPLES_PER_ORDER: usize = 20;
/// Penalty of an order in AIC.
const AKAIKE: f64 = 2.0;
/// Component of a parameter in an unidentifiable direction from which it has no standard error.
const COMPONENT: f64 = 0.05;

/// Uncertainty of an estimate of a model. Vectors have one entry for each free parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelUncertainty {
    /// Standard errors in the unit of the parameter; `None` at a bound or if the parameter is not identifiable.
    pub std_error: Vec<Option<f64>>,
    /// 95 % confidence intervals, symmetric in the coordinate of the parameter.
    pub ci95: Vec<Option<[f64; 2]>>,
    /// Correlations of the estimates.
    pub correlation: Vec<Vec<Option<f64>>>,
    /// Directions of the coordinates along which the outputs do not change.
    pub unidentifiable: Vec<Vec<f64>>,
    /// Condition number of the information; infinite if it is singular.
    pub condition: f64,
    /// Whiteness test of the residuals of each recording and output; `None` if it was not tested.
    pub whiteness: Vec<Vec<Option<Whiteness>>>,
    /// Largest ratio of a standard error to that of white residuals.
    pub widened_by: f64,
}

/// Returns the uncertainty at the end of a descent; `free` are the unknowns that are not at a bound. With weights other than those of
/// maximum likelihood, the inverse variances of the residuals, the covariance is a sandwich estimate for white residuals too.
pub(super) fn uncertainty(
    fit: &Fit<'_>,
    descent: &Descent<'_>,
    free: &[usize],
    is_maximum_likelihood: bool,
) -> ModelUncertainty {
    let space = &fit.problem.space().free;
    let axes = space.len();
    let values = fit.values(&descent.at);
    let moving: Vec<usize> = free.iter().copied().filter(|n| *n < axes).collect();
    let states: Vec<usize> = free.iter().copied().filter(|n| *n >= axes).collect();
    // Filtered samples are not independent: the effective sample size is smaller.
    let sigma: Vec<f64> = descent
        .normal
        .blocks
        .iter()
        .zip(&descent.sigma)
        .map(|(block, sigma)| {
            let ratio = fit.problem.recording(block.recording).effective_sample_ratio;
            if is_maximum_likelihood { sigma / ratio.sqrt() } else { *sigma }
        })
        .collect();
    let (matrix, _) = fit.weighted(&descent.normal, &sigma);
    let (information, gain) = marginal(&matrix, &moving, &states);
    let (inverse, condition, unknown) = invert(&information);
    let (whiteness, noises) = noises(fit, descent);
    let is_colored = whiteness.iter().flatten().flatten().any(|test| !test.is_white);
    let between = |noises: &[Noise]| sandwich(fit, descent, (&moving, &gain), (&inverse, &sigma, noises));
    let plain = match is_maximum_likelihood {
        true => inverse.clone(),
        false => between(&white(fit, descent)),
    };
    let covariance = if is_colored { between(&noises) } else { plain.clone() };
    let place = |axis: usize| moving.iter().position(|n| *n == axis);
    let is_known = |p: usize| unknown.iter().all(|direction| direction[p].abs() < COMPONENT);
    // No standard error falls below that of white residuals.
    let error = |axis: usize| {
        let p = place(axis).filter(|p| is_known(*p))?;
        let variance = covariance[(p, p)].max(plain[(p, p)]);
        Some(variance.sqrt()).filter(|error| error.is_finite())
    };
    let quantile = student95(fit.problem.counted().saturating_sub(free.len()));
    let interval = |n: usize| {
        let half = quantile * error(n)?;
        let at = space[n].coordinate(values[n]);
        let of = |coordinate: f64| {
            if space[n].is_logarithmic { coordinate.exp() } else { coordinate * (space[n].max - space[n].min) }
        };
        Some([of(at - half), of(at + half)])
    };
    let correlation = |a: usize, b: usize| {
        let (p, q) = (place(a)?, place(b)?);
        let own = |n: usize| covariance[(n, n)].sqrt();
        error(a).and(error(b)).map(|_| covariance[(p, q)] / (own(p) * own(q)))
    };
    let ratio = |n: usize| Some(error(n)? / plain[(place(n)?, place(n)?)].sqrt());
    ModelUncertainty {
        std_error: (0..axes).map(|n| Some(error(n)? * space[n].slope(values[n]))).collect(),
        ci95: (0..axes).map(interval).collect(),
        correlation: (0..axes).map(|a| (0..axes).map(|b| correlation(a, b)).collect()).collect(),
        unidentifiable: unknown
            .iter()
            .map(|direction| (0..axes).map(|axis| place(axis).map_or(0.0, |p| direction[p])).collect())
            .collect(),
        condition,
        whiteness,
        widened_by: (0..axes).filter_map(ratio).fold(1.0, f64::max),
    }
}

/// Autoregression of the residuals of a block: its coefficients and the variance of its innovations.
struct Noise {
    coefficients: Vec<f64>,
    innovation: f64,
}

/// Returns white noise of the variance of the residuals of each block.
fn white(fit: &Fit<'_>, descent: &Descent<'_>) -> Vec<Noise> {
    let blocks = descent.normal.blocks.iter().zip(descent.normal.rms());
    let of = |(block, rms): (&super::fit::Block, f64)| {
        let ratio = fit.problem.recording(block.recording).effective_sample_ratio;
        Noise { coefficients: Vec::new(), innovation: rms * rms / ratio }
    };
    blocks.map(of).collect()
}

/// Tests the residuals of each block and fits their autoregressions.
fn noises(fit: &Fit<'_>, descent: &Descent<'_>) -> (Vec<Vec<Option<Whiteness>>>, Vec<Noise>) {
    let outputs = fit.problem.model().outputs().len();
    let mut whiteness = vec![vec![None; outputs]; fit.problem.recordings()];
    let mut noises = Vec::new();
    let values = fit.values(&descent.at);
    let simulated = |n: usize| fit.problem.simulate(&values, n, &fit.initial(&descent.at, n));
    let simulated: Vec<_> = (0..fit.problem.recordings()).map(simulated).collect();
    for block in &descent.normal.blocks {
        let recording = fit.problem.recording(block.recording);
        let found = &simulated[block.recording];
        let signal = recording.measured[block.output].as_deref().unwrap_or_default();
        let residuals: Vec<f64> = signal
            .iter()
            .zip(&found.outputs[block.output])
            .enumerate()
            .filter(|(n, _)| recording.counts(block.output, *n))
            .map(|(_, (y, x))| y - x)
            .collect();
        let variance = rms(&residuals).powi(2);
        if recording.effective_sample_ratio < EFFECTIVE_RATIO_MIN {
            noises.push(Noise { coefficients: Vec::new(), innovation: variance / recording.effective_sample_ratio });
            continue;
        }
        whiteness[block.recording][block.output] = Whiteness::of(&residuals, rms(signal));
        let found = autoregression(&residuals, ORDER_MAX.min(residuals.len() / SAMPLES_PER_ORDER), AKAIKE);
        noises.push(Noise { coefficients: found.coefficients, innovation: variance * found.innovation });
    }
    (whiteness, noises)
}

/// Returns the sandwich estimate of the covariance of the moving parameters.
fn sandwich(
    fit: &Fit<'_>,
    descent: &Descent<'_>,
    (moving, gain): (&[usize], &DMatrix<f64>),
    (plain, sigma, noises): (&DMatrix<f64>, &[f64], &[Noise]),
) -> DMatrix<f64> {
    let unknowns = fit.unknowns();
    let mut middle = DMatrix::zeros(unknowns, unknowns);
    let mut known: Option<(usize, motorfit_evaluate::model::Trajectory)> = None;
    for ((block, sigma), noise) in descent.normal.blocks.iter().zip(sigma).zip(noises) {
        let (numbers, _) = fit.directions(&descent.at, block.recording);
        let trajectory = match known.take() {
            Some((recording, trajectory)) if recording == block.recording => trajectory,
            _ => fit.trajectory(&descent.at, block.recording),
        };
        let recording = fit.problem.recording(block.recording);
        let (rows, width) = (&trajectory.sensitivities[block.output], numbers.len());
        let counts = |n: usize| recording.counts(block.output, n);
        let products = match recording.is_scattered(block.output) {
            // The residuals are those of the samples that count.
            true => {
                let own = rows.chunks(width.max(1)).enumerate().filter(|(n, _)| counts(*n));
                shaped(&own.flat_map(|(_, row)| row).copied().collect::<Vec<f64>>(), width, noise, &|_| true)
            }
            false => shaped(rows, width, noise, &counts),
        };
        for (a, row) in numbers.iter().enumerate() {
            for (b, column) in numbers.iter().enumerate() {
                middle[(*row, *column)] += products[(a, b)] * noise.innovation / sigma.powi(4);
            }
        }
        known = Some((block.recording, trajectory));
    }
    // Subtracts from the sensitivities of the parameters their projection onto those of the initial states.
    let axes = fit.axes();
    let states: Vec<usize> = descent.free().into_iter().filter(|n| *n >= axes).collect();
    let elimination = DMatrix::from_fn(moving.len(), unknowns, |row, column| {
        match states.iter().position(|state| *state == column) {
            Some(state) => -gain[(state, row)],
            None => f64::from(u8::from(moving[row] == column)),
        }
    });
    plain * (&elimination * middle * elimination.transpose()) * plain
}

/// Returns `Xᵀ Γ X` for innovations of variance one: the products of the rows of X after the filter `1/A`, run backwards in time and
/// past the first sample until it has decayed.
fn shaped(rows: &[f64], width: usize, noise: &Noise, counts: &dyn Fn(usize) -> bool) -> DMatrix<f64> {
    const RING_OUT: usize = 2000;
    let order = noise.coefficients.len();
    let samples = rows.len() / width.max(1);
    let mut past: Vec<Vec<f64>> = vec![vec![0.0; width]; order.max(1)];
    let mut newest = 0;
    let mut total = DMatrix::zeros(width, width);
    let ring_out = if order == 0 { 0 } else { RING_OUT };
    let zeros = vec![0.0; width];
    for step in 0..samples + ring_out {
        let n = samples.checked_sub(step + 1);
        let own = n.filter(|n| counts(*n)).map_or(&zeros[..], |n| &rows[n * width..(n + 1) * width]);
        let mut row = own.to_vec();
        for (k, a) in noise.coefficients.iter().enumerate() {
            let before = &past[(newest + order - k) % order.max(1)];
            row.iter_mut().zip(before).for_each(|(value, before)| *value += a * before);
        }
        for a in 0..width {
            for b in 0..=a {
                total[(a, b)] += row[a] * row[b];
            }
        }
        if order > 0 {
            newest = (newest + 1) % order;
            past[newest] = row;
        }
    }
    for a in 0..width {
        for b in 0..a {
            total[(b, a)] = total[(a, b)];
        }
    }
    total
}
