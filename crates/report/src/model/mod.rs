//! Results with a user's model: documents and pages in the signals and units of the model.

mod document;
mod inspect;
#[cfg(feature = "pages")]
mod inspect_page;
#[cfg(feature = "pages")]
mod mathml;
#[cfg(feature = "pages")]
mod page;
mod results;

pub use document::model_check_document;
pub use inspect::{ModelInspection, ModelSignalFacts, model_inspect_document};
#[cfg(feature = "pages")]
pub use inspect_page::model_inspect_page;
#[cfg(feature = "pages")]
pub use page::model_check_page;
