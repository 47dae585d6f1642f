//! Presentation of results: JSON documents, tables, figures, HTML pages, and the command-line spelling of settings.

#![forbid(unsafe_code)]
// Counts are converted by the functions of `numeric`.
#![cfg_attr(not(test), warn(clippy::cast_precision_loss, clippy::cast_sign_loss))]

mod bench;
#[cfg(feature = "pages")]
mod chart;
#[cfg(feature = "pages")]
pub mod compare;
#[cfg(feature = "pages")]
mod compare_page;
mod curves;
mod document;
mod estimate_rows;
mod export;
#[cfg(feature = "pages")]
pub mod figures;
#[cfg(feature = "pages")]
mod held_out;
mod identified;
#[cfg(feature = "pages")]
mod identified_tables;
#[cfg(feature = "pages")]
mod identify_page;
mod inspect;
mod likelihood;
#[cfg(feature = "pages")]
mod likelihood_chart;
mod mechanism;
#[cfg(feature = "pages")]
mod mechanism_page;
mod model;
mod motor_results;
#[cfg(feature = "pages")]
mod notebook;
#[cfg(feature = "pages")]
mod page;
#[cfg(feature = "pages")]
mod pages;
mod recorded;
mod requested;
#[cfg(feature = "pages")]
mod residual_panels;
mod shown;
#[cfg(feature = "pages")]
mod signals;
mod spelling;
#[cfg(feature = "pages")]
pub mod suite;
#[cfg(feature = "pages")]
pub mod sweep;
#[cfg(feature = "pages")]
mod table;

pub use bench::bench_document;
#[cfg(feature = "pages")]
pub use chart::{AxisScale, Band, Chart, Figure, Form, Map, Mark, Panel, Series, heat_map};
#[cfg(feature = "pages")]
pub use compare_page::{compare_page, compare_parts};
pub use curves::columns_csv;
pub use document::{EvaluateDocument, devices_document, error_document, identify_document, json};
pub use estimate_rows::{EstimateRow, estimate_rows};
pub use export::{ExportFormat, Exported, ExportedParameter, exported_model, exported_motor};
pub use identified::{characteristics_lines, noise_floor_text, verdict, verdicts};
#[cfg(feature = "pages")]
pub use identified_tables::{selection_table, selection_text};
#[cfg(feature = "pages")]
pub use identify_page::{identify_page, identify_parts};
pub use inspect::{SignalFacts, SignalStatistics, inspect_document};
#[cfg(feature = "pages")]
pub use inspect::{inspect_page, record_figure};
pub use likelihood::likelihood_document;
#[cfg(feature = "pages")]
pub use likelihood_chart::likelihood_chart;
pub use mechanism::{
    FeedbackDesign, MechanismLine, mechanism_code, mechanism_document, mechanism_lines, mechanism_selection,
};
#[cfg(feature = "pages")]
pub use mechanism_page::mechanism_page;
pub use model::{ModelInspection, ModelSignalFacts, model_check_document, model_inspect_document};
#[cfg(feature = "pages")]
pub use model::{model_check_page, model_inspect_page};
#[cfg(feature = "pages")]
pub use notebook::{html_fragment, plain_text};
#[cfg(feature = "pages")]
pub use page::{Card, Item, Page, Part, Section, Trust};
#[cfg(feature = "pages")]
pub use pages::Reproduced;
pub use recorded::{Recorded, RecordedInput, RecordedOutput};
pub use requested::Requested;
#[cfg(feature = "pages")]
pub use residual_panels::{ResidualRow, residual_panels};
pub use shown::{Shown, curves_csv, signals_csv};
pub use spelling::command_line;
#[cfg(feature = "pages")]
pub use table::{Table, folded};

/// Runs the example of the README as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}
