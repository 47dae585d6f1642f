//! Options of the import.

use super::bad_rows::BadRows;
use crate::heading::Quantity;
use crate::requests::ColumnRequest;
use crate::time::Gaps;
use motorfit_core::units::{Unit, parse_unit};

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

/// A signal that a model needs.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalRequest {
    /// Name in the model.
    pub name: String,
    /// Heading of the column; the name if `None`.
    pub column: Option<String>,
    /// Unit of the values of the model, as written.
    pub unit_text: String,
    /// Unit of the values of the model.
    pub unit: Unit,
    /// True for an input, false for an output.
    pub is_input: bool,
    /// True if the recording may lack the signal.
    pub is_optional: bool,
}

impl SignalRequest {
    pub(super) fn heading(&self) -> &str {
        self.column.as_deref().unwrap_or(&self.name)
    }

    /// Returns true if the signal is the voltage of a motor.
    pub(super) fn is_voltage(&self) -> bool {
        self.known() == Some(Quantity::Voltage)
    }

    /// Returns the known quantity with the heading of the signal, such as the current.
    pub(super) fn known(&self) -> Option<Quantity> {
        let key = self.heading().to_lowercase().replace([' ', '-'], "_");
        let known = Quantity::COLUMNS.into_iter().filter(|quantity| *quantity != Quantity::Time);
        known.into_iter().find(|quantity| quantity.key() == key)
    }

    /// Returns factor and offset from a unit to that of the model.
    pub(super) fn conversion(&self, unit: &str) -> Option<(f64, f64)> {
        let readings = [unit.to_owned(), unit.replace('_', "/"), unit.replace('_', "*"), unit.replace("Nm", "N*m")];
        let by_table = readings.iter().filter_map(|unit| parse_unit(unit).ok()).find_map(|unit| unit.to(&self.unit));
        by_table.or_else(|| {
            let known = self.known()?;
            let factor = known.factor(unit)?;
            // The column of a known quantity fits a signal of its dimension only.
            parse_unit(known.unit()).ok().filter(|own| own.dimension == self.unit.dimension)?;
            Some((factor / self.unit.factor, -self.unit.offset / self.unit.factor))
        })
    }
}
