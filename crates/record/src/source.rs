//! Origin of a recording: its file, the columns and lines in it, and notes.

use super::heading::Quantity;
use super::lines::Lines;
use std::path::PathBuf;

/// A column of a file with the meaning that was assigned to it.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Column {
    /// Quantity in the column.
    pub quantity: Quantity,
    /// Heading in the file.
    pub heading: String,
    /// Description of the conversion of the cells; empty if they were not converted.
    pub conversion: String,
    /// Unit of the cells.
    pub unit: String,
    /// True if the heading or the request names the unit; otherwise SI is assumed.
    pub unit_named: bool,
}

/// Origin of a recording: file, columns, lines and notes on its import and preparation.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Source {
    /// Path of the file; `None` for a recording made in memory.
    pub path: Option<PathBuf>,
    /// SHA-256 digest of the file, in hexadecimal.
    pub sha256: Option<String>,
    /// Columns that were used; empty for a recording made in memory.
    pub columns: Vec<Column>,
    /// Part of the file: a sheet, a test, a segment between gaps; `None` for the complete file.
    pub part: Option<String>,
    /// Line of each sample in the file; empty for a recording made in memory or joined from several files.
    pub lines: Lines,
    /// Columns of the file that were not used.
    pub ignored: Vec<String>,
    /// Notes on rows left out, files joined and preparation.
    pub notes: Vec<String>,
    /// Change of a position beside the speed over the integral of the speed; `None` without a position, or if they are not proportional.
    #[serde(default)]
    pub position_ratio: Option<f64>,
    /// True if the file does not end with a line break, so that its last number may be incomplete.
    pub last_line_open: bool,
}

impl Source {
    /// Returns the name of the file without its folder; `None` for a recording made in memory.
    #[must_use]
    pub fn file_name(&self) -> Option<String> {
        Some(self.path.as_ref()?.file_name()?.to_string_lossy().into_owned())
    }

    /// Adds the number of a segment (`n` from 0) to the name of the part if there are several segments.
    pub(crate) fn with_segment(mut self, n: usize, count: usize) -> Self {
        if count > 1 {
            let part = self.part.into_iter().chain([format!("segment {}", n + 1)]);
            self.part = Some(part.collect::<Vec<_>>().join(", "));
        }
        self
    }
}
