//! A current sensor that shows one sign only: it stops at 0 A, or it shows the magnitude.

use super::regression::{Row, Sums};
use super::{Channel, Finding, Quantity, View, text};
use crate::numeric::{count, extremes, order_statistic, runs};
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
/// The range of the voltage of a driven motor, in parts of its peak, from which a drop of voltage is told from it.
const VARIES: f64 = 0.2;
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
        Some(speed) if speed.range > 0.0 => by_speed(view, speed.values, sign, &i, current.peak)?,
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

/// The current by the winding's equation, fitted to the samples in which the motor is driven; `None` where it does not explain
/// them.
fn by_speed(
    view: &View<'_>,
    speed: &[f64],
    sign: f64,
    i: &impl Fn(usize) -> f64,
    peak: f64,
) -> Option<(Vec<f64>, f64)> {
    let (v, w) = (|n: usize| sign * view.input.values[n], |n: usize| sign * speed[n]);
    let fast = view.speed.as_ref()?.peak;
    let mut ratios: Vec<f64> = (0..view.len())
        .filter(|n| w(*n) > 0.3 * fast && i(*n) > NONE * peak && v(*n) > 0.0)
        .map(|n| v(n) / w(n))
        .collect();
    // Back-EMF is below the voltage of a driven motor; which samples those are, is found with it.
    let starts = [0.1, 0.3, 0.5, 0.8].map(|p| 0.9 * order_statistic(&mut ratios, p));
    let winding = |start: &f64| Winding::fitted(view.len(), *start, [&v, &w, i], 0.1 * peak);
    let best = starts.iter().filter_map(winding).min_by(|a, b| a.error.total_cmp(&b.error))?;
    if best.error > SURE * EXPECTED * peak {
        return None;
    }
    let mut current = vec![0.0; view.len()];
    for n in 1..view.len() {
        let volts = v(n - 1) - best.back * 0.5 * (w(n) + w(n - 1)) - best.before * current[n - 1];
        // A drop of the brushes or a deadband lessens the voltage in both directions.
        let left = if volts > 0.0 { (volts - best.drop).max(0.0) } else { (volts + best.drop).min(0.0) };
        current[n] = left / best.now;
    }
    Some((current, best.error))
}

/// The equation of a winding over a step: v = drop + now i⁺ + before i + back (ω⁺ + ω)/2.
struct Winding {
    drop: f64,
    now: f64,
    before: f64,
    back: f64,
    /// The standard deviation of the current that it leaves.
    error: f64,
}

impl Winding {
    /// Fits voltage, speed and current of the samples that are driven if the back-EMF constant is about `back`.
    fn fitted(size: usize, mut back: f64, [v, w, i]: [&dyn Fn(usize) -> f64; 3], least: f64) -> Option<Self> {
        let mut found = None;
        for _ in 0..4 {
            let is_driven = |n: &usize| i(*n).min(i(n - 1)) > least && v(n - 1) > back * w(n - 1).max(w(*n));
            let driven: Vec<usize> = (1..size).filter(is_driven).collect();
            let volts: Vec<f64> = driven.iter().map(|n| v(n - 1)).collect();
            let [low, high] = extremes(&volts);
            let one = if high - low > VARIES * high { 1.0 } else { 0.0 };
            let row = |n: usize, before: f64| {
                Row::from([one, i(n), before * i(n - 1), 0.5 * (w(n) + w(n - 1)), 0.0, 0.0, 0.0, 0.0])
            };
            // Where all currents decay alike, the inductance is not known: then without it.
            let fit = [1.0, 0.0].into_iter().find_map(|before| Self::of(&driven, &volts, |n| row(n, before)))?;
            back = fit.back;
            found = Some(fit);
        }
        found
    }

    /// Fits the voltages of samples; `None` where the constants are none of a motor.
    fn of(samples: &[usize], volts: &[f64], row: impl Fn(usize) -> Row) -> Option<Self> {
        let mut sums = Sums::default();
        samples.iter().zip(volts).for_each(|(n, volts)| sums.add(&row(*n), *volts));
        let solution = sums.solve();
        let [drop, now, before, back, ..] = solution.coefficients;
        // By the trapezoidal rule the current at the end of the step has the larger part.
        if samples.len() < 10 || now <= 0.0 || before.abs() >= now || back <= 0.0 {
            return None;
        }
        let left: f64 = samples.iter().zip(volts).map(|(n, v)| (v - solution.predicted(&row(*n))).powi(2)).sum();
        let error = (left / count(samples.len())).sqrt() / (now + before);
        Some(Self { drop: drop.max(0.0), now, before, back, error })
    }
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
