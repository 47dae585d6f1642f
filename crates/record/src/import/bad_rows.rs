//! Rows that cannot be read, such as messages of a logger or lines corrupted by a serial link.

use motorfit_core::Error;
use motorfit_core::named::named;
use motorfit_core::setting::text;
use motorfit_core::text::counted;

named! {
    /// The treatment of rows that cannot be read.
    pub enum BadRows (default Error) {
        /// The file is refused, with the line of the first bad row.
        Error = "error",
        /// Bad rows are skipped; a note states their number and the first lines.
        Skip = "skip",
    }
}

/// Number of skipped rows that the note names.
const NAMED: usize = 3;

/// Rows of a table that could not be read and are skipped.
#[derive(Default)]
pub(super) struct LeftOut {
    rows: Vec<(u64, Option<String>)>,
}

impl LeftOut {
    /// Adds a row; the reasons of the first [`NAMED`] rows are kept.
    pub(super) fn push(&mut self, line: u64, error: &Error) {
        let column = error.column().map_or_else(String::new, |column| format!("column {column}: "));
        let reason = (self.rows.len() < NAMED).then(|| format!("{column}{}", error.message()));
        self.rows.push((line, reason));
    }

    /// Returns true if reasons of further rows are not needed.
    pub(super) fn has_reasons(&self) -> bool {
        self.rows.len() >= NAMED
    }

    /// Adds a row without its reason.
    pub(super) fn push_without_reason(&mut self, line: u64) {
        self.rows.push((line, None));
    }

    /// Returns the lines of the rows in increasing order, and the note on them if there are any.
    pub(super) fn finish(mut self) -> (Vec<u64>, Option<String>) {
        self.rows.sort_by_key(|(line, _)| *line);
        let named = self.rows.iter().filter_map(|(line, reason)| Some(format!("line {line} ({})", reason.as_ref()?)));
        let named: Vec<String> = named.collect();
        let more = if self.rows.len() > named.len() { ", …" } else { "" };
        let count = counted(self.rows.len(), "row");
        let note = format!("{count} that could not be read left out: {}{more}", named.join(", "));
        let lines: Vec<u64> = self.rows.into_iter().map(|(line, _)| line).collect();
        (lines.clone(), (!lines.is_empty()).then_some(note))
    }
}

/// Returns the error with the setting that skips bad rows added to its hint.
pub(super) fn with_remedy(error: &Error) -> Error {
    let hint = error.hint().clone().and(text!(" " [BadRows = "skip"] " skips rows that cannot be read."));
    let same = Error::new(error.kind(), error.message(), hint).at_line(error.line());
    error.column().into_iter().fold(same, |error, column| error.in_column(column))
}
