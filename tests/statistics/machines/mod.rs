//! Proves: random machines of five built-in models, simulated with independent equations and located changes of friction, contact and
//! limits, are identified at 40 dB without options: optima are reached, 95 % intervals cover the truth, and no result with the level
//! good is wrong. `MOTORFIT_FULL=1` takes thirty machines of each.
//! Does not prove: real machines, errors of the recording.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]

mod dc_extended;
mod draw;
mod exact;
mod integrator;
mod judge;
mod pmsm;
mod servo;
mod study;
mod thermal;
mod two_mass;

use motorfit::model::BuiltIn;
use study::{Limits, judge};

const LIMITS: Limits = Limits { machines: 0..6, reached: 0.95, good: 0.9, coverage: [0.93, 0.97], errors: &[] };

// The test with the longest identifications has the first name, because tests begin in the order of their names.
#[test]
fn a_shaft_with_play_is_identified() {
    // Without descents around the lowest ends 9 of the first 28 machines were missed, and two of these, machine 15 among them, were
    // certified as good with only 1 of 20 starts in that optimum and B2 off by up to 12.1 standard errors.
    judge(BuiltIn::TwoMass, two_mass::draw, &Limits { machines: 15..16, good: 0.5, ..LIMITS });
}

#[test]
fn dc_extended_is_identified() {
    // All of 30 optima were reached and 95.4 % of 390 intervals cover; 4 machines are flagged as not accurate.
    judge(BuiltIn::DcExtended, dc_extended::draw, &Limits { machines: 0..2, good: 0.75, ..LIMITS });
}

#[test]
fn dc_thermal_is_identified() {
    judge(BuiltIn::DcThermal, thermal::draw, &Limits { machines: 0..2, ..LIMITS });
}

#[test]
fn pmsm_is_identified() {
    judge(BuiltIn::Pmsm, pmsm::draw, &Limits { errors: &[("R", 0.02), ("Ld", 0.05), ("Lq", 0.05)], ..LIMITS });
}

#[test]
fn servo_pendulum_is_identified() {
    // All of 30 optima were reached and 94.9 % of 296 intervals cover, but 26 machines are flagged, 24 of them as not accurate: no share
    // of the level good is required. B and Tc of flagged machines were off by up to 5.9 standard errors.
    judge(BuiltIn::ServoPendulum, servo::draw, &Limits { machines: 0..4, good: 0.0, ..LIMITS });
}
