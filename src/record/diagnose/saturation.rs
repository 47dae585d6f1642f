//! A speed that no longer follows the voltage, where the voltage never stands for long.

use super::lag::{Blocks, COARSE, FINE_BLOCKS, Fit, ONE_LAG, TWO_LAGS};
use super::{Channel, Finding, Quantity, View};
use crate::numeric::{count, runs};
use crate::text::significant;
use std::ops::Range;

/// Levels, in parts of the largest voltage, above which the speed may be flat.
const LEVELS: [f64; 13] = [0.25, 0.32, 0.39, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9];
/// Parts of it around the best of them that are tried then.
const NEAR: [f64; 9] = [-0.24, -0.16, -0.1, -0.05, -0.025, 0.0, 0.025, 0.05, 0.1];
/// The residuals of a fit without saturation show an effect from so many times the noise of the speed on.
const NOISE: f64 = 1.5;
/// The gain above a level over that below it, at most.
const FLAT: f64 = 0.25;
/// A fit without saturation leaves so many times the sum of squares of one with it.
const BETTER: f64 = 2.0;
/// The residuals of both fits are at most this part of the squares of the speed: else there is another effect.
const LEFT: f64 = 0.05;
/// The part of the speed that a fit without saturation misses.
const SEEN: f64 = 0.02;
/// The voltage is above the level for this part of the time constant at least, on the average: else the speed is not flat.
const LASTS: f64 = 0.87;
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
    let blocks = |count, lags| Blocks::new(view.input.values, speed.values, count, lags);
    let coarse = blocks(COARSE, &ONE_LAG);
    let Some(linear) = linear(view, speed, &coarse, None) else { return };
    let Some(of_coarse) = best_level(view, &coarse, linear.constant, &LEVELS) else { return };
    // Blocks hide what is faster, and one lag what the winding does.
    let fine = blocks(FINE_BLOCKS, &TWO_LAGS);
    let samples = count(coarse.length) / count(fine.length);
    let Some(linear) = self::linear(view, speed, &fine, Some(samples * linear.constant)) else { return };
    let levels = NEAR.map(|part| of_coarse.level + part);
    findings.extend(
        best_level(view, &fine, linear.constant, &levels).and_then(|best| finding(view, &fine, &linear, &best)),
    );
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

/// Friction takes a speed of the sign of the voltage.
fn friction(view: &View<'_>) -> impl Fn(f64) -> f64 {
    let least = 0.05 * view.input.peak;
    move |v| if v.abs() > least { v.signum() } else { 0.0 }
}

/// The fit without saturation, if the noise of the speed does not explain what it leaves.
fn linear(view: &View<'_>, speed: &Channel<'_>, blocks: &Blocks<'_>, near: Option<f64>) -> Option<Fit> {
    let fit = blocks.fit(&[&|v| v, &friction(view), &|_| 1.0], near, |_| true)?;
    let noise = speed.noise.powi(2) * count(blocks.speed.len()) / count(blocks.length);
    (fit.left >= NOISE * noise).then_some(fit)
}

/// A fit with a gain up to a level, in parts of the largest voltage, and another above it.
struct Level {
    level: f64,
    constant: f64,
    left: f64,
    gains: [f64; 2],
}

/// The best fit with a saturation at one of the levels.
fn best_level(view: &View<'_>, blocks: &Blocks<'_>, constant: f64, levels: &[f64]) -> Option<Level> {
    let peak = view.input.peak;
    let share = |test: &dyn Fn(f64) -> bool| {
        count(blocks.volts.iter().filter(|v| test(v.abs() / peak)).count()) / count(blocks.volts.len())
    };
    let fit = |level: f64| {
        if level < LEVELS[0] - 0.05
            || share(&|part| part > level + 0.08) < SHARE
            || share(&|part| part > 0.3 * level && part < level) < SHARE
        {
            return None;
        }
        let above = |v: f64| (v.abs() - level * peak).max(0.0) * v.signum();
        let is_flat = |g: &super::regression::Row| g[0] > 0.0 && (g[0] + g[3]).abs() < FLAT * g[0];
        let fit = blocks.fit(&[&|v| v, &friction(view), &|_| 1.0, &above], Some(constant), is_flat)?;
        Some(Level {
            level,
            constant: fit.constant,
            left: fit.left,
            gains: [fit.gains[0], fit.gains[0] + fit.gains[3]],
        })
    };
    levels.iter().filter_map(|level| fit(*level)).min_by(|a, b| a.left.total_cmp(&b.left))
}

fn finding(view: &View<'_>, blocks: &Blocks<'_>, linear: &Fit, best: &Level) -> Option<Finding> {
    let squares = blocks.squares();
    if linear.left < (BETTER * best.left).max(best.left + SEEN * SEEN * squares) || best.left > LEFT * squares {
        return None;
    }
    let above_level = |n: usize| view.input.values[n].abs() > best.level * view.input.peak;
    let flat = runs(view.len(), above_level);
    let mean_flat = count(flat.iter().map(Range::len).sum()) / count(flat.len().max(1));
    let lasts = mean_flat / (best.constant * count(blocks.length));
    if lasts < LASTS {
        return None;
    }
    let [below, above] = best.gains;
    let [first, last, from] = [below, above, best.level * view.input.peak].map(|value| significant(value, 3));
    let message =
        format!("the speed stops rising with the voltage: {first} rad/s per V at first, {last} above about {from} V");
    let remedy = "Leave the highest voltages out, and check the drive's range and its supply.";
    let finding = Finding::new("speed_saturates", Quantity::Speed, message, remedy);
    Some(finding.figure("gain_first", below).figure("gain_last", above))
}
