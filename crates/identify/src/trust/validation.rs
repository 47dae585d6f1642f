//! The judgement of held-out recordings: a result that predicts them far worse than it fits its own is of these alone.

use crate::analysis::Output;
use crate::result::Identification;
use crate::trust_level::TrustLevel::{Check, Poor};
use crate::trust_level::{TrustLevel, TrustReason};
use motorfit_core::setting::Text;
use motorfit_core::text::{decimals, listed};

/// Fit of held-out recordings below that of the fitted ones \[points of percent\], and the ratio of their residual deviations, from which the
/// level is lowered. Both count: the fit of a recording that hardly varies is low by its noise alone, and a larger range may raise the
/// residuals while the fit stays.
const LEVELS: [(TrustLevel, f64, f64); 2] = [(Poor, 20.0, 3.0), (Check, 5.0, 1.5)];

/// Lowers the level of trust if held-out recordings, with the fit \[%\] and the residual deviation of each output, are predicted far worse than
/// those of the fit. `next` is the step that this suggests.
pub(crate) fn judge_validation<M>(
    found: &mut Identification<M>,
    (fit_percent, residual_sigma): (&[Option<f64>], &[Option<f64>]),
    next: impl FnOnce() -> Text,
) {
    let lowered = |output: usize| {
        let at = |list: &[Option<f64>]| list.get(output).copied().flatten();
        let lost = at(&found.fit_percent)? - at(fit_percent)?;
        let ratio = at(residual_sigma)? / at(&found.residual_sigma)?;
        LEVELS.into_iter().find(|(_, points, times)| lost > *points && ratio > *times).map(|(level, ..)| level)
    };
    let outputs: Vec<(usize, TrustLevel)> = (0..found.outputs.len()).filter_map(|n| Some((n, lowered(n)?))).collect();
    let Some(level) = outputs.iter().map(|(_, level)| *level).max_by_key(|level| *level as u8) else { return };
    let one = |(n, _): &(usize, TrustLevel)| {
        let fit = |list: &[Option<f64>]| decimals(list.get(*n).copied().flatten().unwrap_or(f64::NAN).max(0.0), 0);
        let Output { name, .. } = &found.outputs[*n];
        format!("{name} {} % instead of {} %", fit(fit_percent), fit(&found.fit_percent))
    };
    let list: Vec<String> = outputs.iter().map(one).collect();
    let list: Vec<&str> = list.iter().map(String::as_str).collect();
    let message = format!("held-out recordings are fitted worse, {}", listed(&list, "and"));
    let reason = TrustReason { code: "validation", message: message.into() };
    let trust = &mut found.trust;
    if level as u8 > trust.level as u8 || trust.next.is_none() {
        trust.next = Some(next());
        trust.reasons.insert(0, reason);
    } else {
        trust.reasons.push(reason);
    }
    if level as u8 > trust.level as u8 {
        trust.level = level;
    }
}
