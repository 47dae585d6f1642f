//! Rules on motion without voltage, and on voltage without motion.

use super::finding::Finding;
use super::rest::MOVES;
use super::view::{Channel, View};
use crate::heading::Quantity;
use motorfit_core::numeric::{count, mean, running_sums, runs, standard_deviation};
use std::ops::Range;

/// Fewest samples for a finding.
const SAMPLES_MIN: usize = 10;

pub(super) fn motion(view: &View<'_>, findings: &mut Vec<Finding>) {
    let Some(speed) = view.speed.as_ref().filter(|_| view.len() >= SAMPLES_MIN && !view.loaded) else { return };
    if does_not_move(view, speed) {
        let message = "the motor did not move: the speed does not respond to the voltage";
        let remedy = "Leave out the recording; only R and L are identifiable, from the current. Use more voltage, or \
                      check the drive and the speed sensor.";
        findings.push(Finding::new("no_motion", Quantity::Speed, message, remedy).figure("peak", speed.peak));
        return;
    }
    let zero = runs(view.len(), |n| view.is_zero(n));
    let mut places: Vec<Range<usize>> = zero.iter().filter_map(|run| start_of_motion(view, speed, run)).collect();
    places.extend(zero.first().and_then(|run| keeps_moving(view, speed, run)));
    places.extend(zero.iter().filter(|run| speeds_up(speed, run)).cloned());
    places.sort_by_key(|place| place.start);
    places.dedup_by(|later, earlier| later.start < earlier.end);
    if !places.is_empty() {
        let message = "the motor speeds up, or keeps its speed, while the recorded voltage is 0 V";
        let remedy = "Check that the voltage column is the voltage at the motor, not a flag or another channel, that \
                      no command was too short to be recorded, and that nothing else turned the shaft. The \
                      recording cannot be fitted as it is.";
        let finding = Finding::new("motion_without_input", Quantity::Voltage, message, remedy);
        findings.push(finding.figure("places", count(places.len())).at(places));
    }
}

/// Detects a start from standstill within a run of samples without voltage. The motor must rest twice as long as it then takes
/// to move, which excludes the effect of current from an earlier pulse.
fn start_of_motion(view: &View<'_>, speed: &Channel<'_>, run: &Range<usize>) -> Option<Range<usize>> {
    let coarse = if speed.is_fine() { 0.0 } else { speed.quantum };
    let still = (0.03 * speed.peak).max(3.0 * speed.noise).max(1.5 * coarse);
    let moving = (MOVES * speed.peak).max(8.0 * speed.noise).max(3.0 * coarse);
    // If the recording has a voltage elsewhere, motion must last, unlike a spike of the sensor.
    let lasts = if view.input.peak > 0.0 { 3 } else { 1 };
    let mut quiet = 0;
    let mut since = None;
    for n in run.clone() {
        let size = speed.values[n].abs();
        if size <= still {
            if since.take().is_some() {
                quiet = 0;
            }
            quiet += 1;
            continue;
        }
        let start = *since.get_or_insert(n);
        let end = (n + lasts).min(run.end);
        let goes_on = end == n + lasts && speed.values[n..end].iter().all(|w| w.abs() > 0.5 * moving);
        if size > moving && goes_on && quiet >= 5 && quiet >= 2 * (n - start) {
            return Some(start..end);
        }
    }
    None
}

/// Returns true if a moving motor accelerates throughout a run without voltage, in which remaining current would decay in the
/// first quarter.
fn speeds_up(speed: &Channel<'_>, run: &Range<usize>) -> bool {
    let part = run.len() / 4;
    if part < SAMPLES_MIN {
        return false;
    }
    let level = |n: usize| mean(&speed.values[run.start + n * part..run.start + (n + 1) * part]);
    let levels = [0, 1, 2, 3].map(level);
    let floor = (0.03 * speed.peak).max(speed.floor() / count(part).sqrt());
    let same = levels.iter().all(|w| w.signum() == levels[0].signum());
    let rises = levels.windows(2).all(|w| w[1].abs() > w[0].abs());
    same && rises && levels[0].abs() > 0.1 * speed.peak && levels[3].abs() - levels[1].abs() > floor
}

