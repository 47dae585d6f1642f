//! The help of a table that lacks quantities: a request made of its headings and first rows, in words.

use super::columns::{Wish, advised};
use super::layout::{Layout, comment};
use super::parse::parse_number;
use super::suggest::{ROWS, Suggestion, suggestion};
use super::text::Lines;
use crate::setting::{Text, text};
use crate::text::{excerpt, listed};
use crate::{Error, Result};

/// Cells that are shown of the first row.
const CELLS: usize = 12;

/// Returns the error of a table with which nothing is wrong but that quantities are not there.
pub(super) fn advice(lines: &mut impl Lines, layout: &Layout, wish: &Wish<'_>) -> Result<Option<Error>> {
    let headings = &layout.headings;
    let Some(plain) = advised(headings, wish, None) else { return Ok(None) };
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
    let named = suggestion(headings, wish, &rows).map(|found| words(&found, are_bad(&rows, headings.len())));
    Ok(if named.is_some() { advised(headings, wish, named) } else { Some(plain) })
}

/// A request in words.
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

/// Returns whether some rows are none of the table: of another width, or without a number where nearly all rows have one.
fn are_bad(rows: &[Vec<Option<f64>>], width: usize) -> bool {
    let numbers = |at: usize| rows.iter().filter(|row| row.get(at).is_some_and(Option::is_some)).count();
    let nearly = |at: usize| (rows.len() - rows.len() / 10..rows.len()).contains(&numbers(at));
    rows.iter().any(|row| row.len() != width) || (0..width).any(nearly)
}
