//! Detection of pulses: runs of one to three samples that differ from those before and after them, while these agree.

use motorfit_core::numeric::{count, order_statistic};
use std::ops::Range;

/// Length of the longest pulse \[samples\].
pub(super) const RUN_MAX: usize = 3;
/// Number of samples that are left out at the end of a signal, in addition to the length of the longest pulse.
const MARGIN: usize = RUN_MAX + 1;

/// Order of a quantile, and that quantile of the magnitude of a standard normal variable.
const QUANTILE: [f64; 2] = [0.2, 0.2533];

/// Criteria of a pulse.
pub(super) struct Pulses {
    /// Smallest deviation from the line between the neighbouring samples.
    pub least: f64,
    /// Largest change from before to after a pulse, as a fraction of its deviation.
    pub agree: f64,
    /// Additional change that is allowed, in units of the signal.
    pub slack: f64,
    /// True if a pulse must exceed twice the slope of the signal at turning points, which look like pulses.
    pub with_turns: bool,
}

impl Pulses {
    /// Returns the pulses of a signal.
    pub(super) fn of(&self, values: &[f64]) -> Vec<Range<usize>> {
        let mut found: Vec<Range<usize>> = Vec::new();
        let may_begin = self.beginnings(values);
        let mut n = RUN_MAX;
        while n + RUN_MAX + MARGIN < values.len() {
            let length = || (1..=RUN_MAX).find(|length| self.is_pulse(values, n..n + length));
            match may_begin[n].then(length).flatten() {
                Some(length) => {
                    found.push(n..n + length);
                    n += length;
                }
                None => n += 1,
            }
        }
        found
    }

    /// Returns true for each sample that is farther than `least` from the line of a pulse of some length that begins there. These
    /// are few, and the loops vectorize.
    fn beginnings(&self, values: &[f64]) -> Vec<bool> {
        let mut far = vec![false; values.len()];
        for length in 1..=RUN_MAX {
            let part = 1.0 / count(length + 1);
            let ends = values[1..].iter().zip(values.get(1 + length..).unwrap_or_default());
            for ((far, before), (first, behind)) in far[1..].iter_mut().zip(values).zip(ends) {
                *far |= (first - (before + part * (behind - before))).abs() > self.least;
            }
        }
        far
    }

    fn is_pulse(&self, values: &[f64], pulse: Range<usize>) -> bool {
        let (before, behind) = (pulse.start - 1, pulse.end);
        let size = pulse.clone().map(|m| (values[m] - level(values, &pulse, m)).abs()).fold(f64::INFINITY, f64::min);
        let [rise, fall] = [values[before] - values[before - 1], values[behind + 1] - values[behind]];
        let turn = if self.with_turns && rise * fall < 0.0 { 2.0 * rise.abs().min(fall.abs()) } else { 0.0 };
        let change = values[behind] - values[before];
        // The values before and after agree directly, or after correction for the slope on both sides.
        let left = change.abs().min((change - 0.5 * (rise + fall) * count(pulse.len() + 1)).abs());
        size > self.least.max(turn) && left < self.agree * size + self.slack
    }
}

/// Returns the value at sample `n` of a pulse by linear interpolation between its neighbours.
pub(super) fn level(values: &[f64], pulse: &Range<usize>, n: usize) -> f64 {
    let part = count(n + 1 - pulse.start) / count(pulse.len() + 1);
    values[pulse.start - 1] + part * (values[pulse.end] - values[pulse.start - 1])
}

/// Returns the standard deviation of the noise of a signal, from a low quantile of its second differences, which is robust for
/// binary signals that switch often.
pub(super) fn noise(values: &[f64]) -> f64 {
    let second = |w: &[f64]| (w[0] - 2.0 * w[1] + w[2]).abs();
    let mut sizes: Vec<f64> = values.windows(3).map(second).collect();
    order_statistic(&mut sizes, QUANTILE[0]) / (QUANTILE[1] * 6_f64.sqrt())
}
