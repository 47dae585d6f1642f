//! Results with a user's model: documents and pages in the signals and units of the model.

mod document;
mod inspect;
#[cfg(feature = "report")]
mod inspect_page;
#[cfg(feature = "report")]
mod mathml;
#[cfg(feature = "report")]
mod page;

#[cfg(feature = "report")]
pub(super) use document::integration;
pub use document::{model_check_document, model_costs_document, model_document};
pub use inspect::{ModelSignalFacts, model_inspect_document};
#[cfg(feature = "report")]
pub use inspect_page::{ModelInspection, model_inspect_page};
#[cfg(feature = "report")]
pub(super) use page::{model_chart, model_correlations};
#[cfg(feature = "report")]
pub use page::{model_check_page, model_figure, model_page};
