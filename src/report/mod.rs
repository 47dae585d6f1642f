//! Results as others read them.

mod document;

pub use document::{Devices, IdentifyDocument, InspectDocument, Names, SignalFacts, json};
