//! Comparison of models by Schwarz's criterion (BIC, 1978) with as many samples as the squares of the residuals have independent
//! ones: `N (1 − ρ²)/(1 + ρ²)` for a correlation ρ from sample to sample (G. V. Bayley, J. M. Hammersley 1946). Residuals that a
//! wrong model leaves are correlated; counted as they are, they would favor any extension.
//!
//! Both sides of a comparison are weighted by the same σ, that of the model which fits better: a model that contains
//! another then never comes out worse by its sum of squares.

use crate::estimate::Refined;
use crate::evaluate::{Problem, Signals};
use crate::motor::{Extension, Space};
use crate::numeric;
use std::sync::Arc;

/// A criterion must be lower by this much: odds of e³ = 20 to 1.
const GAIN: f64 = 6.0;
/// And the residuals of some channel by this part: below it nobody would notice.
const SMALLEST: f64 = 0.01;

/// A model with its fit.
#[derive(Clone)]
pub(super) struct Fit {
    pub with: Vec<Extension>,
    pub space: Space,
    pub refined: Refined,
    /// The part of the samples that are independent.
    pub effective: f64,
    /// Measured values.
    pub count: f64,
    /// Minus twice the logarithm of the likelihood of the residuals as first-order autoregressions: the sum of `N ln((1 − ρ²)
    /// σ²)`
    /// over recordings and channels.
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

/// Returns whether a model is to be taken in place of a smaller one: by the squares of its residuals, or by what is left of them
/// when each is predicted by the one before. Residuals of a slow motor that lacks something else hardly have independent samples,
/// yet show an effect in how they move.
pub(super) fn is_worth(from: &Fit, to: &Fit) -> bool {
    let ratios =
        from.refined.sigma.iter().zip(&to.refined.sigma).filter_map(|(before, after)| Some((*after)? / (*before)?));
    let gains = [gain(from, to), gain_of_innovations(from, to)];
    gains.iter().any(|gain| *gain < -GAIN) && ratios.into_iter().any(|ratio| ratio < 1.0 - SMALLEST)
}

/// Returns Schwarz's criterion of a model less that of another, their residuals taken as first-order autoregressions.
fn gain_of_innovations(from: &Fit, to: &Fit) -> f64 {
    let more = numeric::count(to.space.free().len()) - numeric::count(from.space.free().len());
    to.deviance - from.deviance + more * from.count.max(std::f64::consts::E).ln()
}

/// The residuals of each recording and channel: their number, their mean square and their correlation from sample to sample.
struct Residuals(Vec<[f64; 3]>);

/// Residuals of this part of the signal are rounding.
const ROUNDING: f64 = 1e-8;

impl Residuals {
    fn of(problem: &Problem, refined: &Refined) -> Self {
        let mut all = Vec::new();
        for (recording, initial) in refined.initial.iter().enumerate() {
            let signals = &problem.signals()[recording];
            let model = problem.simulate(&refined.values, recording, *initial);
            for channel in (0..2).filter(|channel| signals.has(*channel)) {
                let residuals: Vec<f64> = signals.measured(channel).zip(&model[channel]).map(|(y, x)| y - x).collect();
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

    /// Returns the part of the values that are independent, by the part of them that a correlation leaves, and their number.
    fn independent(&self, share: impl Fn(f64) -> f64) -> (f64, f64) {
        let all: f64 = self.0.iter().map(|[count, ..]| count).sum();
        let independent: f64 = self.0.iter().map(|[count, _, correlation]| count * share(*correlation)).sum();
        (if all > 0.0 { independent / all } else { 1.0 }, all)
    }

    fn effective_for_squares(&self) -> (f64, f64) {
        self.independent(|correlation| (1.0 - correlation.powi(2)) / (1.0 + correlation.powi(2)))
    }

    fn deviance(&self) -> f64 {
        let of = |[count, square, correlation]: &[f64; 3]| {
            count * ((1.0 - correlation.powi(2)) * square).max(f64::MIN_POSITIVE).ln()
        };
        self.0.iter().map(of).sum()
    }
}

/// Returns the part of the measured values that are independent where means of residuals count, `(1 − ρ)/(1 + ρ)`, and the number
/// of values.
pub(super) fn effective(problem: &Problem, refined: &Refined) -> (f64, f64) {
    Residuals::of(problem, refined).independent(|correlation| (1.0 - correlation) / (1.0 + correlation))
}

/// Returns Schwarz's criterion of a model less that of another.
pub(super) fn gain(from: &Fit, to: &Fit) -> f64 {
    let under = |by: &Fit| {
        by.effective * (to.refined.weighted(&by.refined.weights) - from.refined.weighted(&by.refined.weights))
    };
    // Where each is better by its own weights, neither is.
    let (by, change) = match (under(from), under(to)) {
        (before, after) if before < 0.0 && after < 0.0 => (to, after),
        (before, after) if before > 0.0 && after > 0.0 => (from, before),
        _ => (to, 0.0),
    };
    let more = numeric::count(to.space.free().len()) - numeric::count(from.space.free().len());
    change + more * (by.effective * by.count).max(std::f64::consts::E).ln()
}

/// Returns whether what a refinement leaves is far above the noise: a better optimum may be elsewhere.
pub(super) fn is_far(problem: &Problem, refined: &Refined) -> bool {
    let far = |(signals, sigma): (&Arc<Signals>, &[f64; 2])| {
        (0..2).any(|channel| signals.is_above_noise(channel, sigma[channel]))
    };
    problem.signals().iter().zip(&refined.sigmas).any(far)
}
