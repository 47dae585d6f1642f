//! Reading of the rows of a table of text.

use super::advice::advice;
use super::bad_rows::{BadRows, LeftOut, with_remedy};
use super::columns::choose;
use super::convert::Cells;
use super::layout::{Layout, comment, find};
use super::numbers::Numbers;
use super::parse::{Separator, parse_number};
use super::quick::Quick;
use super::signals::Signals;
use super::spec::TableSpec;
use super::text::Lines as Text;
use super::used::Used;
use crate::heading::Quantity;
use crate::lines::Lines;
use crate::samples::SAMPLES_MAX;
use motorfit_core::setting::text;
use motorfit_core::text::{counted, excerpt};
use motorfit_core::{Error, Result};
use std::borrow::Cow;
use std::ops::Range;

/// Reads a table and returns the signals of the columns that are used.
///
/// # Errors
/// Returns an error if the table has no readable heading, a quantity is missing, or a row cannot be read and is not skipped.
pub(super) fn collect(lines: &mut impl Text, spec: &TableSpec<'_>) -> Result<Signals> {
    let layout = find(lines, spec)?;
    // Lists of JSON objects have no line of headings; their line is 0.
    let heading_line = Some(layout.line).filter(|line| *line > 0);
    let used = match choose(&layout.headings, spec) {
        Ok(used) => used,
        Err(error) => return Err(advice(lines, &layout, spec)?.unwrap_or(error).at_line(heading_line)),
    };
    let mut rows = Rows::new(&used, &layout, spec.bad_rows == BadRows::Skip);
    read_rows(lines, &mut rows)?;
    let Rows { columns, values, lines: row_lines, blank, bad, comma, has_point, quick, skips, .. } = rows;
    if let Some(error) = comma.filter(|_| has_point || quick.is_some_and(|quick| quick.has_point)) {
        return Err(error);
    }
    let columns = columns.iter().map(|column| (column.at, column.heading)).collect();
    let cells = Cells { columns, values, lines: row_lines };
    let table = Numbers {
        cells,
        headings: &layout.headings,
        notes: layout.notes.clone(),
        measured_at: Vec::new(),
        blank,
        bad,
        skips,
    };
    let mut signals = table.signals(used, spec)?;
    signals.source.last_line_open = lines.is_open();
    Ok(signals)
}

/// Reads the rows below a heading.
fn read_rows(lines: &mut impl Text, rows: &mut Rows<'_>) -> Result<()> {
    let layout = rows.layout;
    for (line, text) in &layout.pending {
        rows.take(*line, Ok(text.into()))?;
    }
    // The last line may be cut off; its error is worded only after it is known to be the last line.
    let mut fault: Option<Error> = None;
    loop {
        if fault.is_none() {
            rows.add_ahead(lines);
        }
        let next = lines.next_line()?;
        if let Some(error) = fault {
            let cut = next.is_none() && lines.is_open();
            return Err(if cut { cut_off(&error) } else { error });
        }
        let Some(line) = next else { return Ok(()) };
        fault = rows.take(line.number, line.text()).err();
    }
}

/// Returns the error of a last line without a line break, which may be cut off.
fn cut_off(error: &Error) -> Error {
    let message = format!("the last line is cut off: {}", error.message());
    Error::data(message, "Remove the last line, or copy the file again.").at_line(error.line())
}

/// A column whose cells are read.
struct Column<'a> {
    at: usize,
    heading: &'a str,
    is_time: bool,
}

/// Values of the rows read up to now, and the state of the reading.
struct Rows<'a> {
    columns: Vec<Column<'a>>,
    layout: &'a Layout,
    values: Vec<Vec<f64>>,
    lines: Lines,
    /// Lines of rows that hold NaN in all used columns.
    blank: Vec<u64>,
    /// Skipped rows that cannot be read.
    bad: LeftOut,
    skips: bool,
    cells: Vec<Range<usize>>,
    quick: Option<Quick>,
    /// True if a number with a decimal point was read.
    has_point: bool,
    /// Error for the first number with a decimal comma, which counts if another number has a decimal point.
    comma: Option<Error>,
}

impl<'a> Rows<'a> {
    fn new(used: &[Used], layout: &'a Layout, skips: bool) -> Self {
        let mut columns: Vec<Column<'a>> = Vec::new();
        for used in used {
            for at in used.column_indices() {
                let is_time = used.column.quantity == Quantity::Time;
                match columns.iter_mut().find(|column| column.at == at) {
                    Some(column) => column.is_time &= is_time,
                    None => columns.push(Column { at, heading: &layout.headings[at].name, is_time }),
                }
            }
        }
        let used_cells = columns.iter().map(|column| column.at);
        let quick = match layout.separator {
            Separator::Sign(sign) => Some(Quick::new(sign, layout.headings.len(), used_cells)),
            Separator::Blanks => None,
        };
        let (values, lines) = (vec![Vec::new(); columns.len()], Lines::default());
        let (blank, bad, cells) = (Vec::new(), LeftOut::default(), Vec::new());
        Self { columns, layout, values, lines, blank, bad, skips, cells, quick, has_point: false, comma: None }
    }

