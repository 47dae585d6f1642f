//! The rows of a table into signals in SI.

use super::advice::advice;
use super::bad_rows::{BadRows, LeftOut, with_remedy};
use super::columns::{Need, Used, Wish, choose};
use super::convert::{Cells, converted};
use super::formula::Formula;
use super::layout::{Layout, comment, find};
use super::parse::{Separator, parse_number};
use super::quick::Quick;
use super::signals::Signals;
use super::text::Lines as Text;
use crate::record::{Lines, Quantity, SAMPLES_MAX, Source};
use crate::setting::text;
use crate::text::{counted, excerpt, quoted};
use crate::{Error, Result};
use std::borrow::Cow;
use std::ops::Range;

/// Reads a table: the columns used.
pub(super) fn collect(lines: &mut impl Text, wish: &Wish<'_>) -> Result<Signals> {
    let layout = find(lines, wish)?;
    // Objects of a list have no line of headings.
    let place = Some(layout.line).filter(|line| *line > 0);
    let used = match choose(&layout.headings, wish) {
        Ok(used) => used,
        Err(error) => return Err(advice(lines, &layout, wish)?.unwrap_or(error).at_line(place)),
    };
    let mut rows = Rows::new(&used, &layout, wish.bad_rows == BadRows::Skip);
    read_rows(lines, &mut rows)?;
    let Rows { columns, values, lines: places, blank, mut bad, comma, has_point, quick, skips, .. } = rows;
    if let Some(error) = comma.filter(|_| has_point || quick.is_some_and(|quick| quick.has_point)) {
        return Err(error);
    }
    let mut notes = layout.notes.clone();
    if !blank.is_empty() {
        notes.push(format!("{} of nan left out", counted(blank.len(), "row")));
    }
    let columns = columns.iter().map(|column| (column.at, column.heading)).collect();
    let mut cells = Cells { columns, values, lines: places };
    let (mut signals, wrong) = converted(&used, &mut cells)?;
    let mut places = cells.lines;
    if let Some(first) = wrong.first().filter(|_| !skips) {
        return Err(with_remedy(&first.error));
    }
    if !wrong.is_empty() {
        wrong.iter().for_each(|wrong| bad.push(places.get(wrong.row).unwrap_or(0), &wrong.error));
        let is_good = |row: &usize| wrong.binary_search_by_key(row, |wrong| wrong.row).is_err();
        let kept: Vec<usize> = (0..places.len()).filter(is_good).collect();
        signals.iter_mut().for_each(|signal| *signal = kept.iter().map(|&row| signal[row]).collect());
        places = places.of(kept.into_iter());
    }
    let (left_out, note) = bad.finish();
    notes.extend(note);
    check_sums(&used, &places, &[blank, left_out.clone()].concat())?;
    let taken: Vec<usize> = used.iter().flat_map(Used::places).collect();
    let others =
        layout.headings.iter().enumerate().filter(|(at, heading)| !taken.contains(at) && !heading.name.is_empty());
    let source = Source {
        ignored: others.map(|(_, heading)| heading.name.clone()).collect(),
        columns: used.into_iter().map(|used| used.column).collect(),
        lines: places,
        notes,
        last_line_open: lines.is_open(),
        ..Source::default()
    };
    let quantities = source.columns.iter().map(|column| column.quantity);
    let mut list: Vec<(Quantity, Vec<f64>)> = quantities.zip(signals).collect();
    if wish.need == Need::Inputs || list.iter().any(|(quantity, _)| *quantity == Quantity::Speed) {
        // A position beside a speed serves formulas.
        list.retain(|(quantity, _)| *quantity != Quantity::Position);
    }
    Ok(Signals { source, list, left_out })
}

