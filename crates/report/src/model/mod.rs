//! Results with a user's model: documents and pages in the signals and units of the model.

mod document;
mod inspect;
#[cfg(feature = "pages")]
mod inspect_page;
#[cfg(feature = "pages")]
mod mathml;
#[cfg(feature = "pages")]
mod page;

#[cfg(feature = "pages")]
pub(super) use document::integration;
pub use document::{model_check_document, model_costs_document, model_document};
pub use inspect::{ModelSignalFacts, model_inspect_document};
#[cfg(feature = "pages")]
pub use inspect_page::{ModelInspection, model_inspect_page};
#[cfg(feature = "pages")]
pub(super) use page::{model_chart, model_correlations};
#[cfg(feature = "pages")]
pub use page::{model_check_page, model_figure, model_page};
#[cfg(feature = "pages")]
mod selection;
#[cfg(feature = "pages")]
pub use selection::{model_selection_table, model_selection_text};
