//! Studies of many runs: comparisons of methods, sweeps, cost maps, and the throughput of evaluators.

pub mod compare;
mod contender;
mod limits;
mod measurement;
mod slice;
mod statistics;
mod subject;
pub mod suite;
pub mod sweep;
mod throughput;

pub use contender::{Contender, Contenders, contenders, model_contenders};
pub use limits::limits;
pub use measurement::{Control, Crossover, Measurement, Throughput};
pub use slice::{CostMap, MapParameter, cost_map, model_cost_map};
pub use subject::BenchSubject;
pub use throughput::{ThroughputSpec, throughput};
