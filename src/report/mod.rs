//! Results as others read them.

mod document;

pub use document::{Devices, EvaluateDocument, IdentifyDocument, InspectDocument, Names, SignalFacts, json};
