//! Requests for quantities: a column with what stands behind it, or an expression.

use super::columns::{Heading, Used, Wish, column, listed};
use super::expression::{Expression, Fault, LENGTH_MAX};
use super::formula::{Formula, Operand, Suffix, suffix};
use super::parse::parse_number;
use crate::record::heading::{ColumnRequest, Quantity};
use crate::setting::{Text, text};
use crate::text::{excerpt, quoted};
use crate::{Error, Result};

/// Where the column of a request stands, and what is said of it: behind the longest heading that the request begins
/// with, behind its number, or behind its heading in quotation marks.
pub(super) fn place(headings: &[Heading], name: &str) -> Option<(usize, Suffix)> {
    let mut order: Vec<usize> = (0..headings.len()).filter(|&n| !headings[n].name.is_empty()).collect();
    order.sort_by_key(|&n| std::cmp::Reverse(headings[n].name.len()));
    let behind = |at: usize| suffix(name.strip_prefix(headings[at].name.as_str())?);
    order.into_iter().find_map(|at| Some((at, behind(at)?))).or_else(|| {
        let (length, at) = numbered(headings, name).or_else(|| in_marks(headings, name))?;
        Some((at, suffix(&name[length..])?))
    })
}

/// The length of `#3` at the start of a text, and the place of that column.
fn numbered(headings: &[Heading], text: &str) -> Option<(usize, usize)> {
    let digits = text.strip_prefix('#')?.bytes().take_while(u8::is_ascii_digit).count();
    let at = text[1..=digits].parse::<usize>().ok()?.checked_sub(1).filter(|&at| at < headings.len())?;
    Some((digits + 1, at))
}

/// The same of a heading in quotation marks.
fn in_marks(headings: &[Heading], text: &str) -> Option<(usize, usize)> {
    let inner = text.strip_prefix('"')?;
    let end = inner.find('"')?;
    let at = headings.iter().position(|heading| !heading.name.is_empty() && heading.name == inner[..end])?;
    Some((end + 2, at))
}

/// Returns whether a request means something in a table of these headings.
pub(super) fn is_placed(headings: &[Heading], wish: &Wish<'_>, request: &ColumnRequest) -> bool {
    place(headings, &request.name).is_some() || expression(headings, wish, request).is_ok()
}

/// The column or the expression of a request.
pub(super) fn requested(headings: &[Heading], wish: &Wish<'_>, request: &ColumnRequest) -> Result<Used> {
    let quantity = request.quantity;
    if let Some((at, Suffix { formula, unit })) = place(headings, &request.name)
        && !is_of_another(headings, wish, request, at)
    {
        let own = || headings[at].understood().filter(|(q, _)| *q == quantity).and_then(|(_, unit)| unit);
        // Operations make volts of a flag or a duty, whatever the heading says of the cells.
        let unit =
            unit.or_else(|| if formula == Formula::AS_IT_IS { headings[at].unit.clone().or_else(own) } else { None });
        return column(quantity, Some(at), &headings[at].name, formula, unit);
    }
    let (expression, unit) =
        expression(headings, wish, request).map_err(|fault| wrong(headings, wish, request, &fault))?;
    check_names(headings, wish, request, &expression)?;
    let end = request.name.len() - unit.map_or(0, |unit| unit.len() + 1);
    let (text, unit) = (request.name[..end].trim(), unit.map(|unit| unit.trim().to_owned()));
    column(quantity, None, text, Formula::Expression(expression), unit)
}

/// Returns whether a heading that is named like a quantity is the column of that quantity: then the quantity is meant.
fn is_of_another(headings: &[Heading], wish: &Wish<'_>, request: &ColumnRequest, at: usize) -> bool {
    let of = |other: &&ColumnRequest| other.quantity != request.quantity && other.quantity.key() == headings[at].name;
    let other = wish.requests.iter().find(of).filter(|_| !request.name.starts_with(['"', '#']));
    other.is_some_and(|other| uses(headings, wish, other, at))
}

/// Returns whether a request is of a column, alone or in an expression.
fn uses(headings: &[Heading], wish: &Wish<'_>, request: &ColumnRequest, at: usize) -> bool {
    match place(headings, &request.name) {
        Some((place, _)) => place == at,
        None => {
            expression(headings, wish, request).is_ok_and(|(found, _)| found.names().contains(&Operand::Column(at)))
        }
    }
}

