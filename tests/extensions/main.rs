//! Proves: what extensions mean (closed forms, shifted inputs, finer simulations); that every evaluator of the CPU and of
//! GPUs means what the oracle means with any of them; that derivatives are those of differences; that extensions are recovered
//! from
//! recordings of known truth, with standard errors that hold.
//! Does not prove: that real motors are like that (see real.rs).
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::float_cmp, reason = "small numbers")]
#![allow(clippy::cast_precision_loss, reason = "small numbers")]

#[path = "../support/mod.rs"]
mod support;

mod contract;
#[cfg(feature = "gpu")]
mod gpu;
mod meaning;
mod recovery;

use motorfit::experiment::{Excitation, simulated};
use motorfit::motor::{Discretization, Extended, Parameter, Parameters};
use motorfit::record::Record;

/// Voltages `volts(n)` in steps of `h` seconds.
fn excitation(count: u32, h: f64, volts: impl FnMut(u32) -> f64) -> Excitation {
    let time_s = (0..count).map(|n| f64::from(n) * h).collect();
    Excitation { time_s, voltage: (0..count).map(volts).collect(), torque: None }
}

/// Simulates the motor of the paper with these extensions.
fn driven(motor: &Extended, excitation: &Excitation) -> Record {
    simulated(*motor, excitation, Discretization::Zoh).unwrap()
}

fn with(values: &[(Parameter, f64)]) -> Extended {
    values.iter().fold(Extended::from(&Parameters::M2), |all, (parameter, value)| all.with(*parameter, *value))
}
