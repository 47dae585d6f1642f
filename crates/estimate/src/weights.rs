//! Weights of a fit: σ of each recording and channel, from its residuals.
//!
//! Residuals that are noise are weighted by their own σ, which is the maximum-likelihood estimate. With a model error these
//! weights may sacrifice a channel or a recording: one that is fitted badly gets a smaller weight and is fitted worse.
//! Balanced weights avoid this. They minimize the sum of the relative residuals `s/d`, with `s` the rms of the residuals
//! and `d` the standard deviation of the signal. The weight of its majorizing quadratic is `1/(s d)` (D. R. Hunter, K.
//! Lange 2004); it is scaled by the mean of `s/d`, so that noise and misfit are comparable.

use super::normal::{Normal, Sigma};
use super::refined::SMALLEST;
use motorfit_core::numeric;
use motorfit_evaluate::Signals;
use std::sync::Arc;

/// Smallest σ as a fraction of the channel's rms: smaller residuals are rounding errors.
const SIGMA_MIN: f64 = 1e-13;

/// Returns the standard deviation of the residuals of each recording and channel; 1 for a channel that was not measured.
/// `freedom` is the ratio of the degrees of freedom to the measured values.
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

/// Returns balanced weights (as σ), from the standard deviations of the residuals.
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

/// Returns maximum-likelihood weights (as σ): the standard deviations of the residuals. For an extended motor the σ of
/// residuals far above the noise is that of all recordings together, because a model error acts on all of them.
pub(super) fn maximum_likelihood(
    signals: &[Arc<Signals>],
    residual: &Sigma,
    pooled: Option<[Option<f64>; 2]>,
) -> Sigma {
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

/// Returns true if some residuals are far above the noise of their signal.
pub(super) fn is_far(signals: &[Arc<Signals>], residual: &Sigma) -> bool {
    let far = |(of, s): (&Arc<Signals>, &[f64; 2])| (0..2).any(|c| of.is_above_noise(c, s[c]));
    signals.iter().zip(residual).any(far)
}

/// Ratio of residuals to those under balanced weights from which a channel is sacrificed.
const SACRIFICED: f64 = 1.25;

/// Returns true if residuals far above the noise are much larger than under balanced weights.
pub(super) fn is_sacrificed(signals: &[Arc<Signals>], residual: &Sigma, balanced: &Sigma) -> bool {
    let worse = |(of, (s, before)): (&Arc<Signals>, (&[f64; 2], &[f64; 2]))| {
        (0..2).any(|c| of.is_above_noise(c, s[c]) && s[c] > SACRIFICED * before[c])
    };
    signals.iter().zip(residual.iter().zip(balanced)).any(worse)
}
