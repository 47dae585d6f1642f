//! Proves: random machines of five built-in models, simulated with independent equations and located changes of friction, contact and
//! limits, are identified at 40 dB without options: optima are reached, 95 % intervals cover the truth, and no result with the level
//! good is wrong. `MOTORFIT_MACHINES=100` runs the full study.
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

const LIMITS: Limits = Limits { machines: 8, reached: 0.95, good: 0.9, coverage: [0.93, 0.97], errors: &[] };

#[test]
fn pmsm_is_identified() {
    judge(BuiltIn::Pmsm, pmsm::draw, &Limits { errors: &[("R", 0.02), ("Ld", 0.05), ("Lq", 0.05)], ..LIMITS });
}

#[test]
fn dc_thermal_is_identified() {
    judge(BuiltIn::DcThermal, thermal::draw, &LIMITS);
}

#[test]
fn servo_pendulum_is_identified() {
    judge(BuiltIn::ServoPendulum, servo::draw, &LIMITS);
}

#[test]
fn two_mass_is_identified() {
    judge(BuiltIn::TwoMass, two_mass::draw, &LIMITS);
}

#[test]
fn dc_extended_is_identified() {
    judge(BuiltIn::DcExtended, dc_extended::draw, &LIMITS);
}
