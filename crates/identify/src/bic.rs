//! Comparison of models by BIC (G. Schwarz, 1978) at the effective sample size of the squared residuals,
//! `N (1 − ρ²)/(1 + ρ²)` for a correlation ρ at lag 1 (G. V. Bayley, J. M. Hammersley, 1946). The residuals of an incomplete
//! model are correlated; with the full sample size almost any extension would be selected.
//!
//! Both models of a comparison are weighted by the same σ, that of the better one, so that a model never has a higher weighted
//! sum of squares than one that it contains.

use motorfit_core::numeric;
use motorfit_estimate::Refined;
use motorfit_evaluate::{Problem, Signals};
use motorfit_motor::{Extension, Space};
use std::sync::Arc;

/// Smallest decrease of BIC at which the larger model is preferred: odds of e³ = 20 to 1.
const GAIN: f64 = 6.0;
/// Smallest relative decrease of the residual deviation of some channel that matters in practice.
const SMALLEST: f64 = 0.01;

/// A fitted model.
#[derive(Clone)]
pub(super) struct Fit {
    pub with: Vec<Extension>,
    pub space: Space,
    pub refined: Refined,
    /// Ratio of the effective sample size of the squared residuals to the number of values.
    pub effective: f64,
    /// Number of measured values.
    pub count: f64,
    /// Minus twice the log-likelihood of the residuals as first-order autoregressions, up to a constant: the sum of
    /// `N ln((1 − ρ²) σ²)` over recordings and channels.
    pub deviance: f64,
}

impl Fit {
    pub(super) fn new(with: &[Extension], plain: &Problem, refined: Refined) -> Self {
        let residuals = Residuals::of(plain, &refined);
        let (effective, count) = residuals.effective_for_squares();
        let deviance = residuals.deviance();
        Self { with: with.to_vec(), space: plain.space().clone(), refined, effective, count, deviance }
    }
}

/// Returns true if a model is preferred to a smaller one, by the BIC of its residuals or of their innovations, and if the
/// residual deviation of some channel decreases by [`SMALLEST`]. Strongly correlated residuals, as of a slow motor whose model
/// lacks another effect, have a small effective sample size, but their innovations can still show the effect.
pub(super) fn is_preferred(from: &Fit, to: &Fit) -> bool {
    let ratios =
        from.refined.sigma.iter().zip(&to.refined.sigma).filter_map(|(before, after)| Some((*after)? / (*before)?));
    let gains = [gain(from, to), gain_of_innovations(from, to)];
    gains.iter().any(|gain| *gain < -GAIN) && ratios.into_iter().any(|ratio| ratio < 1.0 - SMALLEST)
}

/// Returns the BIC of `to` minus that of `from`, with the residuals as first-order autoregressions.
fn gain_of_innovations(from: &Fit, to: &Fit) -> f64 {
    let more = numeric::count(to.space.free().len()) - numeric::count(from.space.free().len());
    to.deviance - from.deviance + more * from.count.max(std::f64::consts::E).ln()
}

/// Number of values, mean square and lag-1 correlation of the residuals of each recording and channel.
struct Residuals(Vec<[f64; 3]>);

/// Standard deviation of rounding errors relative to that of the signal.
const ROUNDING: f64 = 1e-8;

impl Residuals {
    fn of(problem: &Problem, refined: &Refined) -> Self {
        let mut all = Vec::new();
        for recording in 0..refined.initial.len() {
            let signals = &problem.signals()[recording];
            let model = problem.simulate(&refined.values, recording, refined.state(recording));
            for channel in (0..2).filter(|channel| signals.has(*channel)) {
                let residuals = signals.measured(channel).zip(&model[channel]).enumerate();
                let own = residuals.filter(|(n, _)| signals.is_measured(channel, *n));
                let residuals: Vec<f64> = own.map(|(_, (y, x))| y - x).collect();
                let squares: f64 = residuals.iter().map(|e| e * e).sum();
                let products: f64 = residuals.windows(2).map(|e| e[0] * e[1]).sum();
                let correlation = if squares > 0.0 { (products / squares).clamp(0.0, 0.9999) } else { 0.0 };
                let count = numeric::count(signals.count(channel));
                let rounding = ROUNDING * signals.deviation(channel);
                all.push([count, squares / numeric::count(residuals.len()) + rounding * rounding, correlation]);
            }
        }
        Self(all)
    }

    /// Returns the effective sample ratio over all channels and the number of values; `share` maps a lag-1 correlation to the
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
pub(super) fn effective(problem: &Problem, refined: &Refined) -> (f64, f64) {
    Residuals::of(problem, refined).effective_ratio(|correlation| (1.0 - correlation) / (1.0 + correlation))
}

/// Returns the BIC of `to` minus that of `from`: negative if `to` is better.
pub(super) fn gain(from: &Fit, to: &Fit) -> f64 {
    let under = |by: &Fit| {
        by.effective * (to.refined.weighted(&by.refined.weights) - from.refined.weighted(&by.refined.weights))
    };
    // If the two weightings disagree, the sums of squares count as equal.
    let (by, change) = match (under(from), under(to)) {
        (before, after) if before < 0.0 && after < 0.0 => (to, after),
        (before, after) if before > 0.0 && after > 0.0 => (from, before),
        _ => (to, 0.0),
    };
    let more = numeric::count(to.space.free().len()) - numeric::count(from.space.free().len());
    change + more * (by.effective * by.count).max(std::f64::consts::E).ln()
}

/// Returns true if the residuals of some channel are far above its noise, so that a better optimum may exist.
pub(super) fn is_far(problem: &Problem, refined: &Refined) -> bool {
    let far = |(signals, sigma): (&Arc<Signals>, &Vec<f64>)| {
        (0..2).any(|channel| signals.is_above_noise(channel, sigma[channel]))
    };
    problem.signals().iter().zip(&refined.sigmas).any(far)
}