/// Reads the rows behind a heading.
fn read_rows(lines: &mut impl Text, rows: &mut Rows<'_>) -> Result<()> {
    let layout = rows.layout;
    for (line, text) in &layout.pending {
        rows.take(*line, Ok(text.into()))?;
    }
    // The last line may be cut off: what is wrong with it is said when it is known to be the last.
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

fn cut_off(error: &Error) -> Error {
    let message = format!("the last line is cut off: {}", error.message());
    Error::data(message, "Remove the last line, or copy the file again.").at_line(error.line())
}

/// Checks that sums have all the rows that they run over.
fn check_sums(used: &[Used], lines: &Lines, left_out: &[u64]) -> Result<()> {
    let Some(sum) = used.iter().find(|used| matches!(&used.formula, Formula::Expression(e) if e.has_sum())) else {
        return Ok(());
    };
    let range = lines.get(0).zip(lines.get(lines.len().saturating_sub(1)));
    let is_inside = |line: &&u64| range.is_some_and(|(first, last)| (first..last).contains(*line));
    let Some(&line) = left_out.iter().find(is_inside) else { return Ok(()) };
    let message = format!("{} needs every row, and this one holds no numbers", quoted(&sum.column.heading));
    let hint = "Give a column with the running value itself, or cut the recording at this line.";
    Err(Error::data(message, hint).at_line(line))
}

/// A column whose cells are used.
struct Column<'a> {
    at: usize,
    heading: &'a str,
    is_time: bool,
}

/// Rows on their way into signals.
struct Rows<'a> {
    columns: Vec<Column<'a>>,
    layout: &'a Layout,
    values: Vec<Vec<f64>>,
    lines: Lines,
    /// The lines of rows of nan.
    blank: Vec<u64>,
    /// Rows that cannot be read, where they are left out.
    bad: LeftOut,
    skips: bool,
    cells: Vec<Range<usize>>,
    quick: Option<Quick>,
    /// True where a number had a decimal point. Below, the error of the first decimal comma beside one.
    has_point: bool,
    comma: Option<Error>,
}

impl<'a> Rows<'a> {
    fn new(used: &[Used], layout: &'a Layout, skips: bool) -> Self {
        let mut columns: Vec<Column<'a>> = Vec::new();
        for used in used {
            for at in used.places() {
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

    /// Adds a line, or leaves out one that cannot be read.
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

    /// Adds all plain rows that were read ahead.
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

    /// Adds a line; blank ones, comments and rows of nan are passed over.
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
        // Making an error of each of millions of rows would take as long as reading them all.
        if self.skips && self.bad.has_reasons() && cell_count(row, expected) != expected {
            self.bad.push_without_reason(line);
            return Ok(());
        }
        check_count(row, expected).map_err(|error| error.at_line(line))?;
        let decimal_comma = self.layout.separator.allows_decimal_comma();
        for (n, column) in self.columns.iter().enumerate() {
            let cell = &text[row[column.at].clone()];
            self.has_point |= cell.contains('.');
            // With decimal points too, a comma may as well stand between thousands.
            if self.comma.is_none() && cell.contains(',') {
                let message = format!("found \"{}\" in a file that has decimal points too", excerpt(cell));
                let hint = "Write all numbers with a decimal point and without separators of thousands.";
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
                            "Times are numbers; for dates and clock times count samples instead: " [Columns = "time=-"]
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

    /// Returns whether a row holds nothing: all that is used of it, time perhaps left out, is nan.
    fn is_nan(&self, text: &str) -> bool {
        let nan = |column: &Column<'_>| text[self.cells[column.at].clone()].eq_ignore_ascii_case("nan");
        let values = || self.columns.iter().filter(|column| !column.is_time);
        values().count() > 1 && values().all(nan)
    }
}

/// Returns the number of cells of a row, one fewer where a trailing separator makes an empty cell more than `expected`.
fn cell_count(row: &[Range<usize>], expected: usize) -> usize {
    if row.len() == expected + 1 && row[expected].is_empty() { expected } else { row.len() }
}

fn check_count(row: &[Range<usize>], expected: usize) -> Result<()> {
    let found = cell_count(row, expected);
    if found == expected {
        return Ok(());
    }
    let message = format!("found {}, expected {expected} as in the heading", counted(found, "cell"));
    Err(Error::data(message, "Give every row as many cells as the heading; a decimal comma needs ; between the cells."))
}
