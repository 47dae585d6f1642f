//! Where a table begins: its heading, the units below it, or the comments above it that carry both.

use super::bad_rows::BadRows;
use super::columns::{Heading, Wish, choose, understood};
use super::parse::{Separator, is_number};
use super::text::{Line, Lines};
use crate::record::heading::Quantity;
use crate::text::counted;
use crate::{Error, Result};
use std::borrow::Cow;
use std::collections::VecDeque;

/// Lines that are looked at to find the heading.
const AHEAD_MAX: usize = 100;
/// Columns that a table may have.
pub(super) const COLUMNS_MAX: usize = 10_000;

/// A table's heading and what was read to find it.
pub(super) struct Layout {
    pub separator: Separator,
    pub headings: Vec<Heading>,
    /// The line of the heading.
    pub line: u64,
    /// Lines read after it, not yet used.
    pub pending: VecDeque<(u64, String)>,
    /// Notes on it.
    pub notes: Vec<String>,
}

/// A comment without its signs.
pub(super) fn comment(line: &str) -> Option<&str> {
    let line = line.trim_start();
    line.starts_with(['#', '%']).then(|| line.trim_start_matches(['#', '%']))
}

/// Finds the heading of a table.
pub(super) fn find(lines: &mut impl Lines, wish: &Wish<'_>) -> Result<Layout> {
    let mut ahead: VecDeque<(u64, String)> = VecDeque::new();
    let mut comments: Vec<String> = Vec::new();
    let mut found = None;
    while found.is_none() && ahead.len() < AHEAD_MAX {
        let Some(line) = lines.next_line()? else { break };
        let (number, text) = (line.number, readable(line, wish)?);
        if let Some(comment) = comment(&text) {
            if ahead.is_empty() {
                comments.push(comment.to_owned());
                let extra = comments.len().saturating_sub(2);
                comments.drain(..extra);
            }
        } else if !text.trim().is_empty() {
            let separator = wish.separator_of(&text);
            let row = separator.row(&text);
            ahead.push_back((number, text.clone().into_owned()));
            if row.len() > COLUMNS_MAX {
                let message = format!("has {} cells, expected at most {COLUMNS_MAX}", row.len());
                return Err(Error::data(message, "Check that it is CSV with one sample per line.").at_line(number));
            }
            let are_numbers = row.iter().all(|cell| is_number(cell));
            if ahead.len() == 1 && are_numbers {
                return without_heading(ahead, &comments, separator);
            }
            if are_numbers && row.len() > 1 {
                // Numbers behind notices are no heading.
                if choose(&numbers(row.len()), wish).is_ok() {
                    return below(ahead, separator);
                }
            } else if choose(&headings(&row, None), wish).is_ok() {
                found = Some(ahead.len() - 1);
            }
        }
    }
    let at = found.unwrap_or_else(|| likeliest(&ahead, wish));
    let mut pending = ahead.split_off(ahead.len().min(at + 1));
    let Some((line, text)) = ahead.pop_back() else {
        let hint = "Put a heading such as time_s,voltage_V,current_A,speed_rad_s in front of the rows.";
        return Err(Error::data("holds only comments or blank lines, expected a heading and rows of numbers", hint));
    };
    let separator = wish.separator_of(&text);
    let row = separator.row(&text);
    if pending.is_empty()
        && let Some(line) = lines.next_line()?
    {
        pending.push_back((line.number, readable(line, wish)?.into_owned()));
    }
    let units = pending.front().and_then(|(_, text)| units(&separator.row(text), row.len()));
    if units.is_some() {
        pending.pop_front();
    }
    let note = (!ahead.is_empty()).then(|| before(ahead.len(), "heading"));
    let headings = headings(&row, units.as_deref());
    Ok(Layout { separator, headings, line, pending, notes: note.into_iter().collect() })
}

