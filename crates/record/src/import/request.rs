//! Requests of the user for quantities: a column followed by operations and a unit, or an expression of columns.

use super::expression::{Expression, Fault, LENGTH_MAX};
use super::formula::{Formula, Operand, Suffix, suffix};
use super::headings::{Heading, listed};
use super::parse::parse_number;
use super::spec::TableSpec;
use super::used::{Used, column};
use crate::heading::Quantity;
use crate::requests::ColumnRequest;
use motorfit_core::setting::{Text, text};
use motorfit_core::text::{excerpt, quoted};
use motorfit_core::{Error, Result};

/// Returns the index of the column of a request, and the suffix that follows its name. The column is named by the longest
/// heading with which the request begins, by its number (`#3`), or by its heading in quotation marks.
pub(super) fn locate(headings: &[Heading], name: &str) -> Option<(usize, Suffix)> {
    divided(headings, name).and_then(|(at, rest)| Some((at, suffix(rest)?)))
}

/// Returns the index of the column of a request, and the text that follows its name, which is a suffix.
pub(super) fn divided<'a>(headings: &[Heading], name: &'a str) -> Option<(usize, &'a str)> {
    let mut order: Vec<usize> = (0..headings.len()).filter(|&n| !headings[n].name.is_empty()).collect();
    order.sort_by_key(|&n| std::cmp::Reverse(headings[n].name.len()));
    let is_suffix = |(_, rest): &(usize, &str)| suffix(rest).is_some();
    let following = |at: usize| Some((at, name.strip_prefix(headings[at].name.as_str())?)).filter(is_suffix);
    order.into_iter().find_map(following).or_else(|| {
        let (length, at) = numbered(headings, name).or_else(|| in_marks(headings, name))?;
        Some((at, &name[length..])).filter(is_suffix)
    })
}

/// Parses a column number such as `#3` at the start of a text; returns its length \[bytes\] and the index of the column.
fn numbered(headings: &[Heading], text: &str) -> Option<(usize, usize)> {
    let digits = text.strip_prefix('#')?.bytes().take_while(u8::is_ascii_digit).count();
    let at = text[1..=digits].parse::<usize>().ok()?.checked_sub(1).filter(|&at| at < headings.len())?;
    Some((digits + 1, at))
}

/// Parses a heading in quotation marks at the start of a text; returns its length \[bytes\] and the index of the column.
fn in_marks(headings: &[Heading], text: &str) -> Option<(usize, usize)> {
    let inner = text.strip_prefix('"')?;
    let end = inner.find('"')?;
    let at = headings.iter().position(|heading| !heading.name.is_empty() && heading.name == inner[..end])?;
    Some((end + 2, at))
}

/// Returns true if a request names a column or is a valid expression in a table with these headings.
pub(super) fn is_satisfiable(headings: &[Heading], spec: &TableSpec<'_>, request: &ColumnRequest) -> bool {
    locate(headings, &request.name).is_some() || expression(headings, spec, request).is_ok()
}

/// Resolves a request to a column or an expression.
///
/// # Errors
/// Returns an error if the request fits neither, its unit is unknown, or a name in it is ambiguous.
pub(super) fn requested(headings: &[Heading], spec: &TableSpec<'_>, request: &ColumnRequest) -> Result<Used> {
    let quantity = request.quantity;
    if let Some((at, Suffix { formula, unit })) = locate(headings, &request.name)
        && !is_of_another(headings, spec, request, at)
    {
        let own = || headings[at].understood().filter(|(q, _)| *q == quantity).and_then(|(_, unit)| unit);
        // The unit in the heading is that of the cells; after operations, such as those that convert a duty to volts, it no
        // longer holds.
        let unit =
            unit.or_else(|| if formula == Formula::AS_IT_IS { headings[at].unit.clone().or_else(own) } else { None });
        return column(quantity, Some(at), &headings[at].name, formula, unit);
    }
    let (expression, unit) =
        expression(headings, spec, request).map_err(|fault| wrong(headings, spec, request, &fault))?;
    check_names(headings, spec, request, &expression)?;
    let end = request.name.len() - unit.map_or(0, |unit| unit.len() + 1);
    let (text, unit) = (request.name[..end].trim(), unit.map(|unit| unit.trim().to_owned()));
    column(quantity, None, text, Formula::Expression(expression), unit)
}

/// Returns true if the heading at `at` has the name of another quantity and the request for that quantity uses this column;
/// the name then refers to that quantity in SI units, not to the cells.
fn is_of_another(headings: &[Heading], spec: &TableSpec<'_>, request: &ColumnRequest, at: usize) -> bool {
    let of = |other: &&ColumnRequest| other.quantity != request.quantity && other.quantity.key() == headings[at].name;
    let other = spec.requests.iter().find(of).filter(|_| !request.name.starts_with(['"', '#']));
    other.is_some_and(|other| uses(headings, spec, other, at))
}

/// Returns true if a request uses a column, alone or in an expression.
fn uses(headings: &[Heading], spec: &TableSpec<'_>, request: &ColumnRequest, at: usize) -> bool {
    match locate(headings, &request.name) {
        Some((found, _)) => found == at,
        None => {
            expression(headings, spec, request).is_ok_and(|(found, _)| found.names().contains(&Operand::Column(at)))
        }
    }
}

