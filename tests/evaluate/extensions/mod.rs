//! Proves: extensions follow their equations (oracles: closed forms, shifted inputs, simulations with finer steps); every CPU
//! and GPU evaluator agrees with the scalar oracle with extensions; extensions are estimated from simulated recordings with
//! standard errors that describe the spread.
//! Does not prove: that real motors behave so (see real.rs).
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::float_cmp, reason = "small numbers")]
#![allow(clippy::cast_precision_loss, reason = "small numbers")]

mod contract;
mod cutoffs;
#[cfg(feature = "gpu")]
mod gpu;
mod meaning;
mod recovery;

use motorfit::experiment::{Excitation, simulated};
use motorfit::motor::{Discretization, Extended, Parameter, Parameters};
use motorfit::record::Record;

/// Returns an excitation of `volts(n)` \[V\] with the period `h` \[s\].
fn excitation(count: u32, h: f64, volts: impl FnMut(u32) -> f64) -> Excitation {
    let time_s = (0..count).map(|n| f64::from(n) * h).collect();
    Excitation { time_s, voltage: (0..count).map(volts).collect(), torque: None }
}

/// Simulates a motor with extensions under a zero-order hold.
fn driven(motor: &Extended, excitation: &Excitation) -> Record {
    simulated(*motor, excitation, Discretization::Zoh).unwrap()
}

fn with(values: &[(Parameter, f64)]) -> Extended {
    values.iter().fold(Extended::from(&Parameters::M2), |all, (parameter, value)| all.with(*parameter, *value))
}
