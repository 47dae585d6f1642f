//! Presentation of results: JSON documents, tables, figures, HTML pages, and the command-line spelling of settings.

mod bench;
#[cfg(feature = "report")]
mod chart;
#[cfg(feature = "report")]
pub mod compare;
mod curves;
mod document;
mod export;
#[cfg(feature = "report")]
pub mod figures;
#[cfg(feature = "report")]
mod held_out;
mod identified;
#[cfg(feature = "report")]
mod identified_tables;
#[cfg(feature = "report")]
mod identify_page;
mod inspect;
mod likelihood;
#[cfg(feature = "report")]
mod likelihood_chart;
mod mechanism;
#[cfg(feature = "report")]
mod mechanism_page;
mod model;
#[cfg(feature = "report")]
mod notebook;
#[cfg(feature = "report")]
mod page;
#[cfg(feature = "report")]
mod pages;
#[cfg(feature = "report")]
mod residual_panels;
mod spelling;
#[cfg(feature = "report")]
pub mod suite;
#[cfg(feature = "report")]
pub mod sweep;
#[cfg(feature = "report")]
mod table;

pub use bench::bench_document;
#[cfg(feature = "report")]
pub use chart::{AxisScale, Band, Chart, Form, Map, Mark, Panel, Series, heat_map};
pub use curves::{columns_csv, curves_csv};
pub use document::{EvaluateDocument, devices_document, error_document, identify_document, json};
pub use export::{ExportFormat, Exported, ExportedParameter, exported_model, exported_motor};
pub use identified::{characteristics_lines, noise_floor_text, verdicts};
#[cfg(feature = "report")]
pub use identified_tables::{selection_table, selection_text};
#[cfg(feature = "report")]
pub use identify_page::{identify_page, identify_parts};
pub use inspect::{SignalFacts, SignalStatistics, inspect_document};
#[cfg(feature = "report")]
pub use inspect::{inspect_page, record_figure};
pub use likelihood::likelihood_document;
#[cfg(feature = "report")]
pub use likelihood_chart::likelihood_chart;
pub use mechanism::{
    FeedbackDesign, MechanismLine, mechanism_code, mechanism_document, mechanism_lines, mechanism_selection,
};
#[cfg(feature = "report")]
pub use mechanism_page::mechanism_page;
#[cfg(feature = "report")]
pub use model::{ModelInspection, model_check_page, model_figure, model_inspect_page, model_page};
pub use model::{ModelSignalFacts, model_inspect_document};
pub use model::{model_check_document, model_costs_document, model_document};
#[cfg(feature = "report")]
pub use notebook::{html_fragment, plain_text};
#[cfg(feature = "report")]
pub use page::{Card, Figure, Item, Page, Part, Section, Trust};
#[cfg(feature = "report")]
pub use pages::{Reproduced, compare_page, compare_parts};
#[cfg(feature = "report")]
pub use residual_panels::{ResidualRow, residual_panels};
pub use spelling::command_line;
#[cfg(feature = "report")]
pub use table::{Table, folded};
