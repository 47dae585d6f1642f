//! Quantities that are read from a table, with the columns and formulas that give them.

use super::formula::{Formula, Operand};
use crate::heading::Quantity;
use crate::source::Column;
use motorfit_core::Result;

/// A quantity that is read: its column or expression, and the conversion to SI units.
#[derive(Debug, Clone)]
pub(super) struct Used {
    /// Index of its column; `None` for an expression.
    pub at: Option<usize>,
    pub column: Column,
    pub formula: Formula,
    /// Factor from the unit of the column to SI units, after the formula.
    pub factor: f64,
}

impl Used {
    /// Returns the indices of the columns from which the quantity is computed.
    pub(super) fn column_indices(&self) -> Vec<usize> {
        let column = |operand| if let Operand::Column(at) = operand { Some(at) } else { None };
        self.at.into_iter().chain(self.operands().into_iter().filter_map(column)).collect()
    }

    /// Returns the other quantities from which the quantity is computed.
    pub(super) fn quantities(&self) -> Vec<Quantity> {
        let quantity = |operand| if let Operand::Quantity(quantity) = operand { Some(quantity) } else { None };
        self.operands().into_iter().filter_map(quantity).collect()
    }

    /// Returns the operands of the expression; none for a column.
    fn operands(&self) -> Vec<Operand> {
        if let Formula::Expression(expression) = &self.formula { expression.names() } else { Vec::new() }
    }
}

/// Returns an order of evaluation in which each formula follows the quantities in it.
///
/// # Errors
/// Returns the index of a quantity that is part of a circle of formulas, or depends on one.
pub(super) fn order(used: &[Used]) -> std::result::Result<Vec<usize>, usize> {
    let mut order: Vec<usize> = Vec::new();
    while order.len() < used.len() {
        let is_made = |quantity: &Quantity| order.iter().any(|&n| used[n].column.quantity == *quantity);
        let is_next = |n: &usize| !order.contains(n) && used[*n].quantities().iter().all(is_made);
        match (0..used.len()).find(is_next) {
            Some(next) => order.push(next),
            None => return Err((0..used.len()).find(|n| !order.contains(n)).unwrap_or(0)),
        }
    }
    Ok(order)
}

/// Creates the selection of a column, or of an expression for `at = None`, after a check of its unit.
pub(super) fn column(
    quantity: Quantity,
    at: Option<usize>,
    heading: &str,
    formula: Formula,
    unit: Option<String>,
) -> Result<Used> {
    let is_given = unit.is_some() || matches!(formula, Formula::Levels(_));
    if quantity == Quantity::Position && !is_given {
        // Counts, turns and radians are all common, so that no unit can be assumed.
        quantity.check_unit("none").map_err(|e| e.in_column(heading))?;
    }
    // A formula converts to SI units if it names no other.
    let unit_named = is_given || formula != Formula::AS_IT_IS;
    let unit = unit.unwrap_or_else(|| quantity.unit().to_owned());
    let factor = if is_given && unit != quantity.unit() {
        quantity.check_unit(&unit).map_err(|e| e.in_column(heading))?
    } else {
        1.0
    };
    let conversion = formula.shown();
    let unit = unit.replace("rad_s", "rad/s");
    let column = Column { quantity, heading: heading.to_owned(), conversion, unit, unit_named };
    Ok(Used { at, column, formula, factor })
}
