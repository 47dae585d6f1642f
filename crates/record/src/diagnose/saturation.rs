//! Rule on a speed that saturates, for voltages that are never constant for long.
//!
//! First-order lags are fitted with and without a lower gain above a level of the voltage.

use super::finding::Finding;
use super::lag::{Blocks, COARSE, FINE_BLOCKS, Fit, ONE_LAG, TWO_LAGS};
use super::view::{Channel, View};
use crate::heading::Quantity;
use motorfit_core::numeric::{count, runs};
use motorfit_core::text::significant;
use std::ops::Range;

/// Levels of saturation that are tried first, as fractions of the peak voltage.
const LEVELS: [f64; 13] = [0.25, 0.32, 0.39, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9];
/// Offsets from the best level that are tried afterwards, as fractions of the peak voltage.
const NEAR: [f64; 9] = [-0.24, -0.16, -0.1, -0.05, -0.025, 0.0, 0.025, 0.05, 0.1];
/// Smallest ratio of squared residuals without saturation to the noise of the speed at which another effect is tested.
const NOISE: f64 = 1.5;
/// Largest ratio of the gain above the level to the gain below it.
const FLAT: f64 = 0.25;
/// Smallest ratio of the squared residuals without saturation to those with it.
const BETTER: f64 = 2.0;
/// Largest ratio of the squared residuals with saturation to the variation of the speed; above it another effect is present.
const LEFT: f64 = 0.05;
/// Smallest effect of the saturation on the speed, relative to its variation.
const SEEN: f64 = 0.02;
/// Shortest mean time above the level, in time constants; otherwise the speed does not level off.
const LASTS: f64 = 0.87;
/// Smallest fraction of the samples in the flat range, and in the range below it.
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
    // Shorter blocks and a second lag confirm it: long blocks and a single lag hide fast dynamics and the winding.
    let fine = blocks(FINE_BLOCKS, &TWO_LAGS);
    let samples = count(coarse.length) / count(fine.length);
    let Some(linear) = self::linear(view, speed, &fine, Some(samples * linear.constant)) else { return };
    let levels = NEAR.map(|part| of_coarse.level + part);
    findings.extend(
        best_level(view, &fine, linear.constant, &levels).and_then(|best| finding(view, &fine, &linear, &best)),
    );
}

/// Returns true if the voltage takes many values in its upper half; a binary voltage cannot show saturation.
fn is_graded(view: &View<'_>) -> bool {
    let mut bins = [0_u32; 10];
    for v in view.input.values {
        let part = v.abs() / view.input.peak;
        if part >= 0.5 {
            bins[motorfit_core::numeric::whole(20.0 * (part - 0.5)).min(9)] += 1;
        }
    }
    bins.iter().filter(|bin| **bin > 0).count() >= 5
}

/// Returns the regressor of Coulomb friction: the sign of the voltage, and 0 below 5 % of its peak.
fn friction(view: &View<'_>) -> impl Fn(f64) -> f64 {
    let least = 0.05 * view.input.peak;
    move |v| if v.abs() > least { v.signum() } else { 0.0 }
}

/// Returns the fit without saturation if its residuals exceed the noise of the speed.
fn linear(view: &View<'_>, speed: &Channel<'_>, blocks: &Blocks<'_>, near: Option<f64>) -> Option<Fit> {
    let fit = blocks.fit(&[&|v| v, &friction(view), &|_| 1.0], near, |_| true)?;
    let noise = speed.noise.powi(2) * count(blocks.speed.len()) / count(blocks.length);
    (fit.sse >= NOISE * noise).then_some(fit)
}

/// Fit with one gain up to a level and another above it.
struct Level {
    /// Level as a fraction of the peak voltage.
    level: f64,
    /// Time constant \[blocks\].
    constant: f64,
    /// Sum of squared residuals.
    sse: f64,
    /// Gains below and above the level \[rad/s/V\].
    gains: [f64; 2],
}

/// Returns the best fit with saturation at one of the levels.
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
        Some(Level { level, constant: fit.constant, sse: fit.sse, gains: [fit.gains[0], fit.gains[0] + fit.gains[3]] })
    };
    levels.iter().filter_map(|level| fit(*level)).min_by(|a, b| a.sse.total_cmp(&b.sse))
}

fn finding(view: &View<'_>, blocks: &Blocks<'_>, linear: &Fit, best: &Level) -> Option<Finding> {
    let squares = blocks.squares();
    if linear.sse < (BETTER * best.sse).max(best.sse + SEEN * SEEN * squares) || best.sse > LEFT * squares {
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
        format!("the speed saturates: it rises by {first} rad/s per V at low voltages, by {last} above about {from} V");
    let remedy = "Leave out the highest voltages, and check the range of the drive and its supply.";
    let finding = Finding::new("speed_saturates", Quantity::Speed, message, remedy);
    Some(finding.figure("gain_first", below).figure("gain_last", above))
}