/// The note on lines that were passed over.
fn before(count: usize, what: &str) -> String {
    format!("{} before the {what} left out", counted(count, "line"))
}

/// A line as text; where bad rows are left out, one that is no text has signs that no number has.
fn readable<'a>(line: Line<'a>, wish: &Wish<'_>) -> Result<Cow<'a, str>> {
    line.text().or_else(|error| match wish.bad_rows {
        BadRows::Skip => {
            let text = String::from_utf8_lossy(line.bytes);
            Ok(text.chars().map(|c| if c.is_control() && c != '\t' { '\u{fffd}' } else { c }).collect())
        }
        BadRows::Error => Err(error),
    })
}

/// The headings of columns that have none.
fn numbers(width: usize) -> Vec<Heading> {
    (1..=width).map(|n| Heading { name: n.to_string(), unit: None }).collect()
}

/// The layout of rows without a heading, whose first is the last of some lines.
fn below(mut ahead: VecDeque<(u64, String)>, separator: Separator) -> Result<Layout> {
    let pending = ahead.split_off(ahead.len() - 1);
    let mut layout = without_heading(pending, &[], separator)?;
    layout.notes.push(before(ahead.len(), "rows"));
    Ok(layout)
}

/// The line that says most, the first of equals.
fn likeliest(ahead: &VecDeque<(u64, String)>, wish: &Wish<'_>) -> usize {
    let score = |text: &str| understood(&headings(&wish.separator_of(text).row(text), None), wish);
    let scores = ahead.iter().map(|(_, text)| score(text)).enumerate();
    scores.rev().max_by_key(|&(_, score)| score).map_or(0, |(at, _)| at)
}

fn headings(row: &[&str], units: Option<&[String]>) -> Vec<Heading> {
    let unit = |n: usize| units.and_then(|units| units.get(n)).filter(|unit| !unit.is_empty()).cloned();
    row.iter().enumerate().map(|(n, name)| Heading { name: (*name).to_owned(), unit: unit(n) }).collect()
}

/// The units of a row that holds nothing else, brackets taken off.
fn units(row: &[&str], width: usize) -> Option<Vec<String>> {
    let bare = |cell: &&str| {
        let cell = cell.trim();
        let inner = cell.strip_prefix('[').and_then(|c| c.strip_suffix(']'));
        let inner = inner.or_else(|| cell.strip_prefix('(').and_then(|c| c.strip_suffix(')')));
        let unit = inner.unwrap_or(cell).trim();
        let known = || Quantity::COLUMNS.iter().any(|quantity| quantity.factor(unit).is_some());
        (inner.is_some() || unit.is_empty() || known()).then(|| unit.to_owned())
    };
    let units: Vec<String> = (row.len() == width).then(|| row.iter().map(bare).collect()).flatten()?;
    units.iter().any(|unit| !unit.is_empty()).then_some(units)
}

/// Names and units from the comments right above, else the numbers of the columns.
fn without_heading(pending: VecDeque<(u64, String)>, comments: &[String], separator: Separator) -> Result<Layout> {
    let (line, width) = pending.front().map_or((1, 0), |(line, text)| (*line, separator.row(text).len()));
    let above: Vec<Vec<&str>> = comments.iter().rev().map(|text| separator.row(text)).collect();
    let fits = |row: &&Vec<&str>| row.len() == width && width > 1 && !row.iter().any(|cell| is_number(cell));
    let last = above.first().filter(fits);
    let units = last.and_then(|row| units(row, width));
    let names = if units.is_some() { above.get(1).filter(fits) } else { last };
    let (names, units) = if names.is_some() { (names, units) } else { (None, None) };
    let (headings, notes) = match names {
        Some(names) => {
            let note = "names of columns are those of the comment above them".to_owned();
            (headings(names, units.as_deref()), vec![note])
        }
        None => (numbers(width), Vec::new()),
    };
    Ok(Layout { separator, headings, line, pending, notes })
}
