//! Studies: many runs, seen together.

mod slice;
mod throughput;

pub use slice::{CostMap, cost_map};
pub use throughput::{Contender, Measurement, Throughput, ThroughputSpec, contenders, throughput};
