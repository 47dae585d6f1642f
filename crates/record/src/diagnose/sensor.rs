//! Rule on unidirectional current sensors, which clip the current at 0 A or measure its magnitude.
//!
//! The expected current comes from the winding's equation if the speed is known, and from steps of the voltage otherwise.

use super::finding::Finding;
use super::view::{Channel, View};
use super::winding::{Sensor, Winding};
use crate::heading::Quantity;
use motorfit_core::numeric::{count, order_statistic, runs};
use motorfit_core::setting::text;
use std::ops::Range;

/// Current, as a fraction of its peak, up to which it counts as zero.
const NONE: f64 = 0.03;
/// Current, in standard deviations of its noise, up to which it counts as zero.
const NOISES: f64 = 5.0;
/// Smallest expected current of the other sign that is examined, as a fraction of the peak.
const EXPECTED: f64 = 0.12;
/// Smallest ratio of measured to expected braking current at which the sensor measures the magnitude.
const SHOWN: f64 = 0.3;
/// Largest standard deviation of the expected current, as a fraction of the smallest current that is examined.
const SURE: f64 = 0.8;
/// Smallest expected current that is examined, in standard deviations of its error.
const ERRORS: f64 = 3.0;
/// Largest ratio of the residuals of a unidirectional sensor to those of a bidirectional one.
const BETTER: f64 = 0.7;
/// Drop of the voltage below its running maximum, as a fraction of its peak, after which braking is possible.
const HIGHER: f64 = 0.15;
/// Fewest samples with an expected current of the other sign.
const SAMPLES_MIN: usize = 5;
/// Fewest samples of constant voltage before and after a step.
const STEP_MIN: usize = 3;

/// Detects a current that never changes its sign although the motor brakes, as its back-EMF shows if the speed is known, and
/// steps of the voltage otherwise.
pub(super) fn one_sided(view: &View<'_>, current: &Channel<'_>) -> Option<Finding> {
    // The estimated noise is limited: that of a current under a fast binary voltage is too large.
    let none = (NONE * current.peak).max((NOISES * current.noise).min(0.5 * EXPECTED * current.peak));
    let highest = current.values.iter().fold(f64::NEG_INFINITY, |high: f64, i| high.max(*i));
    let lowest = current.values.iter().fold(f64::INFINITY, |low: f64, i| low.min(*i));
    let sign = if lowest > -none { 1.0 } else { -1.0 };
    if view.loaded || (lowest <= -none && highest >= none) || current.peak < 4.0 * none {
        return None;
    }
    // A motor brakes only after a higher voltage.
    let highest = running_peak(view, sign);
    let is_lower = |n: &usize| highest[*n] - sign * view.input.values[*n] > HIGHER * view.input.peak;
    if (0..view.len()).filter(is_lower).take(SAMPLES_MIN).count() < SAMPLES_MIN {
        return None;
    }
    let i = |n: usize| sign * current.values[n];
    let (expected, error) = match &view.speed {
        Some(speed) if speed.range > 0.0 => by_speed(view, speed.values, current.values, sign)?,
        _ => (by_steps(view, sign, &i, current.peak)?, 0.0),
    };
    let least = (EXPECTED * current.peak).max(ERRORS * error);
    let braking: Vec<usize> = (0..view.len()).filter(|n| expected[*n] < -least && is_lower(n)).collect();
    if braking.len() < SAMPLES_MIN {
        return None;
    }
    // Half of the samples suffice: behind a delay the driving current continues for a while.
    let mirrored = braking.iter().filter(|n| i(**n) > none.max(-SHOWN * expected[**n])).count();
    let at_zero = braking.iter().filter(|n| i(**n).abs() <= none).count();
    let is_mirrored = 2 * mirrored > braking.len();
    if !is_mirrored && 2 * at_zero < braking.len() {
        return None;
    }
    let places: Vec<Range<usize>> = runs(view.len(), |n| expected[n] < 0.0 && (is_mirrored || i(n) <= none));
    let samples: usize = places.iter().map(Range::len).sum();
    let what = if is_mirrored { "the sensor measures its magnitude" } else { "the sensor clips it at 0 A" };
    let message = format!("the current never changes its sign, although the motor brakes: {what}");
    let remedy = text!(
        "Leave these samples of the current out with " [Mask = "auto"] ", or record with a bidirectional sensor."
    );
    let finding = Finding::new("current_clipped", Quantity::Current, message, remedy);
    Some(finding.figure("level", 0.0).figure("samples", count(samples)).at(places))
}

