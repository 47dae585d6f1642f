//! Results as others read them.

mod bench;
mod document;

pub use bench::BenchDocument;
pub use document::{Devices, EvaluateDocument, IdentifyDocument, InspectDocument, Names, SignalFacts, json};
