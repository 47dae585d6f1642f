//! A speed that no longer follows the voltage, where the voltage never stands for long.

use super::lag::Blocks;
use super::{Channel, Finding, Quantity, View};
use crate::numeric::count;
use crate::text::significant;

/// Levels, in parts of the largest voltage, above which the speed may be flat.
const LEVELS: [f64; 13] = [0.25, 0.32, 0.39, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9];
/// The residuals of a fit without saturation show an effect from so many times the noise of the speed on.
const NOISE: f64 = 1.5;
/// The gain above a level over that below it, at most.
const FLAT: f64 = 0.25;
/// A fit without saturation leaves so many times the sum of squares of one with it.
const BETTER: f64 = 1.7;
/// The residuals of both fits are at most this part of the squares of the speed: else there is another effect.
const LEFT: f64 = 0.1;
/// The part of samples in the flat range, and in the range below it.
const SHARE: f64 = 0.04;

pub(super) fn saturation(view: &View<'_>, findings: &mut Vec<Finding>) {
    let is_known =
        findings.iter().any(|finding| matches!(finding.code, "speed_saturates" | "speed_falls" | "no_motion"));
    let Some(speed) = view.speed.as_ref().filter(|speed| speed.range > 0.0 && !view.loaded && !is_known) else {
        return;
    };
    if view.len() < 100 || view.input.range == 0.0 || !is_graded(view) {
        return;
    }
    findings.extend(saturates(view, speed, &Blocks::new(view.input.values, speed.values)));
}

/// Returns whether the voltage takes many values in its upper half: a binary one shows no saturation.
fn is_graded(view: &View<'_>) -> bool {
    let mut bins = [0_u32; 10];
    for v in view.input.values {
        let part = v.abs() / view.input.peak;
        if part >= 0.5 {
            bins[crate::numeric::whole(20.0 * (part - 0.5)).min(9)] += 1;
        }
    }
    bins.iter().filter(|bin| **bin > 0).count() >= 5
}

fn saturates(view: &View<'_>, speed: &Channel<'_>, blocks: &Blocks) -> Option<Finding> {
    let peak = view.input.peak;
    let plain = |v: f64| v;
    // Friction takes a speed of the sign of the voltage.
    let sign = |v: f64| if v.abs() > 0.05 * peak { v.signum() } else { 0.0 };
    let one = |_: f64| 1.0;
    let linear = blocks.fit(&[&plain, &sign, &one], None, |_| true)?;
    let noise = speed.noise.powi(2) * count(blocks.speed.len()) / count(blocks.length);
    if linear.left < NOISE * noise {
        return None;
    }
    let share = |test: &dyn Fn(f64) -> bool| {
        count(blocks.volts.iter().filter(|v| test(v.abs() / peak)).count()) / count(blocks.volts.len())
    };
    let mut best: Option<(f64, [f64; 2], f64)> = None;
    for level in LEVELS {
        if share(&|part| part > level + 0.08) < SHARE || share(&|part| part > 0.3 * level && part < level) < SHARE {
            continue;
        }
        let above = |v: f64| (v.abs() - level * peak).max(0.0) * v.signum();
        let is_flat =
            |c: &super::regression::Row| c[0] > 0.0 && c[0] + c[3] < FLAT * c[0] && c[0] + c[3] > -FLAT * c[0];
        let Some(fit) = blocks.fit(&[&plain, &sign, &one, &above], Some(linear.constant), is_flat) else { continue };
        if best.is_none_or(|(left, ..)| fit.left < left) {
            let gains = [fit.solution.coefficients[0], fit.solution.coefficients[0] + fit.solution.coefficients[3]];
            best = Some((fit.left, gains, level * peak));
        }
    }
    let (left, [below, above], volts) = best?;
    if linear.left < BETTER * left || left > LEFT * blocks.squares() {
        return None;
    }
    let [first, last, from] = [below, above, volts].map(|value| significant(value, 3));
    let message =
        format!("the speed stops rising with the voltage: {first} rad/s per V at first, {last} above about {from} V");
    let remedy = "Leave the highest voltages out, and check the drive's range and its supply.";
    let finding = Finding::new("speed_saturates", Quantity::Speed, message, remedy);
    Some(finding.figure("gain_first", below).figure("gain_last", above))
}