/// Returns the running maximum of the voltage times a sign.
fn running_peak(view: &View<'_>, sign: f64) -> Vec<f64> {
    let mut highest = 0.0;
    let up_to = |v: &f64| {
        highest = f64::max(highest, sign * v);
        highest
    };
    view.input.values.iter().map(up_to).collect()
}

/// Returns the current by the winding's equation and its standard deviation; `None` unless a unidirectional sensor fits the
/// recording clearly better than a bidirectional one.
fn by_speed(view: &View<'_>, speed: &[f64], current: &[f64], sign: f64) -> Option<(Vec<f64>, f64)> {
    let [both, magnitude, positive] = [|i: f64| i, f64::abs, |i: f64| i.max(0.0)]
        .map(|sensor: Sensor| Winding::fitted(view, speed, current, sign, sensor));
    let best = [magnitude?, positive?].into_iter().min_by(|a, b| a.error.total_cmp(&b.error))?;
    let explains = best.error <= SURE * EXPECTED * view.current.as_ref()?.peak && best.error < BETTER * both?.error;
    let oriented = |i: f64| sign * i;
    explains.then(|| (best.current(view.input.values, speed).into_iter().map(oriented).collect(), best.error))
}

/// Returns the current that downward steps of the voltage would cause with the gain of upward steps, and 0 elsewhere.
///
/// Without upward steps the current is assumed to be proportional to the voltage.
fn by_steps(view: &View<'_>, sign: f64, i: &impl Fn(usize) -> f64, peak: f64) -> Option<Vec<f64>> {
    let mut expected = vec![0.0; view.len()];
    let mut gains = Vec::new();
    let mut falls = Vec::new();
    for pair in view.constant_inputs.windows(2) {
        let (before, after) = (&pair[0].samples, &pair[1].samples);
        let change = sign * (pair[1].volts - pair[0].volts);
        if view.part(change) < 0.15 || before.len() < STEP_MIN || after.len() < STEP_MIN {
            continue;
        }
        let level = i(after.start.saturating_sub(1));
        if change > 0.0 {
            let top = after.clone().map(i).fold(level, f64::max);
            gains.push((top - level) / change);
        } else {
            falls.push((after.clone(), level, change));
        }
    }
    let gain = order_statistic(&mut gains, 0.5);
    if gain <= 0.0 {
        return Some(of_negative_voltage(view, sign, peak));
    }
    for (after, level, change) in falls {
        let first = level + 0.7 * gain * change;
        // The response lasts while no current, or the magnitude of a braking current, is measured.
        let lasts = |n: &usize| i(*n) <= NONE * peak || i(*n) > SHOWN * first.abs();
        if first < -EXPECTED * peak {
            // The inductance of the winding delays the current by at most the first quarter of the segment.
            let quarter = after.start + after.len() / 4;
            after.skip_while(|n| *n < quarter && !lasts(n)).take_while(lasts).for_each(|n| expected[n] = first);
        }
    }
    Some(expected)
}

/// Returns the current expected under negative voltages if it follows the voltage, and 0 elsewhere.
fn of_negative_voltage(view: &View<'_>, sign: f64, peak: f64) -> Vec<f64> {
    let expected = |n: usize| {
        let v = sign * view.input.values[n] / view.input.peak;
        if v < -0.3 { v * peak } else { 0.0 }
    };
    (0..view.len()).map(expected).collect()
}
