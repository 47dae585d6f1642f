//! Rule on the offsets of sensors while the motor is at rest.

use super::finding::Finding;
use super::view::{Channel, View};
use motorfit_core::numeric::{count, mean, peak, standard_deviation};
use motorfit_core::setting::text;
use motorfit_core::text::{engineering, significant};
use std::ops::Range;

/// Fewest samples of rest for an estimate of the offsets.
const SAMPLES_MIN: usize = 10;
/// Largest offset, as a fraction of the peak of the signal, that is ignored.
const PART: f64 = 0.01;
/// Smallest offset, as a fraction of the peak, that is reported instead of mentioned.
const PART_REPORTED: f64 = 0.05;
/// Speed, as a fraction of its peak, above which the motor counts as moving.
pub(super) const MOVES: f64 = 0.1;

pub(super) fn rest(view: &View<'_>, findings: &mut Vec<Finding>) {
    let rest = view.first_rest();
    if rest.len() < SAMPLES_MIN || view.loaded {
        return;
    }
    // A motor that turns before a voltage is applied is not at rest.
    let turns = |speed: &Channel<'_>| {
        let level = mean(&speed.values[rest.clone()]).abs();
        level > MOVES * speed.peak && (speed.range > 0.5 * speed.peak || !is_flat(speed, &rest))
    };
    if view.speed.as_ref().is_some_and(turns) {
        return;
    }
    findings.extend(view.channels().filter_map(|channel| offset(channel, &rest)));
}

/// Returns true if the channel is constant during `rest`: the means of both halves differ by at most 4 standard errors.
fn is_flat(channel: &Channel<'_>, rest: &Range<usize>) -> bool {
    let values = &channel.values[rest.clone()];
    let (first, last) = values.split_at(values.len() / 2);
    let drift = (mean(last) - mean(first)).abs();
    drift <= standard_deviation(values) * (8.0 / count(values.len()).sqrt()).min(1.0) + 1e-12 * channel.peak
}

/// Detects a mean at rest that is constant and differs from zero.
fn offset(channel: &Channel<'_>, rest: &Range<usize>) -> Option<Finding> {
    let values = &channel.values[rest.clone()];
    let (level, spread) = (mean(values), standard_deviation(values));
    let sure = 6.0 * spread / count(values.len()).sqrt();
    let part = level.abs() / channel.peak;
    if channel.peak == 0.0 || level.abs() <= sure || part <= PART || !is_flat(channel, rest) {
        return None;
    }
    // A single outlier can produce the mean.
    if peak(values) > 3.0 * level.abs() + 6.0 * spread {
        return None;
    }
    let (quantity, shown) = (channel.quantity, engineering(level, channel.quantity.unit(), 3));
    let percent = significant(100.0 * part, 2);
    let message = format!("the {quantity} reads {shown} at rest without voltage, {percent} % of its largest value");
    let remedy = text!(
        "If it is the sensor's offset, subtract it with " [Offset = "auto"] ", or " [Offset = "{quantity}=VALUE"] "."
    );
    let finding = Finding::new("rest_offset", quantity, message, remedy).mention_if(part < PART_REPORTED);
    Some(finding.at(Some(rest.clone())).figure("offset", level).figure("part_of_peak", part))
}
