//! Hardware: which device evaluates, the throughput measured on it, and searches driven on it batch by batch.

mod batch_search;
mod select;
mod threads;
mod throughput_profile;

pub use batch_search::BatchSearchEvaluator;
pub use select::{DeviceSettings, DeviceSpec, OnLoss, PrecisionSpec};
pub use threads::with_threads;
pub use throughput_profile::{AdapterThroughput, ThroughputCurve, ThroughputProfile, Work};
