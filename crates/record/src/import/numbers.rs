//! Conversion of the numbers of a table into signals in SI units.

use super::bad_rows::{LeftOut, with_remedy};
use super::convert::{Cells, converted};
use super::formula::Formula;
use super::headings::Heading;
use super::signals::Signals;
use super::spec::{Need, TableSpec};
use super::used::Used;
use crate::heading::Quantity;
use crate::lines::Lines;
use crate::measured_at::MeasuredAt;
use crate::source::Source;
use motorfit_core::text::{counted, quoted};
use motorfit_core::{Error, Result};

/// Numbers of the columns of a table that are used, with its headings and what was left out.
pub(super) struct Numbers<'a> {
    pub cells: Cells<'a>,
    pub headings: &'a [Heading],
    pub notes: Vec<String>,
    /// Outputs that were measured in some rows only.
    pub measured_at: Vec<MeasuredAt>,
    /// Lines of rows that hold NaN in all used columns.
    pub blank: Vec<u64>,
    /// Skipped rows that could not be read.
    pub bad: LeftOut,
    /// True if rows for which a formula gives no number are skipped.
    pub skips: bool,
}

impl Numbers<'_> {
    /// Returns the signals of the columns that are used.
    ///
    /// # Errors
    /// Returns `Data` if a formula gives no number in a row that is not skipped, a flag has other than two values, or a row over
    /// which a sum runs was left out.
    pub(super) fn signals(self, used: Vec<Used>, spec: &TableSpec<'_>) -> Result<Signals> {
        let Self { mut cells, headings, mut notes, mut measured_at, blank, mut bad, skips } = self;
        if !blank.is_empty() {
            notes.push(format!("{} of nan left out", counted(blank.len(), "row")));
        }
        let (mut signals, wrong) = converted(&used, &mut cells)?;
        let mut row_lines = cells.lines;
        if let Some(first) = wrong.first().filter(|_| !skips) {
            return Err(with_remedy(&first.error));
        }
        if !wrong.is_empty() {
            wrong.iter().for_each(|wrong| bad.push(row_lines.get(wrong.row).unwrap_or(0), &wrong.error));
            let is_good = |row: &usize| wrong.binary_search_by_key(row, |wrong| wrong.row).is_err();
            let kept: Vec<usize> = (0..row_lines.len()).filter(is_good).collect();
            signals.iter_mut().for_each(|signal| *signal = kept.iter().map(|&row| signal[row]).collect());
            let kept_of = |of: &mut MeasuredAt| of.samples = kept.iter().map(|&row| of.samples[row]).collect();
            measured_at.iter_mut().for_each(kept_of);
            row_lines = row_lines.of(kept.into_iter());
        }
        let (left_out, note) = bad.finish();
        notes.extend(note);
        check_sums(&used, &row_lines, &[blank, left_out.clone()].concat())?;
        let taken: Vec<usize> = used.iter().flat_map(Used::column_indices).collect();
        // Of the many fields of a log those that no word names as a quantity are not listed.
        let is_listed = |heading: &Heading| !heading.name.is_empty() && heading.alias.as_deref() != Some("");
        let others = headings.iter().enumerate().filter(|(at, heading)| !taken.contains(at) && is_listed(heading));
        let source = Source {
            ignored: others.map(|(_, heading)| heading.name.clone()).collect(),
            columns: used.into_iter().map(|used| used.column).collect(),
            lines: row_lines,
            notes,
            ..Source::default()
        };
        let quantities = source.columns.iter().map(|column| column.quantity);
        let mut list: Vec<(Quantity, Vec<f64>)> = quantities.zip(signals).collect();
        if spec.need == Need::Inputs {
            list.retain(|(quantity, _)| *quantity != Quantity::Position);
        }
        let inputs = spec.signals.iter().map(|signal| signal.is_input).collect();
        Ok(Signals { source, list, left_out, inputs, measured_at, holds: false })
    }
}

/// Checks that no row is missing between the rows over which a cumulative sum runs.
fn check_sums(used: &[Used], lines: &Lines, left_out: &[u64]) -> Result<()> {
    let Some(sum) = used.iter().find(|used| matches!(&used.formula, Formula::Expression(e) if e.has_sum())) else {
        return Ok(());
    };
    let range = lines.get(0).zip(lines.get(lines.len().saturating_sub(1)));
    let is_inside = |line: &&u64| range.is_some_and(|(first, last)| (first..last).contains(*line));
    let Some(&line) = left_out.iter().find(is_inside) else { return Ok(()) };
    let message = format!("{} needs every row, but this row has no numbers", quoted(&sum.column.heading));
    let hint = "Give a column with the cumulative value itself, or cut the recording at this line.";
    Err(Error::data(message, hint).at_line(line))
}