    /// Adds a line; one that cannot be read is skipped or an error, by the setting.
    fn take(&mut self, line: u64, text: Result<Cow<'_, str>>) -> Result<()> {
        if let Err(error) = text.and_then(|text| self.add(line, &text)) {
            if !self.skips {
                return Err(with_remedy(&error));
            }
            let kept = self.lines.len();
            self.values.iter_mut().for_each(|signal| signal.truncate(kept));
            self.bad.push(line, &error.at_line(line));
        }
        if self.lines.len() > SAMPLES_MAX {
            return Err(Error::data(format!("more than {SAMPLES_MAX} samples"), "Cut the recording.").at_line(line));
        }
        Ok(())
    }

    /// Adds the rows of plain numbers at the start of the text that was read ahead.
    fn add_ahead(&mut self, text: &mut impl Text) {
        let Some(quick) = &mut self.quick else { return };
        let (line, ahead) = text.ahead();
        let (mut at, mut count) = (0, 0);
        while self.lines.len() + count < SAMPLES_MAX
            && let Some(next) = quick.read_at(ahead, at)
        {
            for (signal, value) in self.values.iter_mut().zip(&quick.row) {
                signal.push(*value);
            }
            (at, count) = (next, count + 1);
        }
        self.lines.extend(line, count);
        text.pass(count as u64, at);
    }

    /// Adds a line, unless it is blank, a comment or a row of NaN.
    fn add(&mut self, line: u64, text: &str) -> Result<()> {
        if text.trim_start().is_empty() || comment(text).is_some() {
            return Ok(());
        }
        self.layout.separator.split(text, &mut self.cells);
        let row = &self.cells;
        if row.iter().all(Range::is_empty) {
            return Ok(());
        }
        let expected = self.layout.headings.len();
        // Creating an error for each of millions of rows would take as long as reading them.
        if self.skips && self.bad.has_reasons() && cell_count(row, expected) != expected {
            self.bad.push_without_reason(line);
            return Ok(());
        }
        check_count(row, expected).map_err(|error| error.at_line(line))?;
        let decimal_comma = self.layout.separator.allows_decimal_comma();
        for (n, column) in self.columns.iter().enumerate() {
            let cell = &text[row[column.at].clone()];
            self.has_point |= cell.contains('.');
            // In a file with decimal points, a comma may be a thousands separator.
            if self.comma.is_none() && cell.contains(',') {
                let message = format!("found \"{}\" in a file that has decimal points too", excerpt(cell));
                let hint = "Write all numbers with a decimal point and without thousands separators.";
                self.comma = Some(Error::data(message, hint).at_line(line).in_column(column.heading));
            }
            let value = match parse_number(cell, decimal_comma || cell.contains(',')) {
                Ok(value) => value,
                Err(_) if self.is_nan(text) => {
                    self.values[..n].iter_mut().for_each(|signal| {
                        signal.pop();
                    });
                    self.blank.push(line);
                    return Ok(());
                }
                Err(found) => {
                    let is_clock = cell.contains(':') || cell.matches(['-', '/']).count() > 1;
                    let hint = match column.is_time && is_clock {
                        true => text!(
                            "Times must be numbers; with dates or clock times, use a sample rate instead: " [Columns = "time=-"]
                            " " [Rate = "HZ"] "."
                        ),
                        false => "Correct the cell; a row at the start or end of the recording may be removed.".into(),
                    };
                    return Err(Error::data(found, hint).at_line(line).in_column(column.heading));
                }
            };
            self.values[n].push(value);
        }
        self.lines.push(line);
        Ok(())
    }

    /// Returns true if at least two columns other than time are used and all of them are NaN in this row.
    fn is_nan(&self, text: &str) -> bool {
        let nan = |column: &Column<'_>| text[self.cells[column.at].clone()].eq_ignore_ascii_case("nan");
        let values = || self.columns.iter().filter(|column| !column.is_time);
        values().count() > 1 && values().all(nan)
    }
}

/// Returns the number of cells of a row, without the empty cell that a trailing separator adds to `expected` cells.
fn cell_count(row: &[Range<usize>], expected: usize) -> usize {
    if row.len() == expected + 1 && row[expected].is_empty() { expected } else { row.len() }
}

fn check_count(row: &[Range<usize>], expected: usize) -> Result<()> {
    let found = cell_count(row, expected);
    if found == expected {
        return Ok(());
    }
    let message = format!("found {}, expected {expected} as in the heading", counted(found, "cell"));
    Err(Error::data(
        message,
        "Give every row as many cells as the heading; with decimal commas, separate the cells by semicolons.",
    ))
}
