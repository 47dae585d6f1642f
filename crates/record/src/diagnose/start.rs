//! Rule on a motor that first stands still under voltage and then moves, as with a drive that wakes up.
//!
//! The motion is fitted by a first-order lag; simulated from the first voltage, it shows when the motor should have moved.

use super::finding::Finding;
use super::lag::{Blocks, COARSE, ONE_LAG};
use super::view::{Channel, View};
use crate::heading::Quantity;
use motorfit_core::numeric::{count, order_statistic, whole};
use motorfit_core::setting::text;
use motorfit_core::text::{engineering, significant};

/// Smallest speed that counts as motion, as a fraction of the 95th percentile of |speed|.
const MOVES: f64 = 0.03;
/// Voltage that must move the motor, as a fraction of the peak; deadbands are assumed to be smaller.
const STRONG: f64 = 0.6;
/// Fewest samples under that voltage without motion.
const FIRST_MIN: usize = 20;
/// Inverse of the smallest fraction of the samples under that voltage without motion.
const PART: usize = 50;
/// Smallest predicted speed, in multiples of the speed that counts as motion.
const PREDICTED: f64 = 3.0;
/// Largest ratio of the squared residuals of the fit to the squares of the speed.
const LEFT: f64 = 0.3;

pub(super) fn start(view: &View<'_>, findings: &mut Vec<Finding>) {
    let is_known = |finding: &Finding| {
        matches!(
            finding.code,
            "start_latency" | "no_motion" | "voltage_without_current" | "motion_without_input" | "sign_reversed"
        )
    };
    let Some(speed) = view.speed.as_ref().filter(|speed| speed.range > 0.0 && !view.loaded) else { return };
    if view.len() >= 4 * FIRST_MIN && !findings.iter().any(is_known) {
        findings.extend(late(view, speed));
    }
}

/// Detects samples under voltage in which the fitted lag predicts a motion that is not measured.
fn late(view: &View<'_>, speed: &Channel<'_>) -> Option<Finding> {
    let (w, v, size) = (speed.values, view.input.values, view.len());
    let mut sizes: Vec<f64> = w.iter().map(|w| w.abs()).collect();
    let coarse = if speed.is_fine() { 0.0 } else { 1.5 * speed.quantum };
    let moving = (MOVES * order_statistic(&mut sizes, 0.95)).max(4.0 * speed.noise).max(coarse);
    let onset = (0..size.saturating_sub(3)).find(|n| w[*n..n + 3].iter().all(|w| w.abs() > moving))?;
    let strong: Vec<usize> = (0..onset).filter(|n| v[*n].abs() > STRONG * view.input.peak).collect();
    let least = FIRST_MIN.max(size / PART);
    let first = *strong.first()?;
    if strong.len() < least || onset - first < least || size - onset < 2 * FIRST_MIN {
        return None;
    }
    // The model of the motion after its onset predicts the motion from the first voltage on.
    let blocks = Blocks::new(&v[onset..], &w[onset..], COARSE, &ONE_LAG);
    let plain = |v: f64| v;
    let sign = |v: f64| if v.abs() > 0.05 * view.input.peak { v.signum() } else { 0.0 };
    let fit = blocks.fit(&[&plain, &sign], None, |c| c[0] > 0.0)?;
    if fit.sse > LEFT * w[onset..].iter().map(|w| w * w).sum::<f64>() / count(blocks.length) {
        return None;
    }
    let decay = fit.decay.powf(1.0 / count(blocks.length));
    let mut state = 0.0;
    let mut beyond = 0;
    for volts in &v[first..onset] {
        let end = fit.gains[0] * volts + fit.gains[1] * sign(*volts);
        state = end + decay * (state - end);
        beyond += usize::from(f64::abs(state) > PREDICTED * moving);
    }
    // A margin, because noise hides the onset for a while.
    if beyond < least.max(whole(0.3 * count(onset - first))) {
        return None;
    }
    let wait = engineering(view.time[onset] - view.time[first], "s", 3);
    let message = format!("the motor stands still for {wait} under voltage before it first moves");
    let from = significant(view.time[onset], 6);
    let remedy = text!(
        "Leave out the beginning: " [Crop = "{from}:"] "; the drive was waking up, or voltage and speed are not \
         synchronous."
    );
    let finding = Finding::new("start_latency", Quantity::Speed, message, remedy).at(Some(first..onset));
    Some(finding.figure("first_s", view.time[onset] - view.time[first]))
}
