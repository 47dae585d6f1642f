//! Evaluation of batches of candidates: each candidate motor is simulated on the recordings of a problem, and its cost is
//! computed from the errors.
//!
//! The unit of work is (candidate, recording). Kernels return one weighted sum of errors per channel, and the cost is computed
//! from the sums by the same code for every evaluator. A batch has groups, each with its own problem, so that many runs on many
//! recordings are evaluated in one call.

#![forbid(unsafe_code)]
// Counts are converted by the functions of `numeric`.
#![cfg_attr(not(test), warn(clippy::cast_precision_loss, clippy::cast_sign_loss))]

mod affine;
mod at_level;
mod coarse_clock;
mod cpu;
pub mod criterion;
mod cutoff;
mod delayed;
mod evaluator;
pub mod experiment;
mod extended;
mod filled;
mod initial;
mod input;
pub mod interpreter;
mod irregular;
mod kernel;
mod lanes;
pub mod model;
mod motor_problem;
mod order;
mod packed;
mod path;
mod pole_tables;
mod problem;
mod recordings;
mod same_problem;
mod scalar;
mod scales;
mod search_problem;
mod segment;
mod signals;
mod simd;
mod step;
mod taps;
mod uneven;

#[doc(hidden)]
pub use at_level::at_level;
pub use cpu::{Level, cpu_name, fma_loop};
pub use evaluator::{Batch, Evaluator, Group, Pending};
pub use initial::Initial;
pub use pole_tables::PoleTables;
pub use problem::{Model, Problem};
pub use scalar::Scalar;
pub use search_problem::{CandidateValue, SearchProblem};
pub use segment::Run;
pub use signals::{Signals, noise_share};
pub use simd::Simd;

/// Runs the example of the README as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}