/// Parses the expression of a request; also returns the unit as it was written.
pub(super) fn expression<'a>(
    headings: &[Heading],
    spec: &TableSpec<'_>,
    request: &'a ColumnRequest,
) -> std::result::Result<(Expression<Operand>, Option<&'a str>), Fault> {
    let text = request.name.as_str();
    if text.len() > LENGTH_MAX {
        return Err(Fault::Found(format!("{} bytes, expected at most {LENGTH_MAX}", text.len())));
    }
    let (expression, rest) = Expression::parse(text, &|text| operand(headings, spec, request.quantity, text))?;
    let unit = match rest.strip_prefix(':') {
        Some(unit) if !unit.trim().is_empty() => Some(unit),
        None if rest.is_empty() => None,
        _ => return Err(Fault::Found(format!("{}, expected an operation or a unit", quoted(rest)))),
    };
    if expression.names().iter().all(|name| matches!(name, Operand::Constant(_))) {
        return Err(Fault::Found("numbers alone, expected a column".to_owned()));
    }
    Ok((expression, unit))
}

/// Returns the longest name at the start of a text, with its length \[bytes\]: a heading, a constant, or a quantity of another
/// request.
fn operand(headings: &[Heading], spec: &TableSpec<'_>, of: Quantity, text: &str) -> Option<(usize, Operand)> {
    let by_number = numbered(headings, text).or_else(|| in_marks(headings, text));
    if let Some((length, at)) = by_number {
        return Some((length, Operand::Column(at)));
    }
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let begins = |name: &str| {
        let following = text.strip_prefix(name).filter(|_| !name.is_empty())?;
        let goes_on = name.ends_with(is_word) && following.starts_with(is_word);
        (!goes_on).then_some(name.len())
    };
    let others = spec.requests.iter().map(|request| request.quantity).filter(|quantity| *quantity != of);
    let quantities = others.map(|quantity| (begins(quantity.key()), Operand::Quantity(quantity)));
    // A heading that is a number would be mistaken for one; the column is named by `#N` instead.
    let is_name = |heading: &Heading| parse_number(&heading.name, true).is_err();
    let columns = headings.iter().enumerate().filter(|(_, heading)| is_name(heading));
    let columns = columns.map(|(at, heading)| (begins(&heading.name), Operand::Column(at)));
    let constants = spec.constants.iter().map(|(name, value)| (begins(name), Operand::Constant(*value)));
    let all = quantities.chain(columns).chain(constants).filter_map(|(length, operand)| Some((length?, operand)));
    // Of names of equal length a quantity precedes a heading, and a heading a constant.
    all.rev().max_by_key(|(length, _)| *length)
}

/// Checks that each name in an expression is unambiguous and that the arguments of sin and cos are in rad.
fn check_names(
    headings: &[Heading],
    spec: &TableSpec<'_>,
    request: &ColumnRequest,
    expression: &Expression<Operand>,
) -> Result<()> {
    for name in expression.names() {
        let Operand::Quantity(quantity) = name else { continue };
        let key = quantity.key();
        let Some(at) = headings.iter().position(|heading| heading.name == key) else { continue };
        if spec.request(quantity).is_none_or(|other| !uses(headings, spec, other, at)) {
            let message = format!("{key} in {} is a heading and a quantity of another request", quoted(&request.name));
            let hint = format!("To use the column, write its number, #{}.", at + 1);
            return Err(Error::usage(message, hint));
        }
    }
    for name in expression.angles() {
        let Operand::Column(at) = name else { continue };
        let Some((Quantity::Position, Some(unit))) = headings[at].understood() else { continue };
        if Quantity::Position.factor(&unit).is_none_or(|factor| (factor - 1.0).abs() > 1e-9) {
            let message = format!("column {} is in {unit}, but sin and cos take rad", quoted(&headings[at].name));
            let hint = text!(
                "Name the column as the position and write sin(position): " [Columns = "position={}:{unit}", name_of(&headings[at].name)]
                "; in formulas a position is in rad."
            );
            return Err(Error::usage(message, hint));
        }
    }
    Ok(())
}

/// Returns a heading as written in requests: in quotation marks unless it consists of letters, digits and underscores.
pub(in super::super) fn name_of(heading: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || c == '_';
    match heading.chars().all(plain) && parse_number(heading, true).is_err() {
        true => heading.to_owned(),
        false => format!("\"{heading}\""),
    }
}

/// Returns the error for a request that is neither a column nor an expression.
fn wrong(headings: &[Heading], spec: &TableSpec<'_>, request: &ColumnRequest, fault: &Fault) -> Error {
    let (quantity, name) = (request.quantity, quoted(&request.name));
    let is_bare = !request.name.contains(['*', '/', '+', '^', '(', ')']);
    let what = match fault {
        _ if is_bare => format!("no column {name} for {quantity}"),
        Fault::Name(word) => format!("no column {} in {name} for {quantity}", quoted(word)),
        Fault::Found(found) => format!("{name} for {quantity}: found {found}"),
    };
    let constants: Vec<String> = spec.constants.iter().take(20).map(|(name, _)| excerpt(name)).collect();
    let constants =
        if constants.is_empty() { String::new() } else { format!("; constants are {}", constants.join(", ")) };
    let quantity = |fault: &Fault| match fault {
        Fault::Name(word) => Quantity::COLUMNS.into_iter().find(|quantity| quantity.key() == word),
        Fault::Found(_) => None,
    };
    let quantity_hint = quantity(fault).filter(|_| !is_bare).map_or(Text::default(), |quantity| {
        text!(" To use the {quantity}, name its column as well: " [Columns = "{}=HEADING:UNIT", quantity.key()] ".")
    });
    let hint = text!(
        "Give " [Columns] " the exact heading, capitals included, in quotation marks if it contains operators, or its number as \
         #2; append operations (*12/255, +0.5), a unit (:mA) or the two voltages of a flag (:0..12); or write an \
         expression of several columns."
    );
    Error::data(format!("{what}; the heading has {}{constants}", listed(headings)), hint.and(quantity_hint))
}
