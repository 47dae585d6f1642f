//! Conversion of the cells of a table into quantities in SI units, by the formula of each quantity.

use super::expression::Expression;
use super::formula::{Formula, Operand};
use super::used::{Used, order};
use crate::lines::Lines;
use motorfit_core::text::{excerpt, quoted, significant};
use motorfit_core::{Error, Result};

/// Values of the cells of the columns that are used, and the line of each row.
pub(super) struct Cells<'a> {
    /// Index of each column in the table, and its heading.
    pub columns: Vec<(usize, &'a str)>,
    pub values: Vec<Vec<f64>>,
    pub lines: Lines,
}

impl Cells<'_> {
    /// Returns the index in `columns` and `values` of the column `index` of the table.
    fn slot(&self, index: usize) -> usize {
        self.columns.iter().position(|(at, _)| *at == index).unwrap_or(0)
    }
}

/// A row for which a formula gives no finite number.
pub(super) struct NoNumber {
    pub row: usize,
    pub error: Error,
}

/// Computes the quantities of a table in SI units, in the order of `used`; also returns the rows for which a formula gives no
/// finite number, in increasing order.
///
/// # Errors
/// Returns a `Data` error if a flag has other than two values.
pub(super) fn converted(used: &[Used], cells: &mut Cells<'_>) -> Result<(Vec<Vec<f64>>, Vec<NoNumber>)> {
    let order = order(used).unwrap_or_default();
    let mut made: Vec<Vec<f64>> = vec![Vec::new(); used.len()];
    let mut wrong = Vec::new();
    for (done, &n) in order.iter().enumerate() {
        let of = &used[n];
        made[n] = match (&of.formula, of.at) {
            (Formula::Expression(expression), _) => {
                let value = |operand, row: usize| value(operand, row, used, cells, &made);
                let mut values = expression.values(cells.lines.len(), &value);
                wrong.extend(no_numbers(&values, of, expression, &value, cells));
                values.iter_mut().for_each(|value| *value *= of.factor);
                values
            }
            (formula, at) => {
                let at = at.unwrap_or_default();
                let slot = cells.slot(at);
                let later = order[done + 1..].iter().any(|&later| used[later].column_indices().contains(&at));
                let mut signal =
                    if later { cells.values[slot].clone() } else { std::mem::take(&mut cells.values[slot]) };
                convert(of, formula, &mut signal, &cells.lines)?;
                signal
            }
        };
    }
    wrong.sort_by_key(|wrong: &NoNumber| wrong.row);
    wrong.dedup_by_key(|wrong| wrong.row);
    Ok((made, wrong))
}

/// Returns the value of an operand in a row.
fn value(operand: Operand, row: usize, used: &[Used], cells: &Cells<'_>, made: &[Vec<f64>]) -> f64 {
    match operand {
        Operand::Constant(value) => value,
        Operand::Column(at) => cells.values[cells.slot(at)][row],
        Operand::Quantity(quantity) => {
            used.iter().position(|u| u.column.quantity == quantity).map_or(f64::NAN, |n| made[n][row])
        }
    }
}

/// Returns the rows for which an expression gives no finite number; only the first one if the expression has a sum.
fn no_numbers(
    values: &[f64],
    of: &Used,
    expression: &Expression<Operand>,
    value: &dyn Fn(Operand, usize) -> f64,
    cells: &Cells<'_>,
) -> Vec<NoNumber> {
    let name = |operand: Operand| match operand {
        Operand::Constant(_) => "constant".to_owned(),
        Operand::Column(at) => excerpt(cells.columns[cells.slot(at)].1),
        Operand::Quantity(quantity) => quantity.to_string(),
    };
    let shown = |row: usize| {
        let mut with: Vec<String> = Vec::new();
        for operand in expression.names().into_iter().filter(|operand| !matches!(operand, Operand::Constant(_))) {
            let item = format!("{} = {}", name(operand), significant(value(operand, row), 6));
            if !with.contains(&item) {
                with.push(item);
            }
        }
        with.join(", ")
    };
    let error = |row: usize| {
        let what = if values[row].is_nan() { "no number" } else { "infinite" };
        let message = format!("{} of {} is {what} with {}", of.column.quantity, quoted(&of.column.heading), shown(row));
        let hint = "Correct the cell or the formula; int8, int16 and int32 accept integers of 8, 16 and 32 bits only.";
        Error::data(message, hint).at_line(cells.lines.get(row))
    };
    // A cumulative sum is undefined from the first invalid row on.
    let most = if expression.has_sum() { 1 } else { usize::MAX };
    let rows = (0..values.len()).filter(|&row| !(values[row] * of.factor).is_finite()).take(most);
    rows.map(|row| NoNumber { row, error: error(row) }).collect()
}

/// Converts the numbers of a column to SI units in place: by scale and offset, or the two values of a flag to two voltages.
///
/// # Errors
/// Returns a `Data` error if a flag has other than two values.
fn convert(used: &Used, formula: &Formula, signal: &mut [f64], lines: &Lines) -> Result<()> {
    let [low, high] = match *formula {
        Formula::Levels(levels) => levels,
        Formula::Linear { scale, offset } => {
            signal.iter_mut().for_each(|value| *value = (*value * scale + offset) * used.factor);
            return Ok(());
        }
        Formula::Expression(..) => return Ok(()),
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
