//! Rule on a voltage that does not reach the motor because the drive is off: no current flows.

use super::finding::Finding;
use super::view::{Channel, View};
use crate::heading::Quantity;
use motorfit_core::numeric::{count, mean, order_statistic, runs};
use motorfit_core::setting::text;
use std::ops::Range;

/// Current, as a fraction of its peak, up to which it counts as zero.
const NONE: f64 = 0.02;
/// Current, in standard deviations of its noise, up to which it counts as zero.
const NOISES: f64 = 3.0;
/// Upper limit of the current by [`NOISES`] at the start, as a fraction of the peak.
const NONE_MOST: f64 = 0.06;
/// Fewest samples without current at the start; a dead time is shorter.
const FIRST_MIN: usize = 20;

pub(super) fn off(view: &View<'_>, findings: &mut Vec<Finding>) {
    let Some(current) = view.current.as_ref().filter(|c| c.range > 0.0 && view.len() >= 20 && !view.loaded) else {
        return;
    };
    // The estimated noise is limited: that of a current under a fast binary voltage is too large.
    let none = (NONE * current.peak).max((NOISES * current.noise).min(NONE_MOST * current.peak));
    let mut places: Vec<Range<usize>> = from_the_start(view, current, none).into_iter().collect();
    let first = places.first().map_or(0, |place| place.end);
    let none = (NONE * current.peak).max(NOISES * current.noise);
    if none <= 0.1 * current.peak {
        places.extend(without_current(view, current, none).into_iter().filter(|place| place.start >= first));
    }
    if places.is_empty() {
        return;
    }
    let samples = count(places.iter().map(Range::len).sum());
    let message = "there is a voltage but no current while the motor stands still or coasts: the drive was off";
    let remedy = text!(
        "Cut the recording there with " [Mask = "auto"] ", or record the voltage at the motor: a disabled drive does \
         not short it."
    );
    let finding = Finding::new("voltage_without_current", Quantity::Current, message, remedy);
    findings.push(finding.figure("samples", samples).at(places));
}

/// Detects a drive that is off at the first voltage: no current flows although the motor stands still, the voltage changes, or
/// the current later begins without a change of the voltage.
fn from_the_start(view: &View<'_>, current: &Channel<'_>, none: f64) -> Option<Range<usize>> {
    let (i, v, size) = (current.values, view.input.values, view.len());
    let begin = (0..size).find(|n| v[*n].abs() > 0.1 * view.input.peak)?;
    // Two of three samples, as a single one may be noise.
    let flows = |n: usize| i[n..(n + 3).min(size)].iter().filter(|i| i.abs() > none).count() >= 2;
    let end = (0..size).find(|n| flows(*n))?;
    let least = FIRST_MIN.max(size / 50);
    // A deadband can suppress small commands.
    let strong: Vec<usize> = (begin..end).filter(|n| v[*n].abs() > 0.5 * view.input.peak).collect();
    if strong.len() < 3 || end - strong[0] < least {
        return None;
    }
    let stands = |speed: &Channel<'_>| {
        let mut sizes: Vec<f64> = speed.values.iter().map(|w| w.abs()).collect();
        let still = (0.1 * order_statistic(&mut sizes, 0.95)).max(5.0 * speed.noise);
        speed.values[strong[0]..end].iter().all(|w| w.abs() <= still)
    };
    let is_off = match &view.speed {
        Some(speed) => stands(speed),
        // Without a measured speed the motor could run idle, but a change of the voltage would still cause a current.
        None => {
            changes(view, strong[0].max(1)..end - least / 2) || swings(view, i, none, &strong) || begins(view, i, end)
        }
    };
    is_off.then_some(begin..end)
}

/// Returns true if the voltage jumps within a range of samples, or was zero until shortly before it.
fn changes(view: &View<'_>, samples: Range<usize>) -> bool {
    let v = view.input.values;
    let from_rest = samples.start >= 10 && v[..samples.start - 2].iter().all(|v| v.abs() < 0.05 * view.input.peak);
    from_rest || samples.clone().any(|n| (v[n] - v[n - 1]).abs() > 0.3 * view.input.peak)
}

