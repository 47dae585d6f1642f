//! Tables for the terminal, pages and CSV files.

use crate::text::printable;
use std::fmt::Write as _;

/// A table of texts whose first column names the rows.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Table {
    /// Identifier for files and links.
    pub id: String,
    /// Title.
    pub title: String,
    /// Headings of the columns.
    pub heads: Vec<String>,
    /// Rows, each with one cell per heading.
    pub rows: Vec<Vec<String>>,
    /// Notes below the table.
    pub notes: Vec<String>,
}

impl Table {
    /// Creates an empty table.
    #[must_use]
    pub fn new(id: impl Into<String>, title: impl Into<String>, heads: &[impl AsRef<str>]) -> Self {
        let heads = heads.iter().map(|head| head.as_ref().to_owned()).collect();
        Self { id: id.into(), title: title.into(), heads, rows: Vec::new(), notes: Vec::new() }
    }

    /// Adds a row.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }

    /// Adds a row with a name and its other cells.
    pub(super) fn named_row(&mut self, name: &str, cells: impl IntoIterator<Item = String>) {
        self.row(std::iter::once(name.to_owned()).chain(cells));
    }

    /// Adds a note.
    pub fn note(&mut self, note: impl Into<String>) {
        self.notes.push(note.into());
    }

    /// Formats the table for the terminal, with aligned columns and notes wrapped at `width` characters.
    #[must_use]
    pub fn text(&self, width: usize) -> String {
        let mut table = comfy_table::Table::new();
        table.load_style(comfy_table::presets::NOTHING);
        table.set_header(self.heads.iter().map(|cell| printable(cell)));
        for row in &self.rows {
            table.add_row(row.iter().map(|cell| printable(cell)));
        }
        for (n, column) in table.column_iter_mut().enumerate() {
            column.set_padding((if n == 0 { 2 } else { 1 }, 0));
            if n > 0 {
                column.set_cell_alignment(comfy_table::CellAlignment::Right);
            }
        }
        let mut text = format!("{}\n", printable(&self.title));
        for line in table.to_string().lines() {
            let _ = writeln!(text, "{}", line.trim_end());
        }
        for note in &self.notes {
            text.push_str(&folded(note, width));
        }
        text
    }

    /// Formats the table as CSV with a heading. A cell that a spreadsheet would take for a formula gets an apostrophe
    /// in front.
    #[must_use]
    pub fn csv(&self) -> String {
        let cell = |cell: &String| quoted(&guarded(printable(cell)));
        let line = |cells: &[String]| cells.iter().map(cell).collect::<Vec<_>>().join(",") + "\n";
        line(&self.heads) + &self.rows.iter().map(|row| line(row)).collect::<String>()
    }
}

/// Returns the cell for a missing value.
pub(super) fn dash() -> String {
    "\u{2013}".to_owned()
}

/// Returns a cell that no spreadsheet takes for a formula, for names that begin with a sign.
fn guarded(cell: String) -> String {
    let is_number = |word: &str| {
        word.trim_start_matches('±').trim_end_matches(['%', ',']).parse::<f64>().is_ok()
            || matches!(word, "±" | "…" | "/" | "%")
    };
    if cell.starts_with(['=', '+', '-', '@']) && !cell.split_whitespace().all(is_number) {
        return format!("'{cell}");
    }
    cell
}

/// Quotes a cell for CSV if necessary.
fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n', '\r']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell.to_owned() }
}

/// Wraps a paragraph at `width` characters, indented by two spaces; longer words are not broken.
#[must_use]
pub fn folded(text: &str, width: usize) -> String {
    let (mut lines, mut line) = (String::new(), String::from(" "));
    for word in printable(text).split_whitespace() {
        if line.chars().count() + 1 + word.chars().count() > width && line != " " {
            let _ = writeln!(lines, "{line}");
            line = String::from(" ");
        }
        line.push(' ');
        line.push_str(word);
    }
    let _ = writeln!(lines, "{line}");
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up_and_csv_is_quoted() {
        let mut table = Table::new("cost", "Cost [1]", &["method", "best", "of, all"]);
        table.row(vec!["gwo".to_owned(), "0.0256".to_owned(), "1".to_owned()]);
        table.row(vec!["a \"b\"\u{1b}[31m".to_owned(), "12".to_owned(), "1.25e-7".to_owned()]);
        table.note("A note that is longer than the width of the terminal and is broken between words.");
        let text = table.text(40);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "Cost [1]");
        let ends: Vec<usize> = lines[1..4].iter().map(|line| line.chars().count()).collect();
        assert!(ends.iter().all(|end| *end == ends[0]), "numbers end in one column: {text}");
        assert!(lines[4..].iter().all(|line| line.len() <= 40 && line.starts_with("  ")), "{text}");
        assert!(!text.contains('\u{1b}'));
        assert_eq!(table.csv().lines().next(), Some("method,best,\"of, all\""));
        assert!(table.csv().contains("\"a \"\"b\"\""));
    }

    #[test]
    fn names_are_no_formulas_and_numbers_stay_numbers() {
        for (cell, written) in [
            ("=HYPERLINK(\"http://a\",\"b\")", "\"'=HYPERLINK(\"\"http://a\"\",\"\"b\"\")\""),
            ("@SUM(A1)", "'@SUM(A1)"),
            ("+1+cmd", "'+1+cmd"),
            ("-2+3+cmd|' /C calc'!A0", "'-2+3+cmd|' /C calc'!A0"),
            ("-1 cmd", "'-1 cmd"),
            ("-", "'-"),
            ("-1.5", "-1.5"),
            ("+1e-7", "+1e-7"),
            ("-inf", "-inf"),
            ("-0.5 … 0.3", "-0.5 … 0.3"),
            ("-0.5 ±3%", "-0.5 ±3%"),
            ("m-1", "m-1"),
            ("", ""),
        ] {
            let mut table = Table::new("a", "a", &[cell, "b"]);
            table.row([cell.to_owned(), "1".to_owned()]);
            assert_eq!(table.csv(), format!("{written},b\n{written},1\n"));
        }
    }
}
