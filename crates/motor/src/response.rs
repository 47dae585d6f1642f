//! Step-response metrics: peak and its time, overshoot, settling time, steady state.
//!
//! Definitions: the steady state is the mean of the last tenth of the samples. The peak is the value of largest magnitude.
//! The overshoot is (peak − steady state)/steady state, at least zero. The settling time is the time of the first sample
//! from which the signal stays within the band.

/// Step-response metrics of one signal. Times are those of the samples \[s\], values in the unit of the signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepResponse {
    /// Value of largest magnitude.
    pub peak: f64,
    /// Time of the peak \[s\].
    pub peak_time_s: f64,
    /// Mean of the last tenth of the samples.
    pub steady_state: f64,
    /// Overshoot (peak − steady state)/steady state \[%\], at least zero; `None` if the steady state is zero.
    pub overshoot_percent: Option<f64>,
    /// Time from which the signal stays within the band around the steady state \[s\]; `None` if it never settles.
    pub settling_time_s: Option<f64>,
}

/// Returns the step-response metrics of `signal` sampled at `time_s` \[s\]; `band` is relative to the steady state (0.02
/// for 2 %).
///
/// Returns `None` if the signal is empty, differs in length from `time_s`, or has values that are not finite.
#[must_use]
pub fn response(time_s: &[f64], signal: &[f64], band: f64) -> Option<StepResponse> {
    if signal.is_empty() || time_s.len() != signal.len() || signal.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let tail = &signal[signal.len() - signal.len().div_ceil(10)..];
    let steady_state = motorfit_core::numeric::mean(tail);
    let at = (0..signal.len()).fold(0, |best, n| if signal[n].abs() > signal[best].abs() { n } else { best });
    let outside = |v: &f64| (v - steady_state).abs() > band * steady_state.abs();
    let settled = signal.iter().rposition(outside).map_or(0, |last| last + 1);
    Some(StepResponse {
        peak: signal[at],
        peak_time_s: time_s[at],
        steady_state,
        overshoot_percent: (steady_state != 0.0).then(|| (100.0 * (signal[at] / steady_state - 1.0)).max(0.0)),
        settling_time_s: time_s.get(settled).copied(),
    })
}
