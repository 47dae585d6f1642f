//! JSON document and tables of a comparison.

mod document;
mod paper;
mod parameters;
mod responses;
mod tables;

pub use document::compare_document;
pub use paper::paper_tables;
pub(super) use parameters::best;
pub use responses::curves;
pub(super) use responses::modelled;
pub(super) use tables::cell;
pub use tables::{invariance, quartiles, setting_name, tables};
