//! Specification of the table to read.

use super::bad_rows::BadRows;
use super::options::{ReadOptions, SignalRequest};
use super::parse::Separator;
use crate::heading::Quantity;
use crate::requests::ColumnRequest;

/// Quantities that a table must have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Need {
    /// Voltage and at least one of current and speed; or current and speed.
    Recording,
    /// Voltage, as the input of a simulation.
    Inputs,
    /// At least one quantity beside time; other files have the remaining ones.
    Part,
    /// The signals of a model.
    Signals,
}

/// Specification of the table to read: requests, requirements and known properties.
#[derive(Clone, Copy)]
pub(super) struct TableSpec<'a> {
    /// Columns that the user assigns to quantities.
    pub requests: &'a [ColumnRequest],
    pub need: Need,
    /// True if time follows from a sample rate.
    pub timed: bool,
    /// The separator of cells, if it is known; otherwise it is detected.
    pub separator: Option<Separator>,
    pub bad_rows: BadRows,
    /// Names and values of constants beside the rows, for use in formulas.
    pub constants: &'a [(String, f64)],
    /// Signals of a model that are read in place of the known quantities.
    pub signals: &'a [SignalRequest],
}

impl<'a> TableSpec<'a> {
    /// Returns the specification of options.
    pub(super) fn of(options: &'a ReadOptions, need: Need) -> Self {
        let ReadOptions { columns: requests, bad_rows, signals, .. } = options;
        let timed = options.rate_hz.is_some();
        Self { requests, need, timed, bad_rows: *bad_rows, separator: None, constants: &[], signals }
    }
}

impl TableSpec<'_> {
    /// Returns the user's request for a quantity.
    pub(super) fn request(&self, quantity: Quantity) -> Option<&ColumnRequest> {
        self.requests.iter().find(|request| request.quantity == quantity)
    }

    /// Returns the separator, detected from `line` unless it is known.
    pub(super) fn separator_of(&self, line: &str) -> Separator {
        self.separator.unwrap_or_else(|| Separator::of(line))
    }
}

/// Name in a request that says that the table lacks the quantity.
pub(super) const NONE: &str = "-";
