//! Standard errors that hold for correlated residuals: a sandwich estimate of the covariance.
//!
//! With the output sensitivities X of all unknowns (coordinates of the parameters and free initial states), weights `w = 1/σ²`
//! and residuals of covariance Γ in each recording and channel, the estimate has the covariance `H⁻¹ Ω H⁻¹`, `H = Σ w XᵀX`,
//! `Ω = Σ w² XᵀΓX`: P. J. Huber (1967), H. White (1980); L. Ljung, System Identification (1999), ch. 9. White residuals have
//! `Γ = σ² I`, which gives `H⁻¹`, the Cramér–Rao bound. Γ is the covariance of an autoregression fitted to the residuals (J. P.
//! Burg 1967), its order chosen by AIC: a parametric estimate of the long-run covariance (K. N. Berk 1974), whereas W. K. Newey
//! and K. D. West (1987) weight sample autocovariances. Residuals of the two channels and of different recordings are taken as
//! independent.

use super::fit::Fit;
use super::fitted::{Fitted, Sigma};
use super::refined::Refined;
use super::uncertainty::{EFFECTIVE_RATIO_MIN, Uncertainty, invert, marginal, spread_matrix, student95};
use motorfit_core::numeric::autoregression;
use nalgebra::DMatrix;
use rayon::prelude::*;

/// Highest order of an autoregression.
const ORDER_MAX: usize = 30;
/// Number of samples that each order requires.
const SAMPLES_PER_ORDER: usize = 20;
/// Penalty of an order in AIC.
const AKAIKE: f64 = 2.0;

/// Relative difference of the σ of weights and of residuals from which the weights are not those of maximum likelihood.
const OTHER_WEIGHTS: f64 = 1e-2;

/// Returns the uncertainty of a refined estimate, with standard errors, confidence intervals and correlations that hold for
/// correlated residuals. `problem` is the one that it was refined on. No standard error decreases. The uncertainty is
/// returned unchanged if the residuals pass the whiteness test, were not tested, or no standard error grows.
#[must_use]
pub fn robust_uncertainty(problem: &dyn Fitted, refined: &Refined) -> Uncertainty {
    robust(&Fit::new(problem), refined)
}

/// Returns the uncertainty of an estimate that holds for correlated residuals and for weights other than those of maximum likelihood.
pub(super) fn robust(fit: &Fit<'_>, refined: &Refined) -> Uncertainty {
    let own = &refined.uncertainty;
    if !refined.suits(fit.problem) {
        return own.clone();
    }
    let is_colored = own.whiteness.iter().flatten().any(|of| !of.is_white);
    let pairs = refined.weights.iter().flatten().zip(refined.sigmas.iter().flatten());
    let is_other = pairs.into_iter().any(|(weight, sigma)| (weight / sigma - 1.0).abs() > OTHER_WEIGHTS);
    (is_colored || is_other).then(|| sandwich(fit, refined)).flatten().unwrap_or_else(|| own.clone())
}

