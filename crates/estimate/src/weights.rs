//! Weights of a fit: σ of each recording and output, from its residuals.
//!
//! Residuals that are noise are weighted by their own σ, which is the maximum-likelihood estimate. With a model error these
//! weights may sacrifice an output or a recording: one that is fitted badly gets a smaller weight and is fitted worse.
//! Balanced weights avoid this. They minimize the sum of the relative residuals `s/d`, with `s` the rms of the residuals
//! and `d` the standard deviation of the signal. The weight of its majorizing quadratic is `1/(s d)` (D. R. Hunter, K.
//! Lange 2004); it is scaled by the mean of `s/d`, so that noise and misfit are comparable.

use super::fit::{Fit, Normal};
use super::fitted::Sigma;
use super::refined::SMALLEST;
use motorfit_core::numeric::count;

/// Smallest σ as a fraction of the output's rms: smaller residuals are rounding errors.
const SIGMA_MIN: f64 = 1e-13;

/// Returns the first σ of each output.
pub(super) fn first_sigma(fit: &Fit<'_>) -> Sigma {
    fit.each(|of| first(fit.problem.noise(of), fit.problem.rms(of)))
}

/// Returns the first σ of an output: the noise estimated from the recording, at least 1e-4 of the signal's rms.
pub(super) fn first(noise: f64, rms: f64) -> f64 {
    noise.max(1e-4 * rms).max(SMALLEST)
}

/// Returns the standard deviation of each output, so that all outputs count alike.
pub(super) fn deviations(fit: &Fit<'_>) -> Sigma {
    fit.each(|of| fit.problem.deviation(of))
}

/// Returns the standard deviation of the residuals of each recording and output. `freedom` is the ratio of the degrees of
/// freedom to the measured values.
pub(super) fn residual_sigma(fit: &Fit<'_>, normal: &Normal, freedom: f64) -> Sigma {
    fit.each(|of| {
        let counting = count(fit.problem.count(of));
        let sigma = (normal.squares(of) / (counting * freedom).max(1.0)).sqrt();
        let part = (count(fit.problem.samples(of.0)) / counting).sqrt();
        sigma.max(SIGMA_MIN * part * fit.problem.rms(of)).max(SMALLEST)
    })
}

/// Returns balanced weights (as σ), from the standard deviations of the residuals.
pub(super) fn balanced(fit: &Fit<'_>, residual: &Sigma) -> Sigma {
    let problem = fit.problem;
    let far = fit.measured().map(|of| (of, residual[of.0][of.1])).filter(|(of, s)| problem.is_above_noise(*of, *s));
    let (sum, samples) = far.fold((0.0, 0.0), |(sum, all), (of, s)| {
        let samples = count(problem.count(of));
        (sum + samples * s / problem.deviation(of), all + samples)
    });
    if samples == 0.0 {
        return residual.clone();
    }
    let level = sum / samples;
    fit.each(|of| {
        let s = residual[of.0][of.1];
        let noise = problem.noise_share(of, s);
        (noise * s * s + (1.0 - noise) * level * problem.deviation(of) * s).sqrt()
    })
}

/// Returns maximum-likelihood weights (as σ): the standard deviations of the residuals. The σ of residuals far above the noise is
/// that of all recordings together, `pooled`, because a model error acts on all of them.
pub(super) fn maximum_likelihood(fit: &Fit<'_>, residual: &Sigma, pooled: &[Option<f64>]) -> Sigma {
    fit.each(|of| {
        let own = residual[of.0][of.1];
        let noise = fit.problem.noise_share(of, own);
        pooled[of.1].map_or(own, |pooled| (noise * own.powi(2) + (1.0 - noise) * pooled.powi(2)).sqrt())
    })
}

/// Returns true if some residuals are far above the noise of their signal.
pub(super) fn is_far(fit: &Fit<'_>, residual: &Sigma) -> bool {
    fit.measured().any(|of| fit.problem.is_above_noise(of, residual[of.0][of.1]))
}

/// Ratio of residuals to those under balanced weights from which an output is sacrificed.
const SACRIFICED: f64 = 1.25;

/// Returns true if residuals far above the noise are much larger than under balanced weights.
pub(super) fn is_sacrificed(fit: &Fit<'_>, residual: &Sigma, balanced: &Sigma) -> bool {
    fit.measured().any(|of| {
        let (s, before) = (residual[of.0][of.1], balanced[of.0][of.1]);
        fit.problem.is_above_noise(of, s) && s > SACRIFICED * before
    })
}
