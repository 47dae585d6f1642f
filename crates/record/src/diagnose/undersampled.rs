//! Rule on a voltage that changes faster than it is sampled: throughout a recording, or in a segment, as a chirp beyond the
//! resolved frequencies.

use super::finding::Finding;
use super::view::View;
use crate::heading::Quantity;
use motorfit_core::numeric::{count, standard_deviation};
use motorfit_core::setting::text;
use motorfit_core::text::significant;
use std::ops::Range;

/// Smallest ratio of the standard deviation of the differences to that of the voltage for an undersampled recording.
const ROUGHNESS: f64 = 0.7;
/// Length of the window that detects the start of a segment \[samples\]: four periods of the slowest undersampled sine.
const WINDOW: usize = 24;
/// Distance between windows \[samples\].
const STRIDE: usize = 4;
/// Smallest ratio of the mean squared difference to twice the variance of an undersampled voltage.
///
/// For a sine of frequency `f` and the sampling period `h` the ratio is `1 − cos(2π f h)`. The limit is that of a sixth of the
/// sampling rate, at which a first-order hold loses 9 % of the amplitude.
const FAST: f64 = 0.5;
/// Ratio of the standard deviation of the voltage in a window to that of the recording, below which it counts as constant.
const QUIET: f64 = 0.25;
/// Largest difference, as a fraction of the range, between samples of a constant voltage.
const HELD: f64 = 1e-3;
/// Number of samples of constant voltage that end a segment.
const PAUSE: usize = 4 * WINDOW;
/// Smallest fraction of the samples, and of the variance, outside undersampled segments.
const LEFT: f64 = 0.25;

pub(super) fn undersampled(view: &View<'_>, findings: &mut Vec<Finding>) {
    let segments = segments(view);
    if segments.is_empty() {
        findings.extend(throughout(view));
        return;
    }
    let [from, to] = [segments[0].start, segments[0].end - 1].map(|n| significant(view.time[n], 6));
    let message =
        format!("the voltage is undersampled from {from} s to {to} s: its intersample behaviour is not known there");
    let remedy = text!("Record at a higher rate, or leave these samples out: " [Mask = "auto"] ".");
    let finding = Finding::new("undersampled_input", Quantity::Voltage, message, remedy);
    findings.push(finding.mention_if(true).at(segments));
}

/// Detects a voltage that changes from sample to sample. A voltage that is constant for two or more samples between changes, as
/// a binary sequence, is resolved.
fn throughout(view: &View<'_>) -> Option<Finding> {
    // A constant voltage with noise is excluded.
    if view.roughness <= ROUGHNESS || view.volts_spread < 0.1 || view.len() < 10 {
        return None;
    }
    let single = view.constant_inputs.iter().filter(|s| s.samples.len() == 1).count();
    // In a random binary sequence that may switch at every sample, a quarter of the samples differ from both neighbours.
    let share = count(single) / count(view.len());
    let message = "the voltage changes from sample to sample: its intersample behaviour is not known";
    let remedy = "Record at a higher rate, or keep each voltage for several samples.";
    let finding = Finding::new("undersampled_input", Quantity::Voltage, message, remedy);
    (share > 0.2).then(|| finding.figure("ratio", view.roughness))
}

/// Returns the undersampled segments; none if too little of the recording is outside them.
///
/// A segment lasts from the first fast window through a pause of [`PAUSE`] samples or to the end, because sines near the
/// sampling rate look slow again.
pub(super) fn segments(view: &View<'_>) -> Vec<Range<usize>> {
    let values = view.input.values;
    let mut found: Vec<Range<usize>> = Vec::new();
    if values.len() < 4 * WINDOW || view.roughness == 0.0 {
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

/// Returns true if a window is undersampled: its standard deviation exceeds `smallest`, its differences are large relative to
/// it, and fewer than a fifth of them are within `held`.
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
