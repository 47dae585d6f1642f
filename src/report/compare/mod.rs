//! JSON document and tables of a comparison.

mod document;
mod paper;
mod tables;

pub use document::compare_document;
pub use paper::paper_tables;
pub(super) use tables::{best, cell};
pub use tables::{invariance, quartiles, setting_name, tables};
