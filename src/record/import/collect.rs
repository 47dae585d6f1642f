//! The rows of a table into signals in SI.

use super::columns::{Used, Wish, choose};
use super::formula::Formula;
use super::layout::{Layout, comment, find};
use super::parse::{Separator, parse_number};
use super::quick::Quick;
use super::signals::Signals;
use super::text::Lines as Text;
use crate::record::{Lines, Quantity, SAMPLES_MAX, Source};
use crate::setting::text;
use crate::text::{counted, excerpt};
use crate::{Error, Result};
use std::ops::Range;

/// Reads a table: the columns used.
pub(super) fn collect(lines: &mut impl Text, wish: &Wish<'_>) -> Result<Signals> {
    let layout = find(lines, wish)?;
    let used = choose(&layout.headings, wish).map_err(|e| e.at_line(layout.line))?;
    let mut rows = Rows::new(&used, &layout);
    for (line, text) in &layout.pending {
        rows.add(*line, text)?;
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
        let Some(line) = next else { break };
        fault = line.text().and_then(|text| rows.add(line.number, &text)).err();
    }
    let Rows { mut signals, lines: places, blank, comma, has_point, quick, .. } = rows;
    if let Some(error) = comma.filter(|_| has_point || quick.is_some_and(|quick| quick.has_point)) {
        return Err(error);
    }
    let mut notes = layout.notes.clone();
    if blank > 0 {
        notes.push(format!("{} of nan left out", counted(blank, "row")));
    }
    for (used, signal) in used.iter().zip(&mut signals) {
        convert(used, signal, &places)?;
    }
    let taken: Vec<usize> = used.iter().map(|used| used.at).collect();
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
    let list = quantities.zip(signals).collect();
    Ok(Signals { source, list })
}

fn cut_off(error: &Error) -> Error {
    let message = format!("the last line is cut off: {}", error.message());
    Error::data(message, "Remove the last line, or copy the file again.").at_line(error.line())
}

/// Rows on their way into signals.
struct Rows<'a> {
    used: &'a [Used],
    layout: &'a Layout,
    signals: Vec<Vec<f64>>,
    lines: Lines,
    /// Rows of nan.
    blank: usize,
    cells: Vec<Range<usize>>,
    quick: Option<Quick>,
    /// True where a number had a decimal point. Below, the error of the first decimal comma beside one.
    has_point: bool,
    comma: Option<Error>,
}

impl<'a> Rows<'a> {
    fn new(used: &'a [Used], layout: &'a Layout) -> Self {
        let used_cells = used.iter().map(|u| u.at);
        let quick = match layout.separator {
            Separator::Sign(sign) => Some(Quick::new(sign, layout.headings.len(), used_cells)),
            Separator::Blanks => None,
        };
        let (signals, lines) = (vec![Vec::new(); used.len()], Lines::default());
        Self { used, layout, signals, lines, blank: 0, cells: Vec::new(), quick, has_point: false, comma: None }
    }

    /// Adds all plain rows that were read ahead.
    fn add_ahead(&mut self, text: &mut impl Text) {
        let Some(quick) = &mut self.quick else { return };
        let (line, ahead) = text.ahead();
        let (mut at, mut count) = (0, 0);
        while self.lines.len() + count < SAMPLES_MAX
            && let Some(next) = quick.read_at(ahead, at)
        {
            for (signal, value) in self.signals.iter_mut().zip(&quick.row) {
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
        check_count(row, self.layout.headings.len()).map_err(|error| error.at_line(line))?;
        let decimal_comma = self.layout.separator.allows_decimal_comma();
        for (n, used) in self.used.iter().enumerate() {
            let cell = &text[row[used.at].clone()];
            self.has_point |= cell.contains('.');
            // With decimal points too, a comma may as well stand between thousands.
            if self.comma.is_none() && cell.contains(',') {
                let message = format!("found \"{}\" in a file that has decimal points too", excerpt(cell));
                let hint = "Write all numbers with a decimal point and without separators of thousands.";
                self.comma = Some(Error::data(message, hint).at_line(line).in_column(&used.column.heading));
            }
            let value = match parse_number(cell, decimal_comma || cell.contains(',')) {
                Ok(value) => value,
                Err(_) if self.is_nan(text) => {
                    self.signals[..n].iter_mut().for_each(|signal| {
                        signal.pop();
                    });
                    self.blank += 1;
                    return Ok(());
                }
                Err(found) => {
                    let hint = match used.column.quantity {
                        Quantity::Time => text!(
                            "Times are numbers; for dates and clock times count samples instead: " [Columns = "time=-"]
                            " " [Rate = "HZ"] "."
                        ),
                        _ => "Correct the cell; a row at the start or end of the recording may be removed.".into(),
                    };
                    return Err(Error::data(found, hint).at_line(line).in_column(&used.column.heading));
                }
            };
            self.signals[n].push(value);
        }
        self.lines.push(line);
        if self.lines.len() > SAMPLES_MAX {
            return Err(Error::data(format!("more than {SAMPLES_MAX} samples"), "Cut the recording.").at_line(line));
        }
        Ok(())
    }

    /// Whether a row holds nothing: all that is used of it, time perhaps left out, is nan.
    fn is_nan(&self, text: &str) -> bool {
        let nan = |used: &&Used| text[self.cells[used.at].clone()].eq_ignore_ascii_case("nan");
        let values = || self.used.iter().filter(|used| used.column.quantity != Quantity::Time);
        values().count() > 1 && values().all(|used| nan(&used))
    }
}

fn check_count(row: &[Range<usize>], expected: usize) -> Result<()> {
    // A trailing separator makes one empty cell more.
    let found = if row.len() == expected + 1 && row[expected].is_empty() { expected } else { row.len() };
    if found == expected {
        return Ok(());
    }
    let message = format!("found {found} cells, expected {expected} as in the heading");
    Err(Error::data(message, "Give every row as many cells as the heading; a decimal comma needs ; between the cells."))
}

/// Makes SI of the numbers of a column: of a flag's two values its two voltages.
fn convert(used: &Used, signal: &mut [f64], lines: &Lines) -> Result<()> {
    let [low, high] = match used.formula {
        Formula::Levels(levels) => levels,
        Formula::Linear { scale, offset } => {
            signal.iter_mut().for_each(|value| *value = (*value * scale + offset) * used.factor);
            return Ok(());
        }
    };
    let Some(&first) = signal.first() else { return Ok(()) };
    let same = |a: f64, b: f64| a.to_bits() == b.to_bits() || (a - b).abs() <= 1e-9 * b.abs();
    let heading = &used.column.heading;
    let Some(&other) = signal.iter().find(|v| !same(**v, first)) else {
        let message = format!("the flag is {first} throughout, expected two values");
        let hint = "Give the voltage itself, or an operation such as HEADING*12.";
        return Err(Error::data(message, hint).in_column(heading));
    };
    if let Some(n) = signal.iter().position(|v| !same(*v, first) && !same(*v, other)) {
        let message = format!("found {} beside {first} and {other}, expected a flag of two values", signal[n]);
        let hint = "Use operations (HEADING*12/255) for a column of more than two values.";
        return Err(Error::data(message, hint).at_line(lines.get(n)).in_column(heading));
    }
    let threshold = f64::midpoint(first, other);
    signal.iter_mut().for_each(|v| *v = used.factor * if *v < threshold { low } else { high });
    Ok(())
}