/// Detects a constant speed without voltage from the start of the recording on, although the speed changes fast under voltage.
fn keeps_moving(view: &View<'_>, speed: &Channel<'_>, run: &Range<usize>) -> Option<Range<usize>> {
    let count = run.len();
    if run.start > 0 || count < 2 * SAMPLES_MIN || run.end + count / 2 > view.len() {
        return None;
    }
    let values = speed.values;
    let (first, last) = (mean(&values[..count / 3]), mean(&values[count - count / 3..count]));
    let floor = (MOVES * speed.peak).max(speed.floor());
    let after = values[run.end..(run.end + count).min(values.len())].iter();
    let change = after.fold(0.0, |change: f64, w| change.max((w - last).abs()));
    let drift = (last - first).abs();
    let stays = first.abs() > floor && last.abs() > floor && drift < 0.03 * first.abs();
    (stays && change > (5.0 * drift).max(0.05 * speed.peak).max(speed.floor())).then(|| run.clone())
}

/// Returns true if the speed is constant, noise or flicker of an encoder although there is a voltage.
fn does_not_move(view: &View<'_>, speed: &Channel<'_>) -> bool {
    if view.input.peak == 0.0 {
        return false;
    }
    let varies = view.input.range > 0.2 * view.input.peak;
    if speed.range == 0.0 {
        return varies || speed.peak == 0.0;
    }
    let values = speed.values;
    if !varies {
        return stands(speed);
    }
    let changes = values.windows(2).filter(|w| w[0].to_bits() != w[1].to_bits()).count();
    // An encoder flickers by one count.
    let flickers = speed.range <= 2.01 * speed.quantum && count(changes) < 0.02 * count(values.len());
    let is_noise = speed.noise > 0.0 && standard_deviation(values) < 1.25 * speed.noise;
    (flickers || is_noise) && !follows(view, values)
}

/// Returns true if the speed is noise about zero, or flickers by one encoder count.
fn stands(speed: &Channel<'_>) -> bool {
    let values = speed.values;
    let (level, spread) = (mean(values).abs(), standard_deviation(values));
    let halves = values.split_at(values.len() / 2);
    let drift = (mean(halves.0) - mean(halves.1)).abs();
    let error = 4.0 * spread / count(values.len()).sqrt();
    let is_noise = speed.noise > 0.0 && spread < 1.25 * speed.noise && level < error && drift < 2.0 * error;
    let zeros = values.iter().filter(|w| **w == 0.0).count();
    is_noise || count(zeros) > 0.9 * count(values.len()) && speed.range <= 2.01 * speed.quantum
}

/// Returns true if a signal correlates with the voltage or its running sum, at any of several lags.
fn follows(view: &View<'_>, values: &[f64]) -> bool {
    let size = values.len();
    let sure = 4.5 / count(size).sqrt();
    let middle = mean(view.input.values);
    let slow = running_sums(view.input.values.iter().map(|v| v - middle));
    let lags = [0, 1, 2, 3, 5, 8, 13, 21, 34, 55].into_iter().filter(|lag| lag + SAMPLES_MIN <= size);
    lags.into_iter().any(|lag| {
        let later = &values[lag..];
        let (now, summed) = (&view.input.values[..size - lag], &slow[..size - lag]);
        correlation(now, later).abs() > sure || correlation(summed, later).abs() > 2.0 * sure
    })
}

/// Returns the correlation coefficient of two signals; 0 if one is constant.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let (mean_a, mean_b) = (mean(a), mean(b));
    let product: f64 = a.iter().zip(b).map(|(a, b)| (a - mean_a) * (b - mean_b)).sum();
    let size = standard_deviation(a) * standard_deviation(b) * count(a.len());
    if size > 0.0 { product / size } else { 0.0 }
}
