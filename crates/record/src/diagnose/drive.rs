//! Rules on a current that its sensor clips or the drive limits.

use super::finding::Finding;
use super::sensor;
use super::view::{Channel, ConstantInput, View};
use crate::heading::Quantity;
use motorfit_core::numeric::{count, mean, runs};
use motorfit_core::setting::text;
use motorfit_core::text::engineering;
use std::ops::Range;

pub(super) fn drive(view: &View<'_>, findings: &mut Vec<Finding>) {
    let Some(current) = view.current.as_ref().filter(|c| c.range > 0.0 && view.len() >= 20) else { return };
    let one_sided = || sensor::one_sided(view, current);
    findings.extend(clipped(view, current).or_else(one_sided).or_else(|| limited(view, current)));
}

/// Fewest consecutive samples exactly at the extreme value of a clipped current.
const CLIPPED_MIN: usize = 4;

/// Detects runs of exactly the largest or smallest value that are entered by a jump and left under a constant voltage.
fn clipped(view: &View<'_>, current: &Channel<'_>) -> Option<Finding> {
    let values = current.values;
    let mut places = Vec::new();
    for sign in [1.0, -1.0] {
        let extreme = values.iter().fold(f64::NEG_INFINITY, |top: f64, i| top.max(sign * i));
        if extreme < 0.2 * current.range {
            continue;
        }
        let at_top = runs(values.len(), |n| (sign * values[n]).to_bits() == extreme.to_bits());
        let is_clipped = |run: &Range<usize>| run.len() >= CLIPPED_MIN && enters_and_leaves(view, current, run, sign);
        if at_top.iter().any(is_clipped) {
            // One such run establishes the level; shorter runs at the level are clipped too.
            places.extend(at_top);
        }
    }
    if places.is_empty() {
        return None;
    }
    let samples: usize = places.iter().map(Range::len).sum();
    let shown = engineering(current.peak, "A", 3);
    let message = format!("the current stays at {shown} for {samples} samples, as if it were cut off there");
    let remedy = text!(
        "Leave these samples of the current out with " [Mask = "auto"] ", or record with less voltage or a larger \
         range."
    );
    let finding = Finding::new("current_clipped", Quantity::Current, message, remedy);
    Some(finding.figure("level", current.peak).figure("samples", count(samples)).at(places))
}

/// Returns true if the current jumps to the extreme value of a run and decreases after it under a constant voltage.
fn enters_and_leaves(view: &View<'_>, current: &Channel<'_>, run: &Range<usize>, sign: f64) -> bool {
    let (values, top) = (current.values, sign * current.values[run.start]);
    let before = run.start.checked_sub(2).map(|n| top - sign * values[n]);
    let jump = (0.1 * current.range).max(4.0 * if current.is_fine() { 0.0 } else { current.quantum });
    let Some(segment) = view.constant_inputs.iter().find(|s| s.samples.contains(&(run.end - 1))) else { return false };
    let after = &values[run.end..segment.samples.end.max(run.end)];
    let falls = after.iter().fold(0.0, |fall: f64, i| fall.max(top - sign * i));
    // The decrease must be steep: at a flat maximum a quantized current decreases by single steps.
    let steep = values.get(run.end + run.len()).is_some_and(|i| top - sign * i > 2.5 * current.quantum);
    before.is_some_and(|rise| rise > jump) && falls > 0.15 * current.range && steep
}

/// Detects a current limit: a current within 5 % of its largest value while the speed changes by half of its range under a
/// constant voltage, although the back-EMF must reduce it. Around the current peak of a slow winding the speed changes by at
/// most 31 %.
fn limited(view: &View<'_>, current: &Channel<'_>) -> Option<Finding> {
    let speed = view.speed.as_ref().filter(|speed| speed.range > 0.0 && !view.loaded)?;
    let long = view.constant_inputs.iter().filter(|s| s.samples.len() >= 20 && view.part(s.volts) > 0.2);
    let places: Vec<_> = long.filter_map(|segment| plateau(current, speed, segment)).collect();
    let level = mean(&current.values[places.first()?.clone()]);
    let shown = engineering(level, "A", 3);
    let message = format!("the current stays at {shown} while the motor speeds up, as under a current limit");
    let remedy = "Use steps that do not reach the current limit, or record the voltage at the motor.";
    Some(Finding::new("current_clipped", Quantity::Current, message, remedy).figure("level", level).at(places))
}

/// Returns the samples of a segment in which the current stays at its limit.
fn plateau(current: &Channel<'_>, speed: &Channel<'_>, segment: &ConstantInput) -> Option<Range<usize>> {
    let sign = segment.volts.signum();
    let i = |n: usize| sign * current.values[n];
    let samples = segment.samples.clone();
    let top = samples.clone().max_by(|a, b| i(*a).total_cmp(&i(*b)))?;
    let level = i(top);
    // The noise must be within the band.
    if level <= 0.0 || 4.0 * current.noise > 0.05 * level {
        return None;
    }
    let inside = |n: &usize| i(*n) > 0.95 * level;
    let from = samples.clone().find(inside)?;
    let to = (from..samples.end).find(|n| !inside(n))?;
    let low = (to..samples.end).map(i).fold(level, f64::min);
    let gained = sign * (speed.values[to - 1] - speed.values[from]);
    (to - from >= 10 && low < 0.75 * level && gained > 0.5 * speed.range).then_some(from..to)
}
