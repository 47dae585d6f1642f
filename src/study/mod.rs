//! Studies: many runs, seen together.

mod throughput;

pub use throughput::{Contender, Measurement, Throughput, ThroughputSpec, contenders, throughput};
