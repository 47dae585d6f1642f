//! Location of the heading of a table, of a row of units below it, or of comments above the rows that have both.

use super::bad_rows::BadRows;
use super::columns::{choose, understood};
use super::headings::Heading;
use super::parse::{Separator, is_number};
use super::spec::TableSpec;
use super::text::{Line, Lines};
use crate::heading::Quantity;
use motorfit_core::text::counted;
use motorfit_core::{Error, Result};
use std::borrow::Cow;
use std::collections::VecDeque;

/// Largest number of lines that are searched for the heading.
const AHEAD_MAX: usize = 100;
/// Largest number of columns of a table.
pub(super) const COLUMNS_MAX: usize = 10_000;

/// The heading of a table and the lines that were read to find it.
pub(super) struct Layout {
    pub separator: Separator,
    pub headings: Vec<Heading>,
    /// Line number of the heading.
    pub line: u64,
    /// Lines read after the heading, not yet used.
    pub pending: VecDeque<(u64, String)>,
    /// Notes on the heading and on lines before it.
    pub notes: Vec<String>,
}

/// Returns the text of a comment line; `None` if the line is not a comment.
pub(super) fn comment(line: &str) -> Option<&str> {
    let line = line.trim_start();
    line.starts_with(['#', '%']).then(|| line.trim_start_matches(['#', '%']))
}

/// Finds the heading of a table: the first line from which all required columns can be selected, else the line with the
/// most recognized columns.
///
/// # Errors
/// Returns a `Data` error if there are no lines but comments and blank lines, a line has too many cells or is not text.
pub(super) fn find(lines: &mut impl Lines, spec: &TableSpec<'_>) -> Result<Layout> {
    let mut ahead: VecDeque<(u64, String)> = VecDeque::new();
    let mut comments: Vec<String> = Vec::new();
    let mut found = None;
    while found.is_none() && ahead.len() < AHEAD_MAX {
        let Some(line) = lines.next_line()? else { break };
        let (number, text) = (line.number, readable(line, spec)?);
        if let Some(comment) = comment(&text) {
            if ahead.is_empty() {
                comments.push(comment.to_owned());
                let extra = comments.len().saturating_sub(2);
                comments.drain(..extra);
            }
        } else if !text.trim().is_empty() {
            let separator = spec.separator_of(&text);
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
                // Rows of numbers below messages of a logger have no heading.
                if choose(&numbers(row.len()), spec).is_ok() {
                    return below(ahead, separator);
                }
            } else if choose(&headings(&row, None), spec).is_ok() {
                found = Some(ahead.len() - 1);
            }
        }
    }
    let at = found.unwrap_or_else(|| likeliest(&ahead, spec));
    let mut pending = ahead.split_off(ahead.len().min(at + 1));
    let Some((line, text)) = ahead.pop_back() else {
        let hint = "Put a heading such as time_s,voltage_V,current_A,speed_rad_s above the rows.";
        return Err(Error::data("holds only comments or blank lines, expected a heading and rows of numbers", hint));
    };
    let separator = spec.separator_of(&text);
    let row = separator.row(&text);
    if pending.is_empty()
        && let Some(line) = lines.next_line()?
    {
        pending.push_back((line.number, readable(line, spec)?.into_owned()));
    }
    let units = pending.front().and_then(|(_, text)| units(&separator.row(text), row.len()));
    if units.is_some() {
        pending.pop_front();
    }
    let note = (!ahead.is_empty()).then(|| before(ahead.len(), "heading"));
    let headings = headings(&row, units.as_deref());
    Ok(Layout { separator, headings, line, pending, notes: note.into_iter().collect() })
}

/// Returns the note on lines that were skipped.
fn before(count: usize, what: &str) -> String {
    format!("{} before the {what} left out", counted(count, "line"))
}

/// Returns a line as text. If bad rows are skipped, control characters are replaced by U+FFFD, so that the line is a bad row
/// rather than an error.
fn readable<'a>(line: Line<'a>, spec: &TableSpec<'_>) -> Result<Cow<'a, str>> {
    line.text().or_else(|error| match spec.bad_rows {
        BadRows::Skip => {
            let text = String::from_utf8_lossy(line.bytes);
            Ok(text.chars().map(|c| if c.is_control() && c != '\t' { '\u{fffd}' } else { c }).collect())
        }
        BadRows::Error => Err(error),
    })
}

/// Returns headings for columns without any: their numbers from 1.
fn numbers(width: usize) -> Vec<Heading> {
    (1..=width).map(|n| Heading { name: n.to_string(), ..Heading::default() }).collect()
}

/// Returns the layout of rows without a heading, the first of which is the last line in `ahead`.
fn below(mut ahead: VecDeque<(u64, String)>, separator: Separator) -> Result<Layout> {
    let pending = ahead.split_off(ahead.len() - 1);
    let mut layout = without_heading(pending, &[], separator)?;
    layout.notes.push(before(ahead.len(), "rows"));
    Ok(layout)
}

/// Returns the index of the line with the most recognized columns, the first one of equals.
fn likeliest(ahead: &VecDeque<(u64, String)>, spec: &TableSpec<'_>) -> usize {
    let score = |text: &str| understood(&headings(&spec.separator_of(text).row(text), None), spec);
    let scores = ahead.iter().map(|(_, text)| score(text)).enumerate();
    scores.rev().max_by_key(|&(_, score)| score).map_or(0, |(at, _)| at)
}

fn headings(row: &[&str], units: Option<&[String]>) -> Vec<Heading> {
    let unit = |n: usize| units.and_then(|units| units.get(n)).filter(|unit| !unit.is_empty()).cloned();
    row.iter().enumerate().map(|(n, name)| Heading { name: (*name).to_owned(), unit: unit(n), alias: None }).collect()
}

/// Returns the units of a row that has nothing but units, without brackets; `None` for any other row.
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

/// Returns the layout of rows without a heading: names and units are those of the comments directly above, if these have as
/// many cells, else the columns are numbered.
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
            let note = "column names are those of the comment above the rows".to_owned();
            (headings(names, units.as_deref()), vec![note])
        }
        None => (numbers(width), Vec::new()),
    };
    Ok(Layout { separator, headings, line, pending, notes })
}
