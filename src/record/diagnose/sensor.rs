//! A current sensor that shows one sign only: it stops at 0 A, or it shows the magnitude.

use super::winding::{Shows, Winding};
use super::{Channel, Finding, Quantity, View, text};
use crate::numeric::{count, order_statistic, runs};
use std::ops::Range;

/// A current below this part of the largest one is none, and so is one below so many standard deviations of its noise.
const NONE: f64 = 0.03;
const NOISES: f64 = 5.0;
/// A current of the other sign is expected from this part of the largest one on…
const EXPECTED: f64 = 0.12;
/// …and it is there if the sensor shows this part of it.
const SHOWN: f64 = 0.3;
/// The error of what is expected, in parts of the least that counts; what counts is so many errors.
const SURE: f64 = 0.8;
const ERRORS: f64 = 3.0;
/// A sensor that shows one sign explains the current with so much smaller an error than one that shows both.
const BETTER: f64 = 0.7;
/// The voltage was higher before, by this part of its peak.
const HIGHER: f64 = 0.15;
/// Samples at which it is expected.
const SAMPLES_MIN: usize = 5;
/// Samples of one voltage before a step and behind it.
const STEP_MIN: usize = 3;

/// Returns the finding for a current that never changes its sign although the motor brakes: what its back-EMF asks for where
/// the speed is known, else steps of the voltage.
pub(super) fn one_sided(view: &View<'_>, current: &Channel<'_>) -> Option<Finding> {
    // The noise of a current that follows a fast binary voltage is not known.
    let none = (NONE * current.peak).max((NOISES * current.noise).min(0.5 * EXPECTED * current.peak));
    let highest = current.values.iter().fold(f64::NEG_INFINITY, |high: f64, i| high.max(*i));
    let lowest = current.values.iter().fold(f64::INFINITY, |low: f64, i| low.min(*i));
    let sign = if lowest > -none { 1.0 } else { -1.0 };
    if view.loaded || (lowest <= -none && highest >= none) || current.peak < 4.0 * none {
        return None;
    }
    // A motor brakes after it was driven by more.
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
    // Half of them: a delay lets the current go on for a while.
    let mirrored = braking.iter().filter(|n| i(**n) > none.max(-SHOWN * expected[**n])).count();
    let at_zero = braking.iter().filter(|n| i(**n).abs() <= none).count();
    let is_mirrored = 2 * mirrored > braking.len();
    if !is_mirrored && 2 * at_zero < braking.len() {
        return None;
    }
    let places: Vec<Range<usize>> = runs(view.len(), |n| expected[n] < 0.0 && (is_mirrored || i(n) <= none));
    let samples: usize = places.iter().map(Range::len).sum();
    let what = if is_mirrored { "the sensor shows its magnitude" } else { "the sensor stops at 0 A" };
    let message = format!("the current never changes its sign, although the motor brakes: {what}");
    let remedy = text!(
        "Leave these samples of the current out with " [Mask = "auto"] ", or record with a sensor for both directions."
    );
    let finding = Finding::new("current_clipped", Quantity::Current, message, remedy);
    Some(finding.figure("level", 0.0).figure("samples", count(samples)).at(places))
}

/// The highest voltage up to each sample, in the direction of a sign.
fn running_peak(view: &View<'_>, sign: f64) -> Vec<f64> {
    let mut highest = 0.0;
    let up_to = |v: &f64| {
        highest = f64::max(highest, sign * v);
        highest
    };
    view.input.values.iter().map(up_to).collect()
}

/// The current by the winding's equation and its error, if a sensor that shows one sign only explains the recording and one
/// that shows both does not.
fn by_speed(view: &View<'_>, speed: &[f64], current: &[f64], sign: f64) -> Option<(Vec<f64>, f64)> {
    let [both, magnitude, positive] = [|i: f64| i, f64::abs, |i: f64| i.max(0.0)]
        .map(|shows: Shows| Winding::fitted(view, speed, current, sign, shows));
    let best = [magnitude?, positive?].into_iter().min_by(|a, b| a.error.total_cmp(&b.error))?;
    let explains = best.error <= SURE * EXPECTED * view.current.as_ref()?.peak && best.error < BETTER * both?.error;
    let oriented = |i: f64| sign * i;
    explains.then(|| (best.current(view.input.values, speed).into_iter().map(oriented).collect(), best.error))
}

/// Returns the current that steps down of the voltage would cause if they acted as steps up do; 0 elsewhere. `None` where there are none of both.
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
        // For as long as nothing flows, or the magnitude of the braking current.
        let lasts = |n: &usize| i(*n) <= NONE * peak || i(*n) > SHOWN * first.abs();
        if first < -EXPECTED * peak {
            // The winding takes the current there within the first quarter.
            let quarter = after.start + after.len() / 4;
            after.skip_while(|n| *n < quarter && !lasts(n)).take_while(lasts).for_each(|n| expected[n] = first);
        }
    }
    Some(expected)
}

/// A current that follows a voltage of both signs has both signs too.
fn of_negative_voltage(view: &View<'_>, sign: f64, peak: f64) -> Vec<f64> {
    let expected = |n: usize| {
        let v = sign * view.input.values[n] / view.input.peak;
        if v < -0.3 { v * peak } else { 0.0 }
    };
    (0..view.len()).map(expected).collect()
}
