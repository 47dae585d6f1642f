//! Rule on outliers of the outputs: runs of up to three samples that disagree with predictions from both sides.
//!
//! Pulses are candidates; a [`Search`] compares them with predictions from the samples before and after them.

use super::finding::Finding;
use super::outlier_search::Search;
use super::predictor::Scaled;
use super::pulses::{Pulses, RUN_MAX, noise};
use super::view::{Channel, View};
use crate::heading::Quantity;
use motorfit_core::numeric::{count, peak};
use motorfit_core::setting::text;
use motorfit_core::text::{counted, significant};
use std::ops::Range;

/// Smallest residual of an outlier, as a fraction of the range.
const PART: f64 = 0.01;
/// Smallest residual of an outlier, in quantization steps of the sensor.
const STEPS: f64 = 2.5;
/// Smallest size of a pulse, in standard deviations of the noise.
const NOISES: f64 = 4.0;
/// Largest change of the signal from before to after a pulse, as a fraction of its size.
const AGREE: f64 = 1.0;
/// Additional change that is allowed, in standard deviations of the noise.
const SLACK: f64 = 6.0;
/// Largest fraction of the samples that can be outliers; more are a property of the sensor.
const RARE: f64 = 0.03;

/// Outliers of a signal.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Outliers {
    pub quantity: Quantity,
    /// Ranges of samples that are outliers.
    pub places: Vec<Range<usize>>,
    /// Index and predicted value of each of these samples.
    pub repaired: Vec<(usize, f64)>,
}

/// Returns the outliers of the measured outputs.
pub(super) fn of_outputs(view: &View<'_>) -> Vec<Outliers> {
    let outputs = view.channels().filter(|channel| !(view.by_current() && channel.quantity == Quantity::Current));
    outputs.filter_map(|channel| of_channel(view, channel)).collect()
}

/// Adds the finding for the outliers of each signal.
pub(super) fn report(view: &View<'_>, outliers: &[Outliers], findings: &mut Vec<Finding>) {
    findings.extend(outliers.iter().map(|outliers| finding(view, outliers)));
}

/// Creates the finding for the outliers of a signal.
fn finding(view: &View<'_>, outliers: &Outliers) -> Finding {
    let (quantity, repaired) = (outliers.quantity, &outliers.repaired);
    let values = view.record.samples().signals().find(|(of, _)| *of == quantity).map_or(&[][..], |(_, values)| values);
    let shown = |value: f64| significant(value, 4);
    let pairs = repaired.iter().take(3).map(|(n, value)| format!("{} instead of {}", shown(values[*n]), shown(*value)));
    let more = if repaired.len() > 3 { ", …" } else { "" };
    let list = pairs.collect::<Vec<_>>().join(", ");
    let (samples, unit) = (repaired.len(), quantity.unit());
    let verb = if samples == 1 { "is" } else { "are" };
    let message = format!(
        "{} of the {quantity} {verb} far from the surrounding samples: {list}{more} {unit}",
        counted(samples, "single sample")
    );
    let what = if quantity == Quantity::Voltage { "Have them replaced by" } else { "Leave them out with" };
    let remedy = text!("{what} " [Mask = "auto"] ".");
    let deviations: Vec<f64> = repaired.iter().map(|(n, value)| values[*n] - value).collect();
    let finding = Finding::new("outliers", quantity, message, remedy).at(outliers.places.iter().cloned());
    finding.figure("samples", count(samples)).figure("largest", peak(&deviations))
}

/// Returns the outliers of an output; `None` if there are none, or if they are too many.
fn of_channel(view: &View<'_>, channel: &Channel<'_>) -> Option<Outliers> {
    let of = Scaled::new(view, channel.values)?;
    let coarse = if is_quantized(channel) { channel.quantum / of.range } else { 0.0 };
    let least = PART.max(STEPS * coarse.min(1.0));
    let noise = noise(&of.values).min(channel.noise / of.range);
    let pulses = Pulses { least: least.max(NOISES * noise), agree: AGREE, slack: SLACK * noise, with_turns: false };
    let pulses = pulses.of(&of.values);
    if pulses.is_empty() {
        return None;
    }
    let (places, mut repaired) = Search::new(of, least).found(&pulses);
    // Adjacent runs that are too long together are not outliers.
    let runs: Vec<Range<usize>> = places
        .chunk_by(|a: &Range<usize>, b| a.end == b.start)
        .map(|run| run[0].start..run[run.len() - 1].end)
        .filter(|run| run.len() <= RUN_MAX)
        .collect();
    let places = runs;
    repaired.retain(|(n, _)| places.iter().any(|place| place.contains(n)));
    let is_rare = count(repaired.len()) <= (RARE * count(view.len())).max(3.0);
    (is_rare && !repaired.is_empty()).then_some(Outliers { quantity: channel.quantity, places, repaired })
}

/// Returns true if nine of ten differences are multiples of the quantization step.
fn is_quantized(channel: &Channel<'_>) -> bool {
    let steps = channel.values.windows(2).map(|w| (w[1] - w[0]).abs() / channel.quantum);
    let (whole, all) = steps
        .filter(|step| *step > 0.5)
        .fold((0, 0), |(whole, all), step| (whole + usize::from((step - step.round()).abs() < 0.05), all + 1));
    !channel.is_fine() && 10 * whole >= 9 * all
}
