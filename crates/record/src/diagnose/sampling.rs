//! Rules on the resolution of sensors: values repeated over several samples, coarse quantization.

use super::finding::Finding;
use super::view::{Channel, View};
use motorfit_core::numeric::{count, runs, upper_median};
use motorfit_core::text::significant;

/// Fewest changes of a signal for a finding.
const CHANGES_MIN: usize = 12;

pub(super) fn sampling(view: &View<'_>, findings: &mut Vec<Finding>) {
    for channel in view.channels() {
        findings.extend(held(view, channel));
        findings.extend(coarse(view, channel));
    }
}

/// Detects values that are repeated over two or more samples and then change by several quantization steps; values repeated by
/// quantization change by one step.
fn held(view: &View<'_>, channel: &Channel<'_>) -> Option<Finding> {
    let values = channel.values;
    let equal = runs(values.len() - 1, |n| values[n].to_bits() == values[n + 1].to_bits());
    if equal.len() < CHANGES_MIN {
        return None;
    }
    let large = (3.0 * channel.quantum).max(0.002 * channel.range);
    let mut lengths = Vec::new();
    let mut since = 0;
    for n in 1..values.len() {
        let change = (values[n] - values[n - 1]).abs();
        if change > 0.0 {
            if change >= large && since > 0 {
                lengths.push(count(n - since));
            }
            since = n;
        }
    }
    if lengths.len() < CHANGES_MIN {
        return None;
    }
    // Noise of about one quantization step makes runs of all lengths, half of them of one sample.
    let singles = lengths.iter().filter(|length| **length < 1.5).count();
    let typical = upper_median(&mut lengths);
    if typical < 2.0 || count(singles) > 0.3 * count(lengths.len()) {
        return None;
    }
    let (quantity, seconds) = (channel.quantity, motorfit_core::text::engineering(typical * view.period(), "s", 3));
    let message = format!("the {quantity} changes only every {typical} samples ({seconds}) while it varies");
    let remedy = "Record it at the rate of the sensor, or keep one row of each run of equal values.";
    let finding = Finding::new("held_samples", quantity, message, remedy);
    Some(finding.figure("run", typical).figure("changes", count(lengths.len())))
}

/// Detects quantization: steps above 1 % of the range of which most changes are multiples.
fn coarse(view: &View<'_>, channel: &Channel<'_>) -> Option<Finding> {
    let (values, quantum) = (channel.values, channel.quantum);
    if quantum <= 0.01 * channel.range {
        return None;
    }
    let (mut changes, mut whole, mut unforced) = (0, 0, 0);
    for n in 1..values.len() {
        let steps = (values[n] - values[n - 1]).abs() / quantum;
        if steps > 0.0 {
            changes += 1;
            whole += usize::from((steps - steps.round()).abs() < 0.1 && steps > 0.5);
            // A fast motor under few voltages has few speeds; these change with the voltage.
            let forced =
                (n.saturating_sub(2)..n).any(|m| view.part(view.input.values[m + 1] - view.input.values[m]) > 0.02);
            unforced += usize::from(!forced);
        }
    }
    if changes < CHANGES_MIN || count(whole) < 0.9 * count(changes) || 2 * unforced < changes {
        return None;
    }
    let (quantity, part) = (channel.quantity, quantum / channel.range);
    let [step, percent] = [significant(quantum, 3), significant(100.0 * part, 2)];
    let message = format!("the {quantity} is quantized to {step} {}, {percent} % of the range", quantity.unit());
    let remedy = "Use a higher resolution: an encoder with more lines, the time between its edges, a longer count.";
    let finding = Finding::new("coarse_quantization", quantity, message, remedy).mention_if(part < 0.02);
    Some(finding.figure("step", quantum).figure("part_of_range", part))
}
