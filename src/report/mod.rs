//! Results as others read them.

mod bench;
#[cfg(feature = "report")]
pub mod compare;
mod document;
#[cfg(feature = "report")]
pub mod plot;
#[cfg(feature = "report")]
mod table;

pub use bench::BenchDocument;
pub use document::{Devices, EvaluateDocument, IdentifyDocument, InspectDocument, Names, SignalFacts, json};
#[cfg(feature = "report")]
pub use table::{Table, folded};
