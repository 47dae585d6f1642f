//! The rows of a table into signals in SI.

use super::columns::{Used, choose};
use super::formula::Formula;
use super::layout::{Layout, Separator, Wish, comment, find};
use super::parse::parse_number;
use super::quick::Quick;
use super::text::{Line, Lines as Text};
use crate::record::{Column, Lines, Quantity, SAMPLES_MAX};
use crate::setting::text;
use crate::text::excerpt;
use crate::{Error, Result};
use std::ops::Range;

/// A table that was read: the columns used, in SI but for flags and positions that [`super::signals`] makes of them.
#[derive(Debug, Default)]
pub(super) struct Collected {
    pub columns: Vec<Column>,
    pub signals: Vec<Vec<f64>>,
    pub lines: Lines,
    pub ignored: Vec<String>,
    pub notes: Vec<String>,
    pub last_line_open: bool,
}

/// Reads a table.
pub(super) fn collect(lines: &mut impl Text, wish: &Wish<'_>) -> Result<Collected> {
    let layout = find(lines, wish)?;
    let used = choose(&layout.headings, wish.requests, wish.need, wish.timed).map_err(|e| e.at_line(layout.line))?;
    let mut rows = Rows::new(&used, &layout);
    for (line, text) in &layout.pending {
        rows.add(*line, text)?;
    }
    // The last line may be cut off: what is wrong with it is said when it is known to be the last.
    let mut fault: Option<Error> = None;
    loop {
        let tried = fault.is_none() && rows.add_ahead(lines);
        let next = lines.next_line()?;
        if let Some(error) = fault {
            let cut = next.is_none() && lines.is_open();
            return Err(if cut { cut_off(error) } else { error });
        }
        let Some(line) = next else { break };
        fault = rows.add_line(line, !tried).err();
    }
    rows.check_decimals()?;
    let Rows { mut signals, lines: places, blank, .. } = rows;
    let mut notes = layout.notes.clone();
    if blank > 0 {
        notes.push(format!("{blank} row{} of nan left out", if blank == 1 { "" } else { "s" }));
    }
    for (used, signal) in used.iter().zip(&mut signals) {
        used.convert(signal);
        levels(used, signal, &places)?;
    }
    let taken = |at: &usize| used.iter().any(|u| u.at == *at);
    let ignored = (0..layout.headings.len()).filter(|at| !taken(at));
    Ok(Collected {
        ignored: ignored.map(|at| layout.headings[at].name.clone()).filter(|name| !name.is_empty()).collect(),
        columns: used.into_iter().map(|u| u.column).collect(),
        signals,
        lines: places,
        notes,
        last_line_open: lines.is_open(),
    })
}

fn cut_off(error: Error) -> Error {
    let line = error.line();
    let cut = Error::data(
        format!("the last line is cut off: {}", error.message()),
        "Remove the last line, or copy the file again.",
    );
    line.into_iter().fold(cut, Error::at_line)
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
    /// Whether numbers had a decimal point, and the first that had a decimal comma.
    has_point: bool,
    comma: Option<(u64, String, String)>,
}

impl<'a> Rows<'a> {
    fn new(used: &'a [Used], layout: &'a Layout) -> Self {
        let quick = |sign| Quick::new(sign, layout.headings.len(), used.iter().map(|u| u.at));
        let quick = match layout.separator {
            Separator::Sign(sign) => Some(quick(sign)),
            Separator::Blanks => None,
        };
        let signals = vec![Vec::new(); used.len()];
        Self {
            used,
            layout,
            signals,
            lines: Lines::default(),
            blank: 0,
            cells: Vec::new(),
            quick,
            has_point: false,
            comma: None,
        }
    }

    /// Adds all plain rows that were read ahead; whether there were bytes to try.
    fn add_ahead(&mut self, text: &mut impl Text) -> bool {
        let Some(quick) = &mut self.quick else { return false };
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
        let tried = !ahead.is_empty();
        self.lines.extend(line, count);
        text.pass(count as u64, at);
        tried
    }

    /// Adds a line, one that may be a plain row.
    fn add_line(&mut self, line: Line<'_>, plain: bool) -> Result<()> {
        let quick = self.quick.as_mut().filter(|_| plain);
        let Some(quick) = quick.and_then(|quick| quick.read(line.bytes).then_some(quick)) else {
            return self.add(line.number, &line.text()?);
        };
        for (signal, value) in self.signals.iter_mut().zip(&quick.row) {
            signal.push(*value);
        }
        self.count(line.number)
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
            if self.comma.is_none() && cell.contains(',') {
                self.comma = Some((line, used.column.heading.clone(), cell.to_owned()));
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
                Err(found) if used.column.quantity == Quantity::Time => {
                    let hint = text!(
                        "Times are numbers; for dates and clock times count samples instead: " [Columns = "time=-"] " "
                        [Rate = "HZ"] "."
                    );
                    return Err(Error::data(found, hint).at_line(line).in_column(&used.column.heading));
                }
                Err(found) => {
                    return Err(Error::data(
                        found,
                        "Correct the cell; a row at the start or end of the recording may be removed.",
                    )
                    .at_line(line)
                    .in_column(&used.column.heading));
                }
            };
            self.signals[n].push(value);
        }
        self.count(line)
    }

    /// Counts a row that was added.
    fn count(&mut self, line: u64) -> Result<()> {
        self.lines.push(line);
        if self.lines.len() > SAMPLES_MAX {
            return Err(Error::data(format!("more than {SAMPLES_MAX} samples"), "Cut the recording.").at_line(line));
        }
        Ok(())
    }

    /// A file has decimal points or decimal commas: with both, a comma may as well stand between thousands.
    fn check_decimals(&self) -> Result<()> {
        let has_point = self.has_point || self.quick.as_ref().is_some_and(|quick| quick.has_point);
        match &self.comma {
            Some((line, heading, cell)) if has_point => Err(Error::data(
                format!("found \"{}\" in a file that has decimal points too", excerpt(cell)),
                "Write all numbers with a decimal point and without separators of thousands.",
            )
            .at_line(*line)
            .in_column(heading)),
            _ => Ok(()),
        }
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
    Err(Error::data(
        format!("found {found} cells, expected {expected} as in the heading"),
        "Give every row as many cells as the heading; a decimal comma needs ; between the cells.",
    ))
}

/// Puts a flag's two voltages for its two values.
fn levels(used: &Used, signal: &mut [f64], lines: &Lines) -> Result<()> {
    let Formula::Levels([low, high]) = used.formula else { return Ok(()) };
    let Some(&first) = signal.first() else { return Ok(()) };
    let same = |a: f64, b: f64| a.to_bits() == b.to_bits() || (a - b).abs() <= 1e-9 * b.abs();
    let heading = &used.column.heading;
    let Some(&other) = signal.iter().find(|v| !same(**v, first)) else {
        return Err(Error::data(
            format!("the flag is {first} throughout, expected two values"),
            "Give the voltage itself, or an operation such as HEADING*12.",
        )
        .in_column(heading));
    };
    if let Some(n) = signal.iter().position(|v| !same(*v, first) && !same(*v, other)) {
        let error = Error::data(
            format!("found {} beside {first} and {other}, expected a flag of two values", signal[n]),
            "Use operations (HEADING*12/255) for a column of more than two values.",
        );
        let error = lines.get(n).into_iter().fold(error, Error::at_line);
        return Err(error.in_column(heading));
    }
    let threshold = f64::midpoint(first, other);
    signal.iter_mut().for_each(|v| *v = used.factor * if *v < threshold { low } else { high });
    Ok(())
}
