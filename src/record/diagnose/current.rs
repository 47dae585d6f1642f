//! Recordings whose input is the current.

use super::Finding;
use super::sign::sign_of_first;
use super::units::{SPEEDS, finding, is_whole, time};
use super::view::View;
use crate::record::Quantity;
use crate::setting::text;
use crate::text::significant;

/// Samples that a sign needs.
const SAMPLES_MIN: usize = 100;

/// Units that give no motor, as far as they show without a voltage.
pub(super) fn units(view: &View<'_>, findings: &mut Vec<Finding>) {
    findings.extend(time(view));
    let Some(speed) = &view.speed else { return };
    let whole = is_whole(speed) && speed.peak > SPEEDS[0];
    if whole || speed.peak > SPEEDS[1] {
        let how = if whole { "in whole numbers" } else { "taken as rad/s" };
        let what =
            format!("the speed, {how} and up to {}, looks like revolutions a minute", significant(speed.peak, 3));
        let found = finding(view, Quantity::Speed, what, "rpm").mention_if(!whole);
        findings.push(found.figure("peak", speed.peak));
    }
}

/// A current that slows the motor down: ∂ω⁺/∂i < 0 at the same ω.
pub(super) fn reversed(view: &View<'_>, findings: &mut Vec<Finding>) {
    let Some(speed) = view.speed.as_ref().filter(|speed| speed.range > 0.0) else { return };
    if view.loaded || view.len() < SAMPLES_MIN || view.volts_range == 0.0 {
        return;
    }
    let (i, w) = (view.voltage, speed.values);
    let rows = (0..view.len() - 1).map(|n| ([i[n] + i[n + 1], w[n], 0.0], w[n + 1] - w[n]));
    if sign_of_first(rows) == Some(-1) {
        let message = "the sign of current or speed is reversed: the current slows the motor down";
        let remedy = text!("Swap the sign of one: " [Columns = "current=HEADING*-1"] ".");
        findings.push(Finding::new("sign_reversed", message, remedy).of(Quantity::Current));
    }
}
