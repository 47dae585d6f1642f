//! Tables shortened for a terminal.

use super::words::many;
use crate::table::Table;

/// Width of a terminal \[characters\].
const WIDTH: usize = 80;
/// Columns that are removed first from a table that is too wide.
const SPARED: [&str; 4] = ["5 %", "95 %", "25 %", "75 %"];
/// Number of columns that are always shown: those of the factors and of the five parameters of a motor.
const COLUMNS: usize = 11;
/// Start of the part of a cell that is removed next.
const SPREAD: &str = " ±";
/// Shortest length to which a cell is truncated \[characters\].
const SHORTEST: usize = 12;

/// Returns a table with at most `rows` rows and the width of a terminal; its notes mention what was removed.
#[must_use]
pub fn shortened(table: &Table, rows: usize) -> Table {
    let mut short = table.clone();
    short.rows.truncate(rows);
    let left = table.rows.len() - short.rows.len();
    if left > 0 {
        short.note(format!("{} more rows are on the page and in the CSV.", many(left)));
    }
    for head in SPARED {
        if let Some(place) = short.heads.iter().position(|h| h == head).filter(|_| width(&short) > WIDTH) {
            short.heads.remove(place);
            short.rows.iter_mut().filter(|row| place < row.len()).for_each(|row| drop(row.remove(place)));
        }
    }
    if width(&short) > WIDTH && short.notes.iter().any(|note| note.contains(SPREAD)) {
        let bare = |cell: &mut String| cell.truncate(cell.find(SPREAD).unwrap_or(cell.len()));
        short.rows.iter_mut().flatten().for_each(bare);
        short.notes.retain(|note| !note.contains(SPREAD));
        short.note("Medians; the spread over runs is on the page and in the CSV.");
    }
    let over = width(&short).saturating_sub(WIDTH);
    let widths = widths(&short);
    if let Some(widest) = (0..widths.len()).filter(|_| over > 0).max_by_key(|n| widths[*n]) {
        let most = widths[widest].saturating_sub(over).max(SHORTEST);
        short.rows.iter_mut().filter_map(|row| row.get_mut(widest)).for_each(|cell| *cell = cut(cell, most));
    }
    while width(&short) > WIDTH && short.heads.len() > COLUMNS {
        short.heads.pop();
        let columns = short.heads.len();
        short.rows.iter_mut().for_each(|row| row.truncate(columns));
    }
    if short.heads.len() < table.heads.len() {
        short.note("More columns are on the page and in the CSV.");
    }
    short
}

fn widths(table: &Table) -> Vec<usize> {
    let rows = || std::iter::once(&table.heads).chain(&table.rows);
    let length = |text: &String| motorfit_core::text::printable(text).chars().count();
    (0..table.heads.len()).map(|n| rows().filter_map(|row| row.get(n)).map(length).max().unwrap_or(0)).collect()
}

/// Returns the width of a table with its indent of two spaces and one space between columns.
fn width(table: &Table) -> usize {
    1 + widths(table).iter().map(|width| width + 1).sum::<usize>()
}

/// Truncates a text: a sentence keeps its start, a name its end.
fn cut(text: &str, most: usize) -> String {
    let text = motorfit_core::text::printable(text);
    let length = text.chars().count();
    if length <= most {
        text
    } else if text.contains(' ') {
        text.chars().take(most - 1).chain(['…']).collect()
    } else {
        std::iter::once('…').chain(text.chars().skip(length + 1 - most)).collect()
    }
}
