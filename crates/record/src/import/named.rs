//! Selection of the columns of the signals of a user's model: those that are requested, the others by their headings.
//!
//! A heading fits a signal if it is its name or its column of the model, in any case and with spaces or hyphens in place of
//! underscores, alone or followed by a unit of the same dimension: `motor_speed`, `Motor speed [rpm]`, `motor-speed_rad_s`.

use super::formula::{Formula, Suffix};
use super::headings::{Heading, listed};
use super::options::SignalRequest;
use super::request::{expression, locate, name_of};
use super::spec::{NONE, TableSpec};
use super::used::Used;
use crate::heading::Quantity;
use crate::requests::ColumnRequest;
use crate::source::Column;
use motorfit_core::setting::text;
use motorfit_core::text::{excerpt, quoted};
use motorfit_core::{Error, Result};

/// Selects the columns of time and of the signals; also returns the names of the signals that are missing.
pub(super) fn chosen(
    headings: &[Heading],
    spec: &TableSpec<'_>,
    time: Option<Used>,
) -> Result<(Vec<Used>, Vec<String>)> {
    let (mut used, mut missing): (Vec<Used>, Vec<String>) = (time.into_iter().collect(), Vec::new());
    if used.is_empty() && !spec.timed {
        missing.push("time".to_owned());
    }
    let mut measured = 0;
    for (number, signal) in (0_u8..).zip(spec.signals) {
        match one(headings, spec, number, signal)? {
            Some(column) => {
                measured += usize::from(!signal.is_input);
                used.push(column);
            }
            None if !signal.is_optional => missing.push(signal.heading().to_owned()),
            None => {}
        }
    }
    // A simulation requests inputs only.
    let is_named =
        spec.signals.iter().any(|signal| !signal.is_input && missing.iter().any(|name| name == signal.heading()));
    if measured == 0 && !is_named && spec.signals.iter().any(|signal| !signal.is_input) {
        let outputs = spec.signals.iter().filter(|signal| !signal.is_input).map(SignalRequest::heading);
        missing.push(outputs.collect::<Vec<_>>().join(" or "));
    }
    for (n, column) in used.iter().enumerate() {
        let same = |other: &&Used| {
            column.at.is_some() && other.at == column.at && other.column.quantity != column.column.quantity
        };
        let Some(other) = used[..n].iter().find(same) else { continue };
        // A signal may be an input and an output, or two outputs of one sensor; time is neither.
        if other.column.quantity == Quantity::Time {
            let message = format!("column {} is named for the time and a signal", quoted(&column.column.heading));
            return Err(Error::data(message, "Name a different column for each."));
        }
    }
    Ok((used, missing))
}

/// Returns the error for a table that lacks signals.
pub(super) fn lacking(headings: &[Heading], missing: &[String]) -> Error {
    let message = format!("no column for {}; the heading has {}", missing.join(" and "), listed(headings));
    let requests: Vec<String> =
        missing.iter().map(|name| format!("{}=HEADING:UNIT", name.split(" or ").next().unwrap_or(name))).collect();
    Error::data(
        message,
        text!("Rename the headings, or name the columns of the signals: " [Columns = "{}", requests.join(",")] "."),
    )
}

fn one(headings: &[Heading], spec: &TableSpec<'_>, number: u8, signal: &SignalRequest) -> Result<Option<Used>> {
    let own = spec.request(Quantity::Signal(number));
    let request = own.or_else(|| spec.request(signal.known()?));
    match request {
        Some(request) if request.name == NONE && !headings.iter().any(|h| h.name == NONE) => Ok(None),
        Some(request) => requested(headings, spec, (number, signal), request).map(Some),
        None => recognized(headings, spec, (number, signal)),
    }
}

/// Resolves a request to a column or an expression of columns.
fn requested(
    headings: &[Heading],
    spec: &TableSpec<'_>,
    (number, signal): (u8, &SignalRequest),
    request: &ColumnRequest,
) -> Result<Used> {
    if let Some((at, Suffix { formula, unit })) = locate(headings, &request.name) {
        let own = || unit_of(&headings[at], signal).flatten();
        let unit =
            unit.or_else(|| if formula == Formula::AS_IT_IS { headings[at].unit.clone().or_else(own) } else { None });
        return column(number, signal, Some(at), &headings[at].name, (formula, unit));
    }
    let Ok((formula, unit)) = expression(headings, spec, request) else {
        let message =
            format!("{} for {}: neither a column nor an expression of columns", quoted(&request.name), signal.name);
        let hint = format!(
            "Give the exact heading, capitals included, or its number as #2; the headings are {}.",
            listed(headings)
        );
        return Err(Error::data(message, hint));
    };
    let end = request.name.len() - unit.map_or(0, |unit| unit.len() + 1);
    let unit = unit.map(|unit| unit.trim().to_owned());
    column(number, signal, None, request.name[..end].trim(), (Formula::Expression(formula), unit))
}

