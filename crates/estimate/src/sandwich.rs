//! Standard errors that hold for correlated residuals: a sandwich estimate of the covariance.
//!
//! With the output sensitivities X of all unknowns (coordinates of the parameters and free initial states), weights `w = 1/σ²`
//! and residuals of covariance Γ in each recording and channel, the estimate has the covariance `H⁻¹ Ω H⁻¹`, `H = Σ w XᵀX`,
//! `Ω = Σ w² XᵀΓX`: P. J. Huber (1967), H. White (1980); L. Ljung, System Identification (1999), ch. 9. White residuals have
//! `Γ = σ² I`, which gives `H⁻¹`, the Cramér–Rao bound. Γ is the covariance of an autoregression fitted to the residuals (J. P.
//! Burg 1967), its order chosen by AIC: a parametric estimate of the long-run covariance (K. N. Berk 1974), whereas W. K. Newey
//! and K. D. West (1987) weight sample autocovariances. Residuals of the two channels and of different recordings are taken as
//! independent.

use super::normal::{Fit, Sigma};
use super::refined::Refined;
use super::sensitivity::Case;
use super::shaped::shaped_products;
use super::uncertainty::{EFFECTIVE_RATIO_MIN, Uncertainty, invert, marginal, student95};
use motorfit_core::numeric::autoregression;
use motorfit_evaluate::Problem;
use nalgebra::DMatrix;
use rayon::prelude::*;

/// Highest order of an autoregression.
const ORDER_MAX: usize = 30;
/// Number of samples that each order requires.
const SAMPLES_PER_ORDER: usize = 20;
/// Penalty of an order in AIC.
const AKAIKE: f64 = 2.0;

/// Returns the uncertainty of a refined estimate, with standard errors, confidence intervals and correlations that hold for
/// correlated residuals. `problem` is the one that it was refined on. No standard error decreases. The uncertainty is
/// returned unchanged if the residuals pass the whiteness test, were not tested, or no standard error grows.
#[must_use]
pub fn robust_uncertainty(problem: &Problem, refined: &Refined) -> Uncertainty {
    let own = &refined.uncertainty;
    let is_colored = own.whiteness.iter().flatten().any(|of| !of.is_white);
    is_colored.then(|| sandwich(problem, refined)).flatten().unwrap_or_else(|| own.clone())
}

/// Returns the uncertainty by the sandwich estimate; `None` if no standard error grows or the covariance is not finite.
fn sandwich(problem: &Problem, refined: &Refined) -> Option<Uncertainty> {
    let Refined { values, uncertainty: own, at_bound, .. } = refined;
    let (fit, space) = (Fit::new(problem), problem.space().free());
    let moves = |n: &usize| at_bound[*n].is_none() || space[*n].is_idle(values[*n]);
    let moving: Vec<usize> = (0..space.len()).filter(moves).collect();
    let states: Vec<usize> = (space.len()..fit.unknowns).collect();
    let sigma = refined.weights.clone();
    let (matrix, _) = fit.weighted(&fit.normal(&fit.at(values, &refined.initial)), &sigma);
    let (information, gain) = marginal(&matrix, &moving, &states);
    let (inverse, ..) = invert(&information);
    let middle = middle(&fit, refined, &sigma);
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
        ..own.clone()
    })
}

/// Returns Ω, the inner matrix of the sandwich, for all unknowns.
fn middle(fit: &Fit<'_>, refined: &Refined, sigma: &Sigma) -> DMatrix<f64> {
    let of = |recording: usize| {
        let unknowns = fit.unknowns_of(recording);
        let axes = fit.problem.space().free().len();
        let own: Vec<usize> = unknowns.iter().copied().filter(|n| *n < axes).collect();
        let initial = refined.initial[recording];
        let case = Case { problem: fit.problem, recording, own: &own, values: &refined.values, initial };
        let noise = noise(&case, refined.sigmas[recording]);
        let [current, speed] = shaped_products(&case, &[0, 1].map(|channel: usize| noise[channel].0.clone()));
        let weight = |channel: usize| noise[channel].1 / sigma[recording][channel].powi(4);
        (unknowns, current * weight(0) + speed * weight(1))
    };
    let all: Vec<_> = (0..fit.problem.signals().len()).into_par_iter().map(of).collect();
    let mut total = DMatrix::zeros(fit.unknowns, fit.unknowns);
    for (unknowns, products) in all {
        for (a, &row) in unknowns.iter().enumerate() {
            for (b, &column) in unknowns.iter().enumerate() {
                total[(row, column)] += products[(a, b)];
            }
        }
    }
    total
}

/// Returns the autoregression of the residuals of each channel: its coefficients and the variance of its innovations, which
/// is zero for a channel that was not measured. `sigma` holds the root mean square of the residuals.
fn noise(case: &Case<'_>, sigma: [f64; 2]) -> [(Vec<f64>, f64); 2] {
    let signals = &case.problem.signals()[case.recording];
    let model = case.problem.simulate(case.values, case.recording, case.initial);
    [0, 1].map(|channel| {
        let variance = sigma[channel].powi(2);
        if !signals.has(channel) {
            return (Vec::new(), 0.0);
        }
        // Filtered residuals are correlated even if the model is complete: their variance is divided by the effective
        // sample ratio.
        if signals.effective_sample_ratio < EFFECTIVE_RATIO_MIN {
            return (Vec::new(), variance / signals.effective_sample_ratio);
        }
        let residuals = signals.measured(channel).zip(&model[channel]).enumerate();
        let counting = residuals.filter(|(n, _)| signals.counts(channel, *n));
        let residuals: Vec<f64> = counting.map(|(_, (y, x))| y - x).collect();
        let found = autoregression(&residuals, ORDER_MAX.min(residuals.len() / SAMPLES_PER_ORDER), AKAIKE);
        (found.coefficients, variance * found.innovation)
    })
}
