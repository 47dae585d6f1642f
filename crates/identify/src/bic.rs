//! Comparison of models by BIC (G. Schwarz, 1978) at the effective sample size of the squared residuals,
//! `N (1 − ρ²)/(1 + ρ²)` for a correlation ρ at lag 1 (G. V. Bayley, J. M. Hammersley, 1946). The residuals of an incomplete
//! model are correlated; with the full sample size almost any extension would be selected.
//!
//! Both models of a comparison are weighted by the same σ, that of the better one, so that a model never has a higher weighted
//! sum of squares than one that it contains.

use motorfit_core::numeric;
use motorfit_estimate::{Fitted, Refined};

/// Smallest decrease of BIC at which the larger model is preferred: odds of e³ = 20 to 1.
const GAIN: f64 = 6.0;
/// Smallest relative decrease of the residual deviation of some output that matters in practice.
const SMALLEST: f64 = 0.01;

/// A fitted model with optional terms of type `T`, and what else the family of models keeps of it.
#[derive(Clone)]
pub(crate) struct Fit<T, S> {
    /// Optional terms of the model.
    pub with: Vec<T>,
    pub space: S,
    pub refined: Refined,
    /// Number of free parameters.
    pub free: usize,
    /// Ratio of the effective sample size of the squared residuals to the number of values.
    pub effective: f64,
    /// Number of measured values.
    pub count: f64,
    /// Minus twice the log-likelihood of the residuals as first-order autoregressions, up to a constant: the sum of
    /// `N ln((1 − ρ²) σ²)` over recordings and outputs.
    pub deviance: f64,
}

impl<T: Clone, S> Fit<T, S> {
    pub(crate) fn new(with: &[T], space: S, problem: &dyn Fitted, refined: Refined) -> Self {
        let residuals = Residuals::of(problem, &refined);
        let (effective, count) = residuals.effective_for_squares();
        let deviance = residuals.deviance();
        let free = refined.values.len();
        Self { with: with.to_vec(), space, refined, free, effective, count, deviance }
    }
}

/// Returns true if a model is preferred to a smaller one, by the BIC of its residuals or of their innovations, and if the
/// residual deviation of some output decreases by [`SMALLEST`]. Strongly correlated residuals, as of a slow motor whose model
/// lacks another effect, have a small effective sample size, but their innovations can still show the effect.
pub(crate) fn is_preferred<T, S>(from: &Fit<T, S>, to: &Fit<T, S>) -> bool {
    let ratios =
        from.refined.sigma.iter().zip(&to.refined.sigma).filter_map(|(before, after)| Some((*after)? / (*before)?));
    let gains = [gain(from, to), gain_of_innovations(from, to)];
    gains.iter().any(|gain| *gain < -GAIN) && ratios.into_iter().any(|ratio| ratio < 1.0 - SMALLEST)
}

/// Returns the BIC of `to` minus that of `from`, with the residuals as first-order autoregressions.
fn gain_of_innovations<T, S>(from: &Fit<T, S>, to: &Fit<T, S>) -> f64 {
    let more = additional(from, to);
    to.deviance - from.deviance + more * from.count.max(std::f64::consts::E).ln()
}

/// Number of values, mean square and lag-1 correlation of the residuals of each recording and output.
struct Residuals(Vec<[f64; 3]>);

/// Standard deviation of rounding errors relative to that of the signal.
const ROUNDING: f64 = 1e-8;

impl Residuals {
    fn of(problem: &dyn Fitted, refined: &Refined) -> Self {
        let mut all = Vec::new();
        for recording in 0..refined.initial.len() {
            let residuals = problem.all_residuals(&refined.values, recording, &refined.initial[recording]);
            let measured = residuals.iter().enumerate().filter(|(output, _)| problem.has((recording, *output)));
            for (output, residuals) in measured {
                let of = (recording, output);
                let squares: f64 = residuals.iter().map(|e| e * e).sum();
                let products: f64 = residuals.windows(2).map(|e| e[0] * e[1]).sum();
                let correlation = if squares > 0.0 { (products / squares).clamp(0.0, 0.9999) } else { 0.0 };
                let count = numeric::count(problem.count(of));
                let rounding = ROUNDING * problem.deviation(of);
                all.push([count, squares / numeric::count(residuals.len()) + rounding * rounding, correlation]);
            }
        }
        Self(all)
    }

    /// Returns the effective sample ratio over all outputs and the number of values; `share` maps a lag-1 correlation to the
    /// ratio.
    fn effective_ratio(&self, share: impl Fn(f64) -> f64) -> (f64, f64) {
        let all: f64 = self.0.iter().map(|[count, ..]| count).sum();
        let independent: f64 = self.0.iter().map(|[count, _, correlation]| count * share(*correlation)).sum();
        (if all > 0.0 { independent / all } else { 1.0 }, all)
    }

    fn effective_for_squares(&self) -> (f64, f64) {
        self.effective_ratio(|correlation| (1.0 - correlation.powi(2)) / (1.0 + correlation.powi(2)))
    }

    fn deviance(&self) -> f64 {
        let of = |[count, square, correlation]: &[f64; 3]| {
            count * ((1.0 - correlation.powi(2)) * square).max(f64::MIN_POSITIVE).ln()
        };
        self.0.iter().map(of).sum()
    }
}

/// Returns the effective sample ratio for means of residuals, `(1 − ρ)/(1 + ρ)`, and the number of measured values.
pub(crate) fn effective(problem: &dyn Fitted, refined: &Refined) -> (f64, f64) {
    Residuals::of(problem, refined).effective_ratio(|correlation| (1.0 - correlation) / (1.0 + correlation))
}

/// Returns the BIC of `to` minus that of `from`: negative if `to` is better.
pub(crate) fn gain<T, S>(from: &Fit<T, S>, to: &Fit<T, S>) -> f64 {
    let under = |by: &Fit<T, S>| {
        by.effective * (to.refined.weighted(&by.refined.weights) - from.refined.weighted(&by.refined.weights))
    };
    // If the two weightings disagree, the sums of squares count as equal.
    let (by, change) = match (under(from), under(to)) {
        (before, after) if before < 0.0 && after < 0.0 => (to, after),
        (before, after) if before > 0.0 && after > 0.0 => (from, before),
        _ => (to, 0.0),
    };
    let more = additional(from, to);
    change + more * (by.effective * by.count).max(std::f64::consts::E).ln()
}

/// Returns the number of parameters that `to` has more than `from`.
pub(crate) fn additional<T, S>(from: &Fit<T, S>, to: &Fit<T, S>) -> f64 {
    numeric::count(to.free) - numeric::count(from.free)
}

/// Returns true if the residuals of some output are far above its noise, so that a better optimum may exist.
pub(crate) fn is_far(problem: &dyn Fitted, refined: &Refined) -> bool {
    let far = |(recording, sigma): (usize, &Vec<f64>)| {
        (0..problem.outputs()).any(|output| problem.is_above_noise((recording, output), sigma[output]))
    };
    refined.sigmas.iter().enumerate().any(far)
}