/// Selects the only column whose heading fits a signal.
fn recognized(
    headings: &[Heading],
    spec: &TableSpec<'_>,
    (number, signal): (u8, &SignalRequest),
) -> Result<Option<Used>> {
    let taken: Vec<usize> = spec.requests.iter().filter_map(|r| locate(headings, &r.name)).map(|(at, ..)| at).collect();
    let free = || headings.iter().enumerate().filter(|(at, _)| !taken.contains(at));
    let named = |name: &str| free().find(|(_, heading)| heading.name == name);
    let exact = named(signal.heading()).or_else(|| named(&signal.name));
    let mut fitting = free().filter(|(_, heading)| unit_of(heading, signal).is_some());
    let Some((at, heading)) = exact.or_else(|| fitting.next()) else { return Ok(None) };
    let other = fitting.find(|(other, _)| *other != at && exact.is_none());
    if let Some((_, other)) = other {
        let message = format!("both {} and {} look like {}", quoted(&heading.name), quoted(&other.name), signal.name);
        let hint = text!("Name one of them: " [Columns = "{}={}", signal.name, name_of(&heading.name)] ".");
        return Err(Error::data(message, hint));
    }
    let unit = heading.unit.clone().or_else(|| unit_of(heading, signal).flatten());
    column(number, signal, Some(at), &heading.name, (Formula::AS_IT_IS, unit)).map(Some)
}

/// Returns `Some` if a heading fits a signal, with the unit that it names.
fn unit_of(heading: &Heading, signal: &SignalRequest) -> Option<Option<String>> {
    let (name, in_brackets) = match heading.name.find(['(', '[']) {
        Some(open) => {
            let unit = heading.name[open + 1..].trim_end().trim_end_matches([')', ']']).trim();
            (heading.name[..open].trim(), Some(unit.to_owned()))
        }
        None => (heading.name.trim(), None),
    };
    let plain = |text: &str| text.to_lowercase().replace([' ', '-'], "_");
    for wanted in [signal.heading(), &signal.name] {
        let Some(rest) = plain(name).strip_prefix(&plain(wanted)).map(str::len) else { continue };
        // The cases of the text count in units.
        let rest = name.get(name.len() - rest..).unwrap_or_default();
        if rest.is_empty() {
            return Some(in_brackets);
        }
        let unit = rest.trim_start_matches(['_', ' ', '-', '/']);
        if in_brackets.is_none() && unit.len() < rest.len() && signal.conversion(unit).is_some() {
            return Some(Some(unit.to_owned()));
        }
    }
    let (quantity, unit) = heading.understood()?;
    (signal.known() == Some(quantity)).then_some(unit)
}

/// Creates the selection of a column, with the conversion to the unit of the model.
fn column(
    number: u8,
    signal: &SignalRequest,
    at: Option<usize>,
    heading: &str,
    (formula, unit): (Formula, Option<String>),
) -> Result<Used> {
    let unit_named = unit.is_some() || formula != Formula::AS_IT_IS;
    let unit = unit.filter(|unit| !unit.is_empty()).unwrap_or_else(|| signal.unit_text.clone());
    let Some((factor, offset)) = signal.conversion(&unit) else {
        let message =
            format!("{} is in {}, which does not convert to {}", quoted(heading), excerpt(&unit), signal.unit_text);
        let hint = text!("Name its unit: " [Columns = "{}={}:{}", signal.name, name_of(heading), signal.unit_text] ".");
        return Err(Error::data(message, hint).in_column(heading));
    };
    let unit = unit.replace("rad_s", "rad/s");
    let conversion = formula.shown();
    let is_shifted = offset.abs() > 0.0;
    let (formula, factor) = match formula {
        Formula::Linear { scale, offset: own } if is_shifted => {
            (Formula::Linear { scale: scale * factor, offset: own * factor + offset }, 1.0)
        }
        _ if is_shifted => {
            let message = format!("the zero of {} is not that of {}", excerpt(&unit), signal.unit_text);
            return Err(Error::usage(message, text!("Write the conversion in the formula of " [Columns] ".")));
        }
        formula => (formula, factor),
    };
    let column =
        Column { quantity: Quantity::Signal(number), heading: heading.to_owned(), conversion, unit, unit_named };
    Ok(Used { at, column, formula, factor })
}