/// Returns true if later voltages of similar size and rate of change cause a current, which excludes a deadband.
fn swings(view: &View<'_>, i: &[f64], none: f64, strong: &[usize]) -> bool {
    let v = view.input.values;
    let (first, last) = (strong[0].max(1), strong[strong.len() - 1]);
    let extremes = motorfit_core::numeric::extremes(&v[first - 1..=last]);
    let rate = |n: usize| (v[n] - v[n - 1]).abs();
    let fastest = (first..=last).map(rate).fold(0.0, f64::max);
    let mut later: Vec<usize> = (last + 1..v.len() - 1).filter(|n| v[*n].abs() > 0.5 * view.input.peak).collect();
    later.retain(|n| rate(*n) <= fastest && rate(n + 1) <= fastest);
    let with = later.iter().filter(|n| i[**n].abs() > 2.0 * none).count();
    extremes[1] - extremes[0] > 0.3 * view.input.peak && later.len() > strong.len() && 10 * with > 8 * later.len()
}

/// Returns true if the current begins at a sample although the voltage does not change.
fn begins(view: &View<'_>, i: &[f64], at: usize) -> bool {
    let v = view.input.values;
    let around = at.saturating_sub(3)..(at + 3).min(v.len());
    let last = (at + (at / 10).max(3)).min(v.len());
    let rises = i[at..last].iter().any(|i| i.abs() > 0.3 * view.current.as_ref().map_or(0.0, |c| c.peak));
    // Current at the same voltages later excludes a deadband.
    let level = v[..at].iter().fold(0.0, |most: f64, v| most.max(v.abs()));
    let none = 0.05 * view.current.as_ref().map_or(0.0, |c| c.peak);
    let [mut with, mut all] = [0, 0];
    for n in (last..v.len()).filter(|n| v[*n].abs() > 0.5 * level && v[*n].abs() <= 1.02 * level) {
        (with, all) = (with + usize::from(i[n].abs() > none), all + 1);
    }
    let jumps = around.clone().skip(1).any(|n| (v[n] - v[n - 1]).abs() > 0.1 * view.input.peak);
    let was_constant = v[at / 2..at].iter().all(|of| (of - v[at]).abs() < 0.05 * view.input.peak);
    rises && !jumps && v[at].abs() > 0.3 * view.input.peak && (was_constant || 10 * with >= 9 * all)
}

/// Detects voltage without current at less than half of the speed proportional to the voltage, where v − K ω = R i cannot be 0.
fn without_current(view: &View<'_>, current: &Channel<'_>, none: f64) -> Vec<Range<usize>> {
    // The offset of the sensor, if the recording begins with a rest.
    let rest = view.first_rest();
    let offset = if rest.len() >= 10 { mean(&current.values[rest]) } else { 0.0 };
    // A quantile instead of the peak, which a single spike would determine.
    let fast = view.speed.as_ref().map(|speed| {
        let mut sizes: Vec<f64> = speed.values.iter().map(|w| w.abs()).collect();
        order_statistic(&mut sizes, 0.95)
    });
    let slow = |n: usize| match (&view.speed, fast) {
        (Some(speed), Some(fast)) => speed.values[n].abs() * view.input.peak < 0.5 * fast * view.input.values[n].abs(),
        _ => true,
    };
    let without =
        |n: usize| view.input.values[n].abs() > 0.5 * view.input.peak && (current.values[n] - offset).abs() <= none;
    let is_off = |n: usize| without(n) && slow(n);
    // A drive that turns off at a high speed is detected only after the motor has slowed down; the run is extended back.
    let whole = |run: Range<usize>| {
        let start = (0..run.start).rev().take_while(|n| without(*n)).last().unwrap_or(run.start);
        let end = (run.end..view.len()).take_while(|n| without(*n)).last().map_or(run.end, |n| n + 1);
        start..end
    };
    let least = (view.len() / 50).max(10);
    let from_the_edge = |run: &Range<usize>| {
        // Without a measured speed only a step from rest that never causes current differs from a motor without friction.
        view.constant_inputs.windows(2).any(|w| {
            let (rest, on) = (&w[0], &w[1].samples);
            let was_at_rest = rest.volts.abs() < 0.05 * view.input.peak && rest.samples.len() >= 10;
            was_at_rest && on.contains(&run.start) && run.start <= on.start + 1 && run.end + 1 >= on.end
        })
    };
    runs(view.len(), is_off)
        .into_iter()
        .filter(|run| run.len() >= least && (view.speed.is_some() || from_the_edge(run)))
        .map(whole)
        .collect()
}
