//! Formulas of quantities: a column with operations, the two voltages of a flag, or an expression of several columns.
//!
//! The syntax is `HEADING[*NUMBER | /NUMBER | +NUMBER | -NUMBER]…[:UNIT]`, evaluated from left to right, or
//! `HEADING:LOW..HIGH`; `#3` names the third column. A heading that contains operators itself is matched first. Any other
//! text is an [`Expression`] with the usual precedence.

use super::expression::{Expression, LENGTH_MAX};
use super::parse::{number_length, parse_number};
use crate::heading::Quantity;
use motorfit_core::text::significant;

/// Largest number of operations after a heading.
const OPERATIONS_MAX: usize = 8;

/// Meaning of a name in an expression.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Operand {
    /// The cells of the column with this index.
    Column(usize),
    /// A constant beside the rows of the table.
    Constant(f64),
    /// Another quantity of the recording, in SI units.
    Quantity(Quantity),
}

/// Conversion of cells into a quantity.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Formula {
    /// `scale · cell + offset`, in the unit of the column.
    Linear { scale: f64, offset: f64 },
    /// A flag of two values: the voltages of its lower and its higher value \[V\].
    Levels([f64; 2]),
    /// An expression of several columns.
    Expression(Expression<Operand>),
}

impl Formula {
    /// The identity.
    pub(super) const AS_IT_IS: Self = Self::Linear { scale: 1.0, offset: 0.0 };

    /// Returns a description of the conversion; empty for the identity and for expressions.
    pub(super) fn shown(&self) -> String {
        let (scale, offset) = match self {
            Self::Linear { scale, offset } => (*scale, *offset),
            Self::Levels([low, high]) => return format!("flag: {} or {}", significant(*low, 5), significant(*high, 5)),
            Self::Expression(..) => return String::new(),
        };
        let scaled = ((scale - 1.0).abs() > 0.0).then(|| format!("× {}", significant(scale, 5)));
        let sign = if offset < 0.0 { "−" } else { "+" };
        let shifted = (offset.abs() > 0.0).then(|| format!("{sign} {}", significant(offset.abs(), 5)));
        scaled.into_iter().chain(shifted).collect::<Vec<_>>().join(" ")
    }
}

/// The text after a heading in a request: formula and unit.
pub(super) struct Suffix {
    pub formula: Formula,
    pub unit: Option<String>,
}

/// Parses the text after a heading; `None` if it is not a sequence of operations with an optional unit or levels.
pub(super) fn suffix(text: &str) -> Option<Suffix> {
    if text.len() > LENGTH_MAX {
        return None;
    }
    let (operations, unit) =
        text.split_once(':').map_or((text, None), |(operations, unit)| (operations, Some(unit.trim())));
    let formula = linear(operations.trim())?;
    if let Some(levels) = unit.and_then(levels) {
        return (formula == Formula::AS_IT_IS).then_some(Suffix { formula: Formula::Levels(levels), unit: None });
    }
    if unit == Some("") {
        return None;
    }
    Some(Suffix { formula, unit: unit.map(str::to_owned) })
}

/// Parses operations such as `*12/7200-1` into a scale and an offset.
fn linear(text: &str) -> Option<Formula> {
    let (mut scale, mut offset) = (1.0, 0.0);
    for (sign, number) in operations(text)? {
        match sign {
            '*' => (scale, offset) = (scale * number, offset * number),
            '/' => (scale, offset) = (scale / number, offset / number),
            '+' => offset += number,
            _ => offset -= number,
        }
    }
    (f64::is_finite(scale) && f64::is_finite(offset) && scale != 0.0).then_some(Formula::Linear { scale, offset })
}

/// Parses a sequence of operators, each followed by a number.
fn operations(mut text: &str) -> Option<Vec<(char, f64)>> {
    let mut list = Vec::new();
    while !text.is_empty() {
        let sign = text.chars().next().filter(|c| matches!(c, '*' | '/' | '+' | '-'))?;
        let rest = &text[1..];
        let length = number_length(rest);
        list.push((sign, parse_number(&rest[..length], false).ok()?));
        text = rest[length..].trim_start();
        if list.len() > OPERATIONS_MAX {
            return None;
        }
    }
    Some(list)
}

/// Parses the levels of a flag, `6.67..7.79`; each side may be a product, as in `11.04*154/255..11.04*180/255`.
fn levels(text: &str) -> Option<[f64; 2]> {
    let (low, high) = text.split_once("..").filter(|(_, high)| !high.starts_with('.'))?;
    let value = |text: &str| {
        let text = text.trim();
        let length = number_length(text);
        let first = parse_number(&text[..length], false).ok()?;
        let value =
            operations(text[length..].trim_start())?.into_iter().try_fold(first, |value, (sign, by)| match sign {
                '*' => Some(value * by),
                '/' => Some(value / by),
                _ => None,
            })?;
        value.is_finite().then_some(value)
    };
    Some([value(low)?, value(high)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn linear_of(text: &str) -> Option<(f64, f64, Option<String>)> {
        match suffix(text)? {
            Suffix { formula: Formula::Linear { scale, offset }, unit } => Some((scale, offset, unit)),
            Suffix { .. } => None,
        }
    }

    #[test]
    fn operations_go_from_left_to_right() {
        assert_eq!(linear_of(""), Some((1.0, 0.0, None)));
        assert_eq!(linear_of(":mA"), Some((1.0, 0.0, Some("mA".to_owned()))));
        assert_eq!(linear_of("*12/4:V"), Some((3.0, 0.0, Some("V".to_owned()))));
        assert_eq!(linear_of("-512*-2 + 1e-3"), Some((-2.0, 1024.001, None)));
        assert_eq!(linear_of(":8kHz"), Some((1.0, 0.0, Some("8kHz".to_owned()))));
        for bad in ["*", "*x", "*0", "/0", "x", "*1*1*1*1*1*1*1*1*1", ":", "*1e400", "**2", &"*1".repeat(200)] {
            assert!(suffix(bad).is_none(), "{bad}");
        }
    }

    #[test]
    fn a_flag_has_two_voltages() {
        let of = |text: &str| match suffix(text) {
            Some(Suffix { formula: Formula::Levels(levels), .. }) => Some(levels),
            _ => None,
        };
        assert_eq!(of(":0..12"), Some([0.0, 12.0]));
        assert_eq!(of(":12..-12"), Some([12.0, -12.0]));
        assert_eq!(of(":10*3/4 .. 10*2/4"), Some([7.5, 5.0]));
        assert_eq!(of(":1..2..3"), None);
        assert_eq!(of("*2:0..12"), None);
        assert_eq!(of(":a..b"), None);
    }
}