/// The expression of a request, and its unit as it was written.
fn expression<'a>(
    headings: &[Heading],
    wish: &Wish<'_>,
    request: &'a ColumnRequest,
) -> std::result::Result<(Expression<Operand>, Option<&'a str>), Fault> {
    let text = request.name.as_str();
    if text.len() > LENGTH_MAX {
        return Err(Fault::Found(format!("{} bytes, expected at most {LENGTH_MAX}", text.len())));
    }
    let (expression, rest) = Expression::parse(text, &|text| operand(headings, wish, request.quantity, text))?;
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

/// The longest name at the start of a text: a heading, a constant, a quantity that another request names.
fn operand(headings: &[Heading], wish: &Wish<'_>, of: Quantity, text: &str) -> Option<(usize, Operand)> {
    let by_place = numbered(headings, text).or_else(|| in_marks(headings, text));
    if let Some((length, at)) = by_place {
        return Some((length, Operand::Column(at)));
    }
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let begins = |name: &str| {
        let behind = text.strip_prefix(name).filter(|_| !name.is_empty())?;
        let goes_on = name.ends_with(is_word) && behind.starts_with(is_word);
        (!goes_on).then_some(name.len())
    };
    let others = wish.requests.iter().map(|request| request.quantity).filter(|quantity| *quantity != of);
    let quantities = others.map(|quantity| (begins(quantity.key()), Operand::Quantity(quantity)));
    // A column whose heading is a number is named by its number.
    let is_name = |heading: &Heading| parse_number(&heading.name, true).is_err();
    let columns = headings.iter().enumerate().filter(|(_, heading)| is_name(heading));
    let columns = columns.map(|(at, heading)| (begins(&heading.name), Operand::Column(at)));
    let constants = wish.constants.iter().map(|(name, value)| (begins(name), Operand::Constant(*value)));
    let all = quantities.chain(columns).chain(constants).filter_map(|(length, operand)| Some((length?, operand)));
    // The first of equals: a quantity before a heading before a constant.
    all.rev().max_by_key(|(length, _)| *length)
}

/// Checks that its names mean one thing each, and that its angles are in rad.
fn check_names(
    headings: &[Heading],
    wish: &Wish<'_>,
    request: &ColumnRequest,
    expression: &Expression<Operand>,
) -> Result<()> {
    for name in expression.names() {
        let Operand::Quantity(quantity) = name else { continue };
        let key = quantity.key();
        let Some(at) = headings.iter().position(|heading| heading.name == key) else { continue };
        if wish.request(quantity).is_none_or(|other| !uses(headings, wish, other, at)) {
            let message =
                format!("{key} in {} is a heading and a quantity that is named beside it", quoted(&request.name));
            let hint = format!("Where the column is meant, write its number, #{}.", at + 1);
            return Err(Error::usage(message, hint));
        }
    }
    for name in expression.angles() {
        let Operand::Column(at) = name else { continue };
        let Some((Quantity::Position, Some(unit))) = headings[at].understood() else { continue };
        if Quantity::Position.factor(&unit).is_none_or(|factor| (factor - 1.0).abs() > 1e-9) {
            let message = format!("column {} is in {unit}, and sin and cos take rad", quoted(&headings[at].name));
            let hint = text!(
                "Name it as the position, and write sin(position): " [Columns = "position={}:{unit}", name_of(&headings[at].name)]
                "; in formulas a position is in rad."
            );
            return Err(Error::usage(message, hint));
        }
    }
    Ok(())
}

/// A heading as requests name it: in quotation marks where it has signs of an expression.
pub(super) fn name_of(heading: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || c == '_';
    match heading.chars().all(plain) && parse_number(heading, true).is_err() {
        true => heading.to_owned(),
        false => format!("\"{heading}\""),
    }
}

/// Why a request names nothing.
fn wrong(headings: &[Heading], wish: &Wish<'_>, request: &ColumnRequest, fault: &Fault) -> Error {
    let (quantity, name) = (request.quantity, quoted(&request.name));
    let is_bare = !request.name.contains(['*', '/', '+', '^', '(', ')']);
    let what = match fault {
        _ if is_bare => format!("no column {name} for {quantity}"),
        Fault::Name(word) => format!("no column {} in {name} for {quantity}", quoted(word)),
        Fault::Found(found) => format!("{name} for {quantity}: found {found}"),
    };
    let constants: Vec<String> = wish.constants.iter().take(20).map(|(name, _)| excerpt(name)).collect();
    let constants =
        if constants.is_empty() { String::new() } else { format!("; constants are {}", constants.join(", ")) };
    let quantity = |fault: &Fault| match fault {
        Fault::Name(word) => Quantity::COLUMNS.into_iter().find(|quantity| quantity.key() == word),
        Fault::Found(_) => None,
    };
    let by_itself = quantity(fault).filter(|_| !is_bare).map_or(Text::default(), |quantity| {
        text!(" To use the {quantity}, name its column too: " [Columns = "{}=HEADING:UNIT", quantity.key()] ".")
    });
    let hint = text!(
        "Give " [Columns] " the exact heading, capitals included, in quotation marks if it has signs, or its number as #2; \
         behind it may stand operations (*12/255, +0.5), a unit (:mA), or a flag's two voltages (:0..12); or write an \
         expression of several columns."
    );
    Error::data(format!("{what}; the heading has {}{constants}", listed(headings)), hint.and(by_itself))
}
