//! Tables for the terminal, pages and CSV files.

use motorfit_core::text::printable;
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

    /// Formats the table for the terminal, with aligned columns. Columns for which `width` characters do not suffice follow below,
    /// each time after the first column; columns with a heading alone are left out, and texts are wrapped between words.
    #[must_use]
    pub fn text(&self, width: usize) -> String {
        let mut text = match printable(&self.title) {
            title if title.chars().count() > width => folded(&title, width).trim_start().to_owned(),
            title => format!("{title}\n"),
        };
        for columns in self.groups(width) {
            text.push_str(&self.grid(&columns, width));
        }
        for note in &self.notes {
            text.push_str(&folded(note, width));
        }
        text
    }

    /// Returns the columns that fit beside each other, in groups that each begin with the first column.
    fn groups(&self, width: usize) -> Vec<Vec<usize>> {
        let widths = self.widths();
        let is_written = |n: usize| {
            self.rows.is_empty() || self.rows.iter().any(|row| row.get(n).is_some_and(|cell| !cell.is_empty()))
        };
        let (first, count) = (widths.first().copied().unwrap_or(0), widths.len());
        let mut groups = vec![vec![0]];
        let mut used = 2 + first;
        for (column, own) in widths.iter().enumerate().skip(1).filter(|(column, _)| is_written(*column)) {
            let is_empty = groups.last().is_none_or(|group| group.len() == 1);
            if used + 1 + own > width && !is_empty {
                groups.push(vec![0]);
                used = 2 + first;
            }
            used += 1 + own;
            groups.last_mut().into_iter().for_each(|group| group.push(column));
        }
        if count == 0 { Vec::new() } else { groups }
    }

    /// Returns the number of characters of the longest cell of each column.
    fn widths(&self) -> Vec<usize> {
        let rows = || std::iter::once(&self.heads).chain(&self.rows);
        let length = |text: &String| printable(text).chars().count();
        (0..self.heads.len()).map(|n| rows().filter_map(|row| row.get(n)).map(length).max().unwrap_or(0)).collect()
    }

    /// Formats some of the columns, beside each other.
    fn grid(&self, columns: &[usize], width: usize) -> String {
        let widths = self.widths();
        let all: usize = 1 + columns.iter().map(|n| widths[*n] + 1).sum::<usize>();
        // Only the longest column of a group that is too wide is wrapped.
        let longest = columns.iter().copied().max_by_key(|n| widths[*n]).unwrap_or(0);
        let most = widths[longest].saturating_sub(all.saturating_sub(width)).max(SHORTEST);
        let cell = |row: &[String], n: usize| {
            let text = row.get(n).map_or_else(String::new, |cell| printable(cell));
            if n == longest && all > width {
                folded(&text, most + 2).replace("\n  ", "\n").trim().to_owned()
            } else {
                text
            }
        };
        let mut table = comfy_table::Table::new();
        table.load_style(comfy_table::presets::NOTHING);
        table.set_header(columns.iter().map(|n| cell(&self.heads, *n)));
        for row in &self.rows {
            table.add_row(columns.iter().map(|n| cell(row, *n)));
        }
        for (n, column) in table.column_iter_mut().enumerate() {
            column.set_padding((if n == 0 { 2 } else { 1 }, 0));
            if n > 0 {
                column.set_cell_alignment(comfy_table::CellAlignment::Right);
            }
        }
        table.to_string().lines().map(|line| format!("{}\n", line.trim_end())).collect()
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

/// Shortest length to which a column is wrapped \[characters\].
const SHORTEST: usize = 12;

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
    fn columns_that_do_not_fit_follow_below_without_broken_words() {
        let heads: Vec<String> = (0..9).map(|n| format!("column{n}")).collect();
        let mut table =
            Table::new("wide", "A title of many words that is itself longer than the width of this table", &heads);
        for row in 0..3 {
            table.row((0..9).map(|n| format!("{row}.{n}e-12345")));
        }
        for width in [50, 60, 80, 200] {
            let text = table.text(width);
            assert!(text.lines().all(|line| line.chars().count() <= width), "{text}");
            for (row, n) in (0..3).flat_map(|row| (0..9).map(move |n| (row, n))) {
                let copies = text.matches(&format!("{row}.{n}e-12345")).count();
                assert!(copies == 1 || (n == 0 && copies > 1), "{text}");
            }
        }
        assert_eq!(table.text(200).lines().count(), 5);
        let mut sentence = Table::new("a", "b", &["motor", "reason"]);
        sentence
            .row(["line/motor-0001", "the motor does not move at all: nothing can be identified"].map(str::to_owned));
        let text = sentence.text(50);
        assert!(text.lines().all(|line| line.chars().count() <= 50), "{text}");
        let words = text.split_whitespace().collect::<Vec<_>>();
        assert!(words.contains(&"identified") && words.contains(&"nothing"), "{text}");
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
