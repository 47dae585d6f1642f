//! Results as others read them.

mod bench;
mod document;
#[cfg(feature = "plot")]
pub mod plot;

pub use bench::BenchDocument;
pub use document::{Devices, EvaluateDocument, IdentifyDocument, InspectDocument, Names, SignalFacts, json};
