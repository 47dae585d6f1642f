//! What a model is worth: Schwarz's criterion (BIC, 1978) with as many samples as the residuals have independent ones:
//! `N (1 − ρ)/(1 + ρ)` for a correlation ρ from sample to sample (G. V. Bayley, J. M. Hammersley 1946). Residuals that a
//! wrong model leaves are correlated, and counted as they are they would speak for any extension at all.

use crate::estimate::Refined;
use crate::evaluate::{Problem, Signals};
use crate::motor::{Extension, Space};
use crate::numeric;
use std::sync::Arc;

/// A criterion must be lower by this much: odds of e³ = 20 to 1.
const GAIN: f64 = 6.0;
/// And the residuals of some channel by this part: below it nobody would notice.
const SMALLEST: f64 = 0.01;

pub(super) struct Fit {
    pub with: Vec<Extension>,
    pub space: Space,
    pub refined: Refined,
    /// Independent samples of each recording and channel.
    pub independent: Vec<[f64; 2]>,
}

/// Whether a model is worth being taken in place of another.
pub(super) fn is_worth(from: &Fit, to: &Fit) -> bool {
    let ratios =
        from.refined.sigma.iter().zip(&to.refined.sigma).filter_map(|(before, after)| Some((*after)? / (*before)?));
    gain(from, to) < -GAIN && ratios.into_iter().any(|ratio| ratio < 1.0 - SMALLEST)
}

/// How many independent samples the residuals of each recording and channel have.
pub(super) fn independent(problem: &Problem, refined: &Refined) -> Vec<[f64; 2]> {
    let of = |(recording, initial): (usize, &[f64; 2])| {
        let signals = &problem.signals()[recording];
        let model = problem.simulate(&refined.values, recording, *initial);
        [0, 1].map(|channel| {
            if !signals.has(channel) {
                return 0.0;
            }
            let residuals: Vec<f64> = signals.measured(channel).zip(&model[channel]).map(|(y, x)| y - x).collect();
            let squares: f64 = residuals.iter().map(|e| e * e).sum();
            let products: f64 = residuals.windows(2).map(|e| e[0] * e[1]).sum();
            let correlation = if squares > 0.0 { (products / squares).clamp(0.0, 0.9999) } else { 0.0 };
            let count = numeric::count(signals.count(channel));
            count * (1.0 - correlation) / (1.0 + correlation)
        })
    };
    refined.initial.iter().enumerate().map(of).collect()
}

/// Schwarz's criterion of a model less that of another, with the independent samples of that which fits a channel better.
pub(super) fn gain(from: &Fit, to: &Fit) -> f64 {
    let mut gain = 0.0;
    let mut samples: f64 = 0.0;
    let recordings =
        from.refined.sigmas.iter().zip(&to.refined.sigmas).zip(from.independent.iter().zip(&to.independent));
    for ((before, after), counts) in recordings {
        for channel in 0..2 {
            let count = if after[channel] < before[channel] { counts.1[channel] } else { counts.0[channel] };
            if count > 0.0 {
                gain += 2.0 * count * (after[channel] / before[channel]).ln();
                samples += count;
            }
        }
    }
    let more = numeric::count(to.space.free().len()) - numeric::count(from.space.free().len());
    gain + more * samples.max(std::f64::consts::E).ln()
}

/// Residuals of more σ than these of the noise are not noise.
const FAR: f64 = 2.0;

/// Whether what a refinement leaves is far above the noise: a better optimum may be elsewhere.
pub(super) fn is_far(problem: &Problem, refined: &Refined) -> bool {
    let far = |(signals, sigma): (&Arc<Signals>, &[f64; 2])| {
        (0..2).any(|channel| signals.has(channel) && sigma[channel] > FAR * signals.noise(channel))
    };
    problem.signals().iter().zip(&refined.sigmas).any(far)
}
