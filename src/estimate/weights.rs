//! The weights of a fit: σ of each recording and channel, by what the model leaves.
//!
//! Residuals that are noise are weighted by their own σ, which is the maximum-likelihood estimate. Where a model misses
//! something, these weights may sacrifice a channel or a recording: what is fitted badly counts for less and is fitted worse.
//! Balanced weights do not. They minimize the sum of the relative residuals `s/d`, with `s` the rms of the residuals and `d`
//! the standard deviation of the signal. The weight of its majorizing quadratic is `1/(s d)` (D. R. Hunter, K. Lange 2004);
//! it is scaled by the mean of `s/d`, so that noise and misfit are comparable.

use super::normal::{Normal, Sigma};
use super::refined::SMALLEST;
use crate::evaluate::Signals;
use crate::numeric;
use std::sync::Arc;

/// Residuals below this part of a channel's rms are rounding.
const SIGMA_MIN: f64 = 1e-13;

/// Returns the standard deviation of the residuals of each recording and channel, with `freedom` the part of the values that
/// is not taken by unknowns; 1 for a channel that was not measured.
pub(super) fn residual_sigma(signals: &[Arc<Signals>], normal: &Normal, freedom: f64) -> Sigma {
    let of = |(recording, signals): (usize, &Arc<Signals>)| {
        [0, 1].map(|channel| {
            if !signals.has(channel) {
                return 1.0;
            }
            let count = numeric::count(signals.count(channel));
            let sigma = (normal.squares(recording, channel) / (count * freedom).max(1.0)).sqrt();
            let part = (numeric::count(signals.len()) / count).sqrt();
            sigma.max(SIGMA_MIN * part * signals.rms(channel)).max(SMALLEST)
        })
    };
    signals.iter().enumerate().map(of).collect()
}

/// Returns balanced weights, from the standard deviations of the residuals.
pub(super) fn balanced(signals: &[Arc<Signals>], residual: &Sigma) -> Sigma {
    let pairs = || signals.iter().zip(residual).flat_map(|(of, s)| [0, 1].map(|channel| (of, channel, s[channel])));
    let far = pairs().filter(|(of, channel, s)| of.is_above_noise(*channel, *s));
    let (sum, count) = far.fold((0.0, 0.0), |(sum, count), (of, channel, s)| {
        let samples = numeric::count(of.count(channel));
        (sum + samples * s / of.deviation(channel), count + samples)
    });
    if count == 0.0 {
        return residual.clone();
    }
    let level = sum / count;
    let of = |(signals, residual): (&Arc<Signals>, &[f64; 2])| {
        [0, 1].map(|channel| {
            let s = residual[channel];
            if !signals.has(channel) {
                return s;
            }
            let noise = signals.noise_share(channel, s);
            (noise * s * s + (1.0 - noise) * level * signals.deviation(channel) * s).sqrt()
        })
    };
    signals.iter().zip(residual).map(of).collect()
}

/// Returns maximum-likelihood weights: the standard deviations of the residuals, and for an extended motor, where these are far
/// above the noise, those of all recordings together. What a model misses it misses in all of them.
pub(super) fn likeliest(signals: &[Arc<Signals>], residual: &Sigma, pooled: Option<[Option<f64>; 2]>) -> Sigma {
    let Some(pooled) = pooled else { return residual.clone() };
    let of = |(signals, own): (&Arc<Signals>, &[f64; 2])| {
        [0, 1].map(|channel| {
            let (Some(pooled), true) = (pooled[channel], signals.has(channel)) else { return own[channel] };
            let noise = signals.noise_share(channel, own[channel]);
            (noise * own[channel].powi(2) + (1.0 - noise) * pooled.powi(2)).sqrt()
        })
    };
    signals.iter().zip(residual).map(of).collect()
}

/// Returns whether some residuals are far above the noise of their signal.
pub(super) fn is_far(signals: &[Arc<Signals>], residual: &Sigma) -> bool {
    let far = |(of, s): (&Arc<Signals>, &[f64; 2])| (0..2).any(|c| of.is_above_noise(c, s[c]));
    signals.iter().zip(residual).any(far)
}

/// Residuals that grow by this factor over balanced ones are sacrificed.
const SACRIFICED: f64 = 1.25;

/// Returns whether residuals far above the noise are much larger than balanced ones.
pub(super) fn is_sacrificed(signals: &[Arc<Signals>], residual: &Sigma, balanced: &Sigma) -> bool {
    let worse = |(of, (s, before)): (&Arc<Signals>, (&[f64; 2], &[f64; 2]))| {
        (0..2).any(|c| of.is_above_noise(c, s[c]) && s[c] > SACRIFICED * before[c])
    };
    signals.iter().zip(residual.iter().zip(balanced)).any(worse)
}
