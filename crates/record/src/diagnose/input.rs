//! Rules on the input: a single change, an idle value that is not zero, a reset at the end.

use super::finding::Finding;
use super::reset::reset;
use super::view::View;
use crate::heading::Quantity;
use motorfit_core::setting::text;
use motorfit_core::text::significant;

pub(super) fn input(view: &View<'_>, findings: &mut Vec<Finding>) {
    let reset = reset(view);
    findings.extend(single_edge(view, reset.as_ref().map_or(view.len(), |reset| reset.places[0].start)));
    findings.extend(reset);
    findings.extend(idle(view));
}

/// Detects a voltage that changes only once before sample `end`.
fn single_edge(view: &View<'_>, end: usize) -> Option<Finding> {
    let mut changes: Vec<usize> = Vec::new();
    let mut level = view.constant_inputs[0].volts;
    for segment in view.constant_inputs.iter().skip(1).take_while(|s| s.samples.start < end) {
        if view.part(segment.volts - level) > 0.05 {
            changes.push(segment.samples.start);
        }
        level = segment.volts;
    }
    let (&first, &last) = (changes.first()?, changes.last()?);
    // A step that takes up to three samples is one change; a pulse is not.
    let stays = view.part(level - view.constant_inputs[0].volts) > 0.02;
    let message = "the voltage changes only once: a delay of the drive is hard to distinguish from a slow motor";
    let remedy = "Record several steps, up and down; three or more make delays and dead times identifiable.";
    let finding = Finding::new("single_edge", Quantity::Voltage, message, remedy).mention_if(true);
    (changes.len() <= 3 && last - first < 3 && stays).then(|| finding.at(Some(first..last + 1)))
}

/// Detects a voltage that starts at a small constant value and is never 0.
fn idle(view: &View<'_>) -> Option<Finding> {
    let rest = view.first_rest();
    let volts = view.input.values[0];
    let is_constant = view.input.values[rest.clone()].iter().all(|v| v.to_bits() == volts.to_bits());
    let never = view.input.values.iter().all(|v| *v != 0.0);
    if rest.len() < 10 || rest.len() == view.len() || !is_constant || !never {
        return None;
    }
    let message = format!("the voltage is never 0 V; it is {} V at rest", significant(volts, 3));
    let idle = significant(volts, 4);
    let remedy = text!("If that is the drive's idle command, subtract it: " [Offset = "voltage={idle}"] ".");
    let finding = Finding::new("idle_input", Quantity::Voltage, message, remedy).mention_if(true);
    Some(finding.at(Some(rest)).figure("idle", volts))
}
