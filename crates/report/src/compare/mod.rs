//! JSON document and tables of a comparison.

mod cells;
mod document;
mod paper;
mod parameters;
mod responses;
mod tables;

pub(super) use cells::cell;
pub use cells::setting_name;
pub use document::compare_document;
pub use paper::paper_tables;
pub(super) use parameters::best;
pub use responses::curves;
pub(super) use responses::modelled;
pub use tables::{invariance, quartiles, tables};
