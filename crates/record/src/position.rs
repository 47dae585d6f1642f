//! Comparison of a speed with the position beside it: the position changes by the integral of the speed.

use motorfit_core::text::significant;
use std::f64::consts::{PI, TAU};

/// Number of blocks of a recording over which both are compared: single steps of a coarse encoder are noise.
const BLOCKS: usize = 20;
/// Relative difference between the speed and the derivative of the position from which a unit is wrong.
const RATIO: f64 = 0.1;
/// Share of the movement that the ratio must explain for the comparison to be conclusive.
const EXPLAINED: f64 = 0.8;

/// Ratios of the change of the position to the integral of the speed, each with the usual cause, as a sentence about `NAME`, the speed, and the
/// units of speed and position that agree; empty if there is more than one remedy.
const CAUSES: [(f64, &str, [&str; 2]); 10] = [
    (1.0 / 60.0, "the NAME may be per minute", [""; 2]),
    (TAU / 60.0, "the NAME may be in revolutions per minute", ["rpm", "rad"]),
    (60.0 / TAU, "the NAME may have been converted from revolutions per minute twice", [""; 2]),
    (TAU, "the position may be in radians, or the NAME in turns per second", ["turns/s", "rad"]),
    (1.0 / TAU, "the NAME may be in radians per second, or the position in turns", ["rad/s", "turns"]),
    (360.0, "the position may be in degrees, or the NAME in turns per second", [""; 2]),
    (1.0 / 360.0, "the NAME may be in degrees per second, or the position in turns", [""; 2]),
    (180.0 / PI, "the position may be in degrees", ["rad/s", "deg"]),
    (PI / 180.0, "the NAME may be in degrees per second", ["deg/s", "rad"]),
    (1000.0, "the position may be in thousandths of its unit", [""; 2]),
];

/// Returns the usual cause of a ratio, with the units of speed and position in place of rad/s and rad; `None` for another ratio, such as
/// that of a gear.
pub(super) fn cause(ratio: f64) -> Option<(&'static str, [&'static str; 2])> {
    let distance = |of: &&(f64, &str, [&str; 2])| (ratio / of.0).ln().abs();
    let nearest = CAUSES.iter().filter(|_| ratio > 0.0).min_by(|a, b| distance(a).total_cmp(&distance(b)));
    nearest.filter(|of| distance(of) < RATIO).map(|(_, cause, units)| (*cause, *units))
}

/// Returns the ratio of the change of a position to the integral of a speed over recordings, each with its times \[s\], positions and speeds;
/// `None` where they are not proportional to each other.
pub fn position_ratio<'a>(recordings: impl Iterator<Item = [&'a [f64]; 3]>) -> Option<f64> {
    let (mut product, mut integral, mut change) = (0.0, 0.0, 0.0);
    for [time_s, position, speed] in recordings {
        let last = time_s.len().min(position.len()).min(speed.len()).saturating_sub(1);
        let block = (last / BLOCKS).max(1);
        for from in (0..last).step_by(block) {
            let to = (from + block).min(last);
            let moved = |n: usize| 0.5 * (speed[n] + speed[n - 1]) * (time_s[n] - time_s[n - 1]);
            let moved: f64 = (from + 1..=to).map(moved).sum();
            let changed = position[to] - position[from];
            product += moved * changed;
            integral += moved * moved;
            change += changed * changed;
        }
    }
    let is_conclusive = product * product > EXPLAINED * integral * change && integral > 0.0;
    is_conclusive.then_some(product / integral).filter(|ratio| ratio.is_finite())
}

/// Describes a speed, called `name`, that is not the derivative of the position; `None` if the ratio is near 1.
#[must_use]
pub fn position_disagrees(ratio: f64, name: &str) -> Option<String> {
    if (ratio - 1.0).abs() < RATIO {
        return None;
    }
    let cause = cause(ratio).map(|(cause, _)| cause.replace("NAME", name));
    if ratio < 0.0 {
        return Some(format!("the position falls where the {name} is positive: one of them is reversed"));
    }
    let cause = cause.unwrap_or_else(|| "check gear ratio and units".to_owned());
    Some(format!("the position changes by {} times the integral of the {name}: {cause}", significant(ratio, 4)))
}
