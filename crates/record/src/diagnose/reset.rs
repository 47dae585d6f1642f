//! Rule on a voltage that is reset to zero, or to its first value, in the last samples, as at the end of a program.

use super::finding::Finding;
use super::view::View;
use crate::heading::Quantity;
use motorfit_core::setting::text;
use motorfit_core::text::{counted, significant};
use std::ops::Range;

/// Largest length of a reset at the end \[samples\].
const LAST: usize = 3;
/// Smallest size of a reset, as a fraction of the range of the voltage.
const PART: f64 = 0.25;
/// Fewest samples before a reset.
const BEFORE: usize = 10;
/// Largest change between samples, relative to the reset, if the voltage has taken its last value before.
const SMOOTH: f64 = 0.5;

/// Returns the finding for a reset, which is not part of the experiment.
pub(super) fn reset(view: &View<'_>) -> Option<Finding> {
    let place = place(view)?;
    let [from, to] = [0, place.start - 1].map(|n| significant(view.time[n], 7));
    let volts = significant(view.input.values[place.start], 3);
    let last = if place.len() == 1 { "sample".to_owned() } else { counted(place.len(), "sample") };
    let message = format!("the voltage is reset to {volts} V in the last {last}: the motor had no time to respond");
    let remedy = text!("Leave these samples out: " [Crop = "{from}:{to}"] ", or " [Mask = "auto"] ".");
    Some(Finding::new("input_reset", Quantity::Voltage, message, remedy).at(Some(place)))
}

/// Returns the last samples if the voltage takes their level elsewhere only at rest at the start, or passes it smoothly.
fn place(view: &View<'_>) -> Option<Range<usize>> {
    let values = view.input.values;
    let (size, level) = (values.len(), *values.last()?);
    let is_level = |v: f64| view.part(v - level) < 0.02;
    let start = size - values.iter().rev().take_while(|v| is_level(**v)).count();
    if size < 2 * BEFORE || size - start > LAST || start < BEFORE {
        return None;
    }
    let rest = values.iter().take_while(|v| is_level(**v)).count();
    let is_idle = view.is_zero(size - 1) || rest > LAST;
    let again = values[rest..start].iter().any(|v| is_level(*v));
    let step = (level - values[start - 1]).abs();
    let smooth = || values[rest + 1..start].windows(2).all(|w| (w[1] - w[0]).abs() < SMOOTH * step);
    let is_smaller = level.abs() < values[start - 1].abs();
    (is_idle && view.part(step) >= PART && is_smaller && (!again || rest + 1 < start && smooth()))
        .then_some(start..size)
}
