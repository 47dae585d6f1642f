//! The hint for a table that lacks quantities: a suggested request, derived from its headings and first rows.

use super::columns::advised;
use super::layout::{Layout, comment};
use super::parse::parse_number;
use super::spec::TableSpec;
use super::suggest::{ROWS, Suggestion, suggestion};
use super::text::Lines;
use motorfit_core::setting::{Text, text};
use motorfit_core::text::{excerpt, listed};
use motorfit_core::{Error, Result};

/// Number of cells of the first row that the hint shows.
const CELLS: usize = 12;

/// Returns the error for a table whose only fault is that quantities are missing, with a suggested request in its hint;
/// `None` if the table has another fault. Reads up to [`ROWS`] rows, from which units are guessed.
///
/// # Errors
/// Propagates the errors of reading lines.
pub(super) fn advice(lines: &mut impl Lines, layout: &Layout, spec: &TableSpec<'_>) -> Result<Option<Error>> {
    let headings = &layout.headings;
    let Some(plain) = advised(headings, spec, None) else { return Ok(None) };
    let number = |cell: &str| parse_number(cell, layout.separator.allows_decimal_comma()).ok();
    let row = |text: &str| layout.separator.row(text).into_iter().map(number).collect::<Vec<_>>();
    let is_row = |text: &str| !text.trim().is_empty() && comment(text).is_none();
    let mut rows: Vec<Vec<Option<f64>>> = layout.pending.iter().map(|(_, text)| row(text)).collect();
    while rows.len() < ROWS
        && let Some(line) = lines.next_line()?
    {
        match line.text() {
            Ok(text) if is_row(&text) => rows.push(row(&text)),
            Ok(_) => {}
            Err(_) => rows.push(Vec::new()),
        }
    }
    if headings.iter().all(|heading| parse_number(&heading.name, true).is_ok()) {
        let first = layout.pending.front().map_or("", |(_, text)| text.as_str());
        let cells = layout.separator.row(first).into_iter().enumerate().take(CELLS);
        let cells: Vec<String> = cells.map(|(n, cell)| format!("#{} is {}", n + 1, excerpt(cell))).collect();
        let hint = plain.hint().clone().and(format!(" In the first row {}.", cells.join(", ")));
        return Ok(Some(Error::data(plain.message(), hint)));
    }
    let named = suggestion(headings, spec, &rows).map(|found| words(&found, are_bad(&rows, headings.len())));
    Ok(if named.is_some() { advised(headings, spec, named) } else { Some(plain) })
}

/// Returns the hint that suggests a request; `are_bad` adds the setting that skips bad rows.
fn words(suggestion: &Suggestion, are_bad: bool) -> Text {
    let replaced = listed(&suggestion.replaced.iter().map(String::as_str).collect::<Vec<_>>(), "and");
    let replace = if replaced.is_empty() { String::new() } else { format!("; replace {replaced}") };
    let guessed = match &suggestion.guessed[..] {
        [] => String::new(),
        guessed => format!("; check the units of {}, which are guessed from the numbers", listed(guessed, "and")),
    };
    let skip = if are_bad { text!(" "[BadRows = "skip"]) } else { Text::default() };
    text!("Name the columns: " [Columns = "{}", suggestion.request] {skip} "{replace}{guessed}.")
}

/// Returns true if some rows do not fit the table: they have another width, or lack a number where at least 90 % of the rows
/// have one.
fn are_bad(rows: &[Vec<Option<f64>>], width: usize) -> bool {
    let numbers = |at: usize| rows.iter().filter(|row| row.get(at).is_some_and(Option::is_some)).count();
    let nearly = |at: usize| (rows.len() - rows.len() / 10..rows.len()).contains(&numbers(at));
    rows.iter().any(|row| row.len() != width) || (0..width).any(nearly)
}
