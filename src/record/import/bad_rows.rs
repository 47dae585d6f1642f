//! Rows that cannot be read: notices of a logger, lines that a serial link garbled.

use crate::Error;
use crate::named::named;
use crate::setting::text;
use crate::text::counted;

named! {
    /// The treatment of rows that cannot be read.
    pub enum BadRows (default Error) {
        /// Bad data.
        Error = "error",
        /// They are left out, counted and named.
        Skip = "skip",
    }
}

/// Rows that are named in the note on them.
const NAMED: usize = 3;

/// The rows of a table that could not be read.
#[derive(Default)]
pub(super) struct LeftOut {
    rows: Vec<(u64, Option<String>)>,
}

impl LeftOut {
    /// Adds a row; the reasons of the first are kept.
    pub(super) fn push(&mut self, line: u64, error: &Error) {
        let column = error.column().map_or_else(String::new, |column| format!("column {column}: "));
        let reason = (self.rows.len() < NAMED).then(|| format!("{column}{}", error.message()));
        self.rows.push((line, reason));
    }

    /// Returns true once the note has all the reasons that it names.
    pub(super) fn has_reasons(&self) -> bool {
        self.rows.len() >= NAMED
    }

    /// Adds a row beyond those whose reasons are kept.
    pub(super) fn push_without_reason(&mut self, line: u64) {
        self.rows.push((line, None));
    }

    /// The lines of the rows, in rising order, and the note on them.
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

/// The same error with the setting that leaves such rows out.
pub(super) fn with_remedy(error: &Error) -> Error {
    let hint = error.hint().clone().and(text!(" " [BadRows = "skip"] " leaves out rows that cannot be read."));
    let same = Error::new(error.kind(), error.message(), hint).at_line(error.line());
    error.column().into_iter().fold(same, |error, column| error.in_column(column))
}
