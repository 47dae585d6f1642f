//! A comparison as others read it.

mod document;
mod paper;
mod tables;

pub use document::CompareDocument;
pub use paper::paper_tables;
pub(super) use tables::cell;
pub use tables::{quartiles, setting_name, tables};
