//! Studies: many runs, seen together.

mod contender;
mod measurement;
mod slice;
mod throughput;

pub use contender::{Contender, Contenders, contenders};
pub use measurement::{Control, Measurement, Throughput};
pub use slice::{CostMap, cost_map};
pub use throughput::{ThroughputSpec, throughput};
