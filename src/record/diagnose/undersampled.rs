//! A voltage that changes faster than it is sampled: throughout a recording, or in a stretch of it, as a chirp that goes on
//! beyond what its samples resolve.

use super::{Finding, Quantity, View, text};
use crate::numeric::{count, standard_deviation};
use crate::text::significant;
use std::ops::Range;

/// Standard deviation of the differences over that of the voltage, from which on it is undersampled throughout.
const RESTLESS: f64 = 0.7;
/// Samples of the window in which a stretch begins: three periods of the slowest sine that counts as undersampled.
const WINDOW: usize = 24;
/// Samples from one window to the next.
const STRIDE: usize = 4;
/// Mean squared difference over twice the variance, `1 − cos(2π f h)` of a sine of frequency `f` with the period `h`: that of
/// a sixth of the sampling rate, where a line between samples loses 9 % of the amplitude.
const FAST: f64 = 0.5;
/// Standard deviation of the voltage in the window over that of the recording, below which it counts as constant with noise.
const QUIET: f64 = 0.25;
/// Differences of this part of the range and less are those of a voltage that is held for several samples.
const HELD: f64 = 1e-3;
/// Samples of constant voltage that end a stretch.
const PAUSE: usize = 4 * WINDOW;
/// The part of the recording's variance and of its samples that must be left.
const LEFT: f64 = 0.25;

pub(super) fn undersampled(view: &View<'_>, findings: &mut Vec<Finding>) {
    let stretches = stretches(view);
    if stretches.is_empty() {
        findings.extend(throughout(view));
        return;
    }
    let [from, to] = [stretches[0].start, stretches[0].end - 1].map(|n| significant(view.time[n], 6));
    let message =
        format!("the voltage changes fast from {from} s to {to} s: what it was between samples is not known there");
    let remedy = text!("Record faster, or leave it out: " [Mask = "auto"] ".");
    let finding = Finding::new("undersampled_input", Quantity::Voltage, message, remedy);
    findings.push(finding.mention_if(true).at(stretches));
}

/// A voltage that changes from sample to sample. One that is held for two samples or more between its changes, as a
/// binary sequence is, is resolved however often it switches.
fn throughout(view: &View<'_>) -> Option<Finding> {
    // A constant voltage with noise is none.
    if view.restless <= RESTLESS || view.volts_spread < 0.1 || view.len() < 10 {
        return None;
    }
    let single = view.constant_inputs.iter().filter(|s| s.samples.len() == 1).count();
    // Of a binary sequence that may switch at every sample a quarter of the samples stand alone.
    let share = count(single) / count(view.len());
    let message = "the voltage changes from sample to sample: what it was between them is not known";
    let remedy = "Record faster, or hold each voltage for several samples.";
    let finding = Finding::new("undersampled_input", Quantity::Voltage, message, remedy);
    (share > 0.2).then(|| finding.figure("ratio", view.restless))
}

/// Returns the stretches in which the voltage changes fast, none where they leave too little: from the first window that is
/// fast to a long pause or the end, because sines above the sampling rate look slow again.
pub(super) fn stretches(view: &View<'_>) -> Vec<Range<usize>> {
    let values = view.input.values;
    let mut found: Vec<Range<usize>> = Vec::new();
    if values.len() < 4 * WINDOW || view.restless == 0.0 {
        return found;
    }
    let spread = view.volts_spread * view.input.peak;
    let limits = [QUIET * spread, HELD * view.input.range];
    let mut n = 0;
    while n + WINDOW <= values.len() {
        if !is_fast(&values[n..n + WINDOW], limits) {
            n += STRIDE;
            continue;
        }
        let is_pause = |m: &usize| {
            let pause = &values[*m..(*m + PAUSE).min(values.len())];
            pause.len() == PAUSE && pause.iter().all(|v| (v - pause[0]).abs() <= limits[1])
        };
        let end = (n..values.len()).find(is_pause).map_or(values.len(), |pause| pause + PAUSE);
        found.push(n..end);
        n = end;
    }
    let left: Vec<f64> =
        values.iter().enumerate().filter(|(n, _)| !found.iter().any(|of| of.contains(n))).map(|(_, v)| *v).collect();
    let is_enough =
        count(left.len()) >= LEFT * count(values.len()) && standard_deviation(&left).powi(2) >= LEFT * spread * spread;
    if is_enough { found } else { Vec::new() }
}

/// Returns whether a voltage whose standard deviation is above the first limit changes fast, by more than the second one.
fn is_fast(window: &[f64], [smallest, held]: [f64; 2]) -> bool {
    let differences = window.windows(2).map(|pair| pair[1] - pair[0]);
    let mean_square = differences.clone().map(|d| d * d).sum::<f64>() / count(window.len() - 1);
    if mean_square <= 2.0 * FAST * smallest * smallest {
        return false;
    }
    let standing = differences.filter(|d| d.abs() <= held).count();
    let deviation = standard_deviation(window);
    deviation > smallest && mean_square > 2.0 * FAST * deviation * deviation && 5 * standing < window.len()
}
