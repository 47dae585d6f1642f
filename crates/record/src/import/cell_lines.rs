//! Tables of text cells as lines, which are read like those of a CSV file.

use super::parse::Separator;
use super::text::{Line, Lines};
use motorfit_core::Result;
use motorfit_logs::Cells;

/// Rows of cells as lines of text.
pub(super) struct CellLines<'a> {
    rows: std::slice::Iter<'a, (u64, Vec<String>)>,
    text: String,
}

impl<'a> CellLines<'a> {
    /// Separator of the cells.
    pub(super) const SEPARATOR: Separator = Separator::Sign(b'\t');

    pub(super) fn new(cells: &'a Cells) -> Self {
        Self { rows: cells.rows.iter(), text: String::new() }
    }
}

impl Lines for CellLines<'_> {
    fn next_line(&mut self) -> Result<Option<Line<'_>>> {
        let Some((number, row)) = self.rows.next() else { return Ok(None) };
        self.text.clear();
        for (n, cell) in row.iter().enumerate() {
            if n > 0 {
                self.text.push('\t');
            }
            // Characters that would end a cell or a line are replaced by blanks.
            self.text.extend(cell.chars().map(|c| if c.is_control() || c == '"' { ' ' } else { c }));
        }
        Ok(Some(Line { number: *number, bytes: self.text.as_bytes() }))
    }
}