/// Returns the uncertainty by the sandwich estimate; `None` if no standard error grows or the covariance is not finite.
fn sandwich(fit: &Fit<'_>, refined: &Refined) -> Option<Uncertainty> {
    let Refined { values, uncertainty: own, at_bound, .. } = refined;
    let space = &fit.axes;
    let moves = |n: &usize| at_bound[*n].is_none() || space[*n].is_idle(values[*n]);
    let moving: Vec<usize> = (0..space.len()).filter(moves).collect();
    let states: Vec<usize> = (space.len()..fit.unknowns).collect();
    let (matrix, _) = fit.weighted(&fit.normal(&fit.at(values, &refined.initial))?, &refined.weights);
    let (information, gain) = marginal(&matrix, &moving, &states);
    let inverse = invert(&information).known;
    let middle = middle(fit, refined);
    // Subtracts from the sensitivities of the parameters their projection onto those of the initial states.
    let elimination =
        DMatrix::from_fn(moving.len(), fit.unknowns, |row, column| match column.checked_sub(space.len()) {
            Some(state) => -gain[(state, row)],
            None => f64::from(u8::from(moving[row] == column)),
        });
    let covariance = &inverse * (&elimination * middle * elimination.transpose()) * &inverse;
    let place = |axis: usize| moving.iter().position(|n| *n == axis);
    let error = |axis: usize| Some(covariance[(place(axis)?, place(axis)?)].sqrt());
    let ratio = |axis: usize| Some(error(axis)? / (own.std_error[axis]? / space[axis].slope(values[axis])));
    let ratios: Vec<f64> = (0..space.len()).map(|n| ratio(n).map_or(1.0, |ratio| ratio.max(1.0))).collect();
    let widened_by = ratios.iter().copied().fold(1.0, f64::max);
    if !(widened_by.is_finite() && widened_by > 1.0) {
        return None;
    }
    let std_error: Vec<Option<f64>> = own.std_error.iter().zip(&ratios).map(|(e, ratio)| Some((*e)? * ratio)).collect();
    let quantile = student95(fit.count().saturating_sub(moving.len() + states.len()));
    let interval = |n: usize| Some(space[n].around(values[n], quantile * std_error[n]? / space[n].slope(values[n])));
    let correlation = |a: usize, b: usize| {
        own.correlation[a][b]?;
        Some(covariance[(place(a)?, place(b)?)] / (error(a)? * error(b)?))
    };
    Some(Uncertainty {
        ci95: (0..space.len()).map(interval).collect(),
        correlation: (0..space.len()).map(|a| (0..space.len()).map(|b| correlation(a, b)).collect()).collect(),
        std_error,
        widened_by,
        covariance: spread_matrix(&covariance, &moving, space.len()),
        ..own.clone()
    })
}

/// Returns Ω, the inner matrix of the sandwich, for all unknowns.
fn middle(fit: &Fit<'_>, refined: &Refined) -> DMatrix<f64> {
    let Refined { values, sigmas, weights, .. } = refined;
    let of = |recording: usize| {
        let initial = &refined.initial[recording];
        let noise = noise(fit, (values, initial), recording, sigmas);
        let filters: Vec<Vec<f64>> = noise.iter().map(|noise| noise.0.clone()).collect();
        let products = fit.problem.shaped(values, recording, initial, &filters);
        let weighed = products.into_iter().zip(noise).zip(&weights[recording]);
        let unknowns = fit.places[recording].len();
        weighed.fold(DMatrix::zeros(unknowns, unknowns), |sum, ((products, (_, innovation)), weight)| {
            sum + products * (innovation / weight.powi(4))
        })
    };
    let all: Vec<DMatrix<f64>> = (0..fit.problem.recordings()).into_par_iter().map(of).collect();
    let mut total = DMatrix::zeros(fit.unknowns, fit.unknowns);
    for (places, products) in fit.places.iter().zip(all) {
        for (a, &row) in places.iter().enumerate() {
            for (b, &column) in places.iter().enumerate() {
                total[(row, column)] += products[(a, b)];
            }
        }
    }
    total
}

/// Returns the autoregression of the residuals of each output: its coefficients and the variance of its innovations, which
/// is zero for an output that was not measured. `sigmas` holds the root mean squares of the residuals.
fn noise(fit: &Fit<'_>, (values, initial): (&[f64], &[f64]), recording: usize, sigmas: &Sigma) -> Vec<(Vec<f64>, f64)> {
    let ratio = fit.problem.effective_sample_ratio(recording);
    let of = |(output, residuals): (usize, Vec<f64>)| {
        let variance = sigmas[recording][output].powi(2);
        if !fit.problem.has((recording, output)) {
            return (Vec::new(), 0.0);
        }
        // Filtered residuals are correlated even if the model is complete: their variance is divided by the effective
        // sample ratio.
        if ratio < EFFECTIVE_RATIO_MIN {
            return (Vec::new(), variance / ratio);
        }
        let found = autoregression(&residuals, ORDER_MAX.min(residuals.len() / SAMPLES_PER_ORDER), AKAIKE);
        (found.coefficients, variance * found.innovation)
    };
    fit.problem.residuals(values, recording, initial).into_iter().enumerate().map(of).collect()
}
