//! JSON documents, tables, figures, page and Parquet file of a sweep.

mod capability;
mod document;
mod figures;
mod line;
mod motors;
mod page;
#[cfg(feature = "parquet")]
mod parquet;
#[cfg(test)]
mod sample;
mod tables;
mod terminal;
#[cfg(test)]
mod tests;
mod trust;
mod words;

pub use document::{status_document, sweep_document, tally_document};
pub use line::all_within_limits;
pub use motors::motors_csv;
pub use page::{sweep_answer, sweep_page, sweep_parts};
#[cfg(feature = "parquet")]
pub use parquet::write_parquet;
pub use tables::sweep_tables;
pub use terminal::shortened;
