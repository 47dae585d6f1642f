//! Studies of many runs: comparisons of methods, sweeps, cost maps, and the throughput of evaluators.

pub mod compare;
mod contender;
mod limits;
mod measurement;
mod slice;
mod statistics;
pub mod suite;
pub mod sweep;
mod throughput;

pub use contender::{Contender, Contenders, contenders};
pub use limits::limits;
pub use measurement::{Control, Crossover, Measurement, Throughput};
pub use slice::{CostMap, cost_map};
pub use throughput::{ThroughputSpec, throughput};
