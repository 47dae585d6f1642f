//! Studies of many runs: comparisons of methods, sweeps, cost maps, and the throughput of evaluators.

#![forbid(unsafe_code)]
// Counts are converted by the functions of `numeric`.
#![cfg_attr(not(test), warn(clippy::cast_precision_loss, clippy::cast_sign_loss))]

mod bench_problem;
pub mod compare;
mod contender;
mod limits;
mod measurement;
pub mod settings;
mod slice;
mod statistics;
pub mod suite;
pub mod sweep;
mod throughput;

pub use contender::{Contender, Contenders, contenders, model_contenders};
pub use limits::limits;
pub use measurement::{Control, Crossover, Measurement, Throughput};
pub use slice::{CostMap, MapParameter, cost_map, model_cost_map};
pub use throughput::{ThroughputSpec, throughput};

/// Runs the example of the README as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}
