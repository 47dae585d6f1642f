//! Tables cut to what a terminal shows.

use super::words::many;
use crate::report::Table;

/// Columns of a terminal.
const WIDTH: usize = 80;
/// Columns of a table that are left out first where there is no room.
const SPARED: [&str; 4] = ["5 %", "95 %", "25 %", "75 %"];
/// Columns that are shown however wide they are: those of factors and of the five parameters of a motor.
const COLUMNS: usize = 11;
/// The beginning of the part of a cell that is left out next.
const SPREAD: &str = " ±";
/// Cells are not cut shorter than this.
const SHORTEST: usize = 12;

/// A table cut to so many rows and to the width of a terminal; what is left out is said.
#[must_use]
pub fn shortened(table: &Table, rows: usize) -> Table {
    let mut short = table.clone();
    short.rows.truncate(rows);
    let left = table.rows.len() - short.rows.len();
    if left > 0 {
        short.note(format!("{} more are on the page and in the CSV.", many(left)));
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
        short.note("Medians; how far runs spread is on the page and in the CSV.");
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
    let length = |text: &String| crate::text::printable(text).chars().count();
    (0..table.heads.len()).map(|n| rows().filter_map(|row| row.get(n)).map(length).max().unwrap_or(0)).collect()
}

/// As the table is shown: an indent of two blanks, and one between columns.
fn width(table: &Table) -> usize {
    1 + widths(table).iter().map(|width| width + 1).sum::<usize>()
}

/// A sentence keeps its beginning, a name its end.
fn cut(text: &str, most: usize) -> String {
    let text = crate::text::printable(text);
    let length = text.chars().count();
    if length <= most {
        text
    } else if text.contains(' ') {
        text.chars().take(most - 1).chain(['…']).collect()
    } else {
        std::iter::once('…').chain(text.chars().skip(length + 1 - most)).collect()
    }
}
