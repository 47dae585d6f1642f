//! Tables, JSON document, page and IOHprofiler files of a suite.

mod document;
mod ioh;
mod page;
mod tables;

pub use document::suite_document;
pub use ioh::ioh_files;
pub use page::suite_page;
pub use tables::{suite_csv, suite_tables};
