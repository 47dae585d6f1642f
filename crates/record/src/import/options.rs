//! Options of the import.

use super::bad_rows::BadRows;
use super::named::SignalRequest;
use crate::requests::ColumnRequest;
use crate::time::Gaps;

/// Options of the import of files.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReadOptions {
    /// Columns that the user assigns to quantities; headings assign the others.
    pub columns: Vec<ColumnRequest>,
    /// Sample rate \[Hz\] of files without a time column.
    pub rate_hz: Option<f64>,
    /// Name of the sheet of a workbook, or of the list of a JSON file; `None` selects the first sheet
    /// with numbers or the only list.
    pub sheet: Option<String>,
    /// Treatment of rows that cannot be read.
    pub bad_rows: BadRows,
    /// Treatment of gaps in time.
    pub gaps: Gaps,
    /// True if rows that repeat the time of the row before are skipped.
    pub drop_repeats: bool,
    /// Signals of a model, inputs first, that are read in place of the known quantities.
    pub signals: Vec<SignalRequest>,
}
