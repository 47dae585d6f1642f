//! The DC motor: parameters with units, search space, one-step maps, simulation, step-response metrics.
//!
//! Model (Eqs. 6 and 7), state `[i, ω]`: `di/dt = (v − R i − K ω)/L`, `dω/dt = (K i − B ω − T)/J`, with voltage v \[V\] and
//! load torque T \[N·m\].
//!
//! Each effect of an extension (`drive`, `delay`, `friction`, `sensor`) has one file, which the scalar oracle, its
//! derivatives and the SIMD kernel share, and a WGSL file of the same name in `shaders/` with the same order of operations.
//! A delay has two: `delay` for any clock, and `delay_taps` for regular clocks, whose operations `shaders/delay.wgsl` follows.

#![forbid(unsafe_code)]
// Counts are converted by the functions of `numeric`.
#![cfg_attr(not(test), warn(clippy::cast_precision_loss, clippy::cast_sign_loss))]

mod composed;
mod delay;
mod delay_taps;
mod discretize;
mod drive;
mod dual;
mod extended;
mod extension;
mod features;
mod friction;
mod interleave;
mod linear;
mod matrix;
mod parameter;
mod remainder;
mod response;
mod sensor;
mod settings;
mod simulate;
mod space;
mod transition_integral;
mod walk;

pub use composed::SplitSteps;
pub use delay::{Change, DelayedVoltage, sample_times};
pub use delay_taps::{Commanded, DelayTaps, SpecialStep, TapGains, needs_times};
pub use discretize::seeded;
pub use discretize::{Discretization, Input, Method, StepMap, StepMaps, step_maps};
pub use drive::DriveNonlinearity;
pub use dual::multiply_add;
pub use dual::{Dual, Number};
pub use extended::Extended;
pub use extension::{Extension, Needs, With};
pub use features::ModelFeatures;
pub use friction::{Bend, Reactions, margin_to_passage, passed};
pub use interleave::{Aligned, CHUNK, GROUP, interleave};
pub use linear::Parameters;
pub use matrix::{Matrix2, inverse, matrix_logarithm, product, times};
pub use parameter::{DefaultBounds, Parameter};
pub use response::{StepResponse, response};
pub use sensor::WINDOW_MAX;
pub use sensor::{MovingAverage, MovingAverages};
pub use settings::{InputHistory, SimulationSettings};
pub use simulate::{SimulationInput, simulate, walk};
pub use space::{Axis, PER_RECORDING_MAX, RECORDING_MAX, Scope, Space};
pub use transition_integral::{Dynamics, TransitionIntegrals};
pub use walk::ExtendedWalk;

/// Runs the example of the README as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}
