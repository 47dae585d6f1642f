//! Pulses: runs of one to three samples that differ from those before and behind them, where these agree.

use crate::numeric::{count, order_statistic};
use std::ops::Range;

/// The longest pulse \[samples\].
pub(super) const RUN_MAX: usize = 3;
/// Samples at each end that are looked at beside a pulse only.
const MARGIN: usize = RUN_MAX + 1;

/// A quantile of magnitudes, and that of a normal distribution.
const QUANTILE: [f64; 2] = [0.2, 0.2533];

/// The pulses that are looked for.
pub(super) struct Pulses {
    /// The least deviation from a line between the samples around.
    pub least: f64,
    /// The change from before a pulse to behind it is below this part of its deviation, and so much more.
    pub agree: f64,
    pub slack: f64,
    /// The turn of a signal that goes up and down looks like a pulse: then one is as large as two steps of it.
    pub with_turns: bool,
}

impl Pulses {
    /// Returns the pulses of a signal.
    pub(super) fn of(&self, values: &[f64]) -> Vec<Range<usize>> {
        let mut found: Vec<Range<usize>> = Vec::new();
        let mut n = RUN_MAX;
        while n + RUN_MAX + MARGIN < values.len() {
            match (1..=RUN_MAX).find(|length| self.is_pulse(values, n..n + length)) {
                Some(length) => {
                    found.push(n..n + length);
                    n += length;
                }
                None => n += 1,
            }
        }
        found
    }

    fn is_pulse(&self, values: &[f64], pulse: Range<usize>) -> bool {
        let (before, behind) = (pulse.start - 1, pulse.end);
        // Most samples are none, as their first one says.
        if (values[pulse.start] - level(values, &pulse, pulse.start)).abs() <= self.least {
            return false;
        }
        let size = pulse.clone().map(|m| (values[m] - level(values, &pulse, m)).abs()).fold(f64::INFINITY, f64::min);
        let [rise, fall] = [values[before] - values[before - 1], values[behind + 1] - values[behind]];
        let turn = if self.with_turns && rise * fall < 0.0 { 2.0 * rise.abs().min(fall.abs()) } else { 0.0 };
        let change = values[behind] - values[before];
        // The same value, or as much more as the slope on both sides makes.
        let left = change.abs().min((change - 0.5 * (rise + fall) * count(pulse.len() + 1)).abs());
        size > self.least.max(turn) && left < self.agree * size + self.slack
    }
}

/// Returns the value at sample `n` of a pulse by a line between those around it.
pub(super) fn level(values: &[f64], pulse: &Range<usize>, n: usize) -> f64 {
    let part = count(n + 1 - pulse.start) / count(pulse.len() + 1);
    values[pulse.start - 1] + part * (values[pulse.end] - values[pulse.start - 1])
}

/// The noise of a signal by its smallest second differences: a binary one that switches often has some of 0 too.
pub(super) fn noise(values: &[f64]) -> f64 {
    let second = |w: &[f64]| (w[0] - 2.0 * w[1] + w[2]).abs();
    let mut sizes: Vec<f64> = values.windows(3).map(second).collect();
    order_statistic(&mut sizes, QUANTILE[0]) / (QUANTILE[1] * 6_f64.sqrt())
}
