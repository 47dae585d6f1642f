//! Selection of the columns of a table: those that the user requests, the others by their headings.

use super::formula::Formula;
use super::headings::Heading;
use super::lacking::{is_drive, lacking, missing};
use super::named;
use super::request::{is_satisfiable, locate, name_of, requested};
use super::spec::{NONE, Need, TableSpec};
use super::used::{Used, column, order};
use crate::heading::Quantity;
use crate::requests::ColumnRequest;
use motorfit_core::setting::{Text, text};
use motorfit_core::text::{excerpt, quoted};
use motorfit_core::{Error, Result};

/// Returns the number of requests that fit the headings plus the number of headings that name a quantity.
pub(super) fn understood(headings: &[Heading], spec: &TableSpec<'_>) -> usize {
    let named = spec.requests.iter().filter(|request| is_satisfiable(headings, spec, request)).count();
    named + headings.iter().filter(|heading| heading.understood().is_some()).count()
}

/// Selects the columns of a table.
///
/// # Errors
/// Returns an error if a request fits no column, headings are ambiguous or contradictory, or a quantity is missing.
pub(super) fn choose(headings: &[Heading], spec: &TableSpec<'_>) -> Result<Vec<Used>> {
    if spec.need == Need::Signals {
        let time = one(headings, spec, Quantity::Time)?;
        return match named::chosen(headings, spec, time)? {
            (_, missing) if !missing.is_empty() => Err(named::lacking(headings, &missing)),
            (used, _) => Ok(used),
        };
    }
    match chosen(headings, spec)? {
        (_, missing) if !missing.is_empty() => Err(lacking(headings, &missing, None)),
        (used, _) => Ok(used),
    }
}

/// Returns the error for a table whose only fault is that quantities are missing; `named` is a suggested request for its hint.
pub(super) fn advised(headings: &[Heading], spec: &TableSpec<'_>, named: Option<Text>) -> Option<Error> {
    if spec.need == Need::Signals {
        return None;
    }
    let (_, missing) = chosen(headings, spec).ok().filter(|(_, missing)| !missing.is_empty())?;
    Some(lacking(headings, &missing, named))
}

/// Selects the columns; also returns the missing quantities by their canonical headings.
fn chosen(headings: &[Heading], spec: &TableSpec<'_>) -> Result<(Vec<Used>, Vec<&'static str>)> {
    let TableSpec { need, timed, .. } = *spec;
    let wanted: &[Quantity] = match need {
        Need::Inputs => &[Quantity::Time, Quantity::Voltage, Quantity::Torque],
        Need::Recording | Need::Part | Need::Signals => &Quantity::ALL,
    };
    let mut used = Vec::new();
    for &quantity in wanted {
        used.extend(one(headings, spec, quantity)?);
    }
    let has = |used: &[Used], quantity| used.iter().any(|u| u.column.quantity == quantity);
    // Quantities in the formulas of others are read too.
    while let Some(quantity) = used.iter().flat_map(Used::quantities).find(|quantity| !has(&used, *quantity)) {
        match one(headings, spec, quantity)? {
            Some(more) => used.push(more),
            None => return Err(not_there(spec, quantity)),
        }
    }
    // Without a position the table is as if it had none.
    let is_absent = |request: &&ColumnRequest| request.name == NONE;
    let position = spec.request(Quantity::Position).filter(|request| !is_absent(request));
    if need != Need::Inputs && !has(&used, Quantity::Speed) && !has(&used, Quantity::Position) {
        // If there is a current, a position with an unusable unit is ignored rather than an error.
        let dispensable = has(&used, Quantity::Current) && position.is_none();
        let position = one(headings, spec, Quantity::Position);
        used.extend(position.or_else(|error| if dispensable { Ok(None) } else { Err(error) })?);
    } else if need != Need::Inputs && !has(&used, Quantity::Position) {
        // A position that is named takes the place of a speed that is not; any other is compared with the speed.
        if position.is_some() && spec.request(Quantity::Speed).is_none() {
            used.retain(|of| of.column.quantity != Quantity::Speed);
        }
        let beside = one(headings, spec, Quantity::Position);
        used.extend(if position.is_some() { beside? } else { beside.ok().flatten() });
    }
    let without_voltage = spec.request(Quantity::Voltage).is_some_and(|request| request.name == NONE);
    let unused = headings.iter().enumerate().filter(|(at, _)| !used.iter().any(|u| u.column_indices().contains(at)));
    let drives = !without_voltage && unused.into_iter().any(|(_, heading)| is_drive(heading));
    let missing = missing(&|quantity| has(&used, quantity), need, drives, timed);
    let twice =
        used.iter().enumerate().find(|(n, u)| u.at.is_some() && used[..*n].iter().any(|other| other.at == u.at));
    let Some((_, twice)) = twice else { return Ok((ordered(used)?, missing)) };
    let message = format!("column {} is named for two quantities", quoted(&twice.column.heading));
    Err(Error::data(message, "Name a different column for each quantity."))
}

/// Returns the error for a quantity in a formula that the table lacks.
fn not_there(spec: &TableSpec<'_>, quantity: Quantity) -> Error {
    let whose = |request: &&ColumnRequest| request.quantity != quantity && request.name.contains(quantity.key());
    let of =
        spec.requests.iter().find(whose).map_or_else(String::new, |request| format!(" of {}", excerpt(&request.name)));
    let hint = text!("Name its column: " [Columns = "{}=HEADING:UNIT", quantity.key()] ".");
    Error::usage(format!("the {quantity}{of} is missing"), hint)
}

/// Checks that the formulas do not depend on each other in a circle.
fn ordered(used: Vec<Used>) -> Result<Vec<Used>> {
    match order(&used) {
        Ok(_) => Ok(used),
        Err(stuck) => {
            let message = format!("{} is a formula of itself", quoted(&used[stuck].column.heading));
            Err(Error::usage(message, "Write formulas of columns, or of quantities that are computed from columns."))
        }
    }
}

/// Selects the column of a quantity by the user's request, else by its heading; `None` if the table has no such column.
pub(super) fn one(headings: &[Heading], spec: &TableSpec<'_>, quantity: Quantity) -> Result<Option<Used>> {
    let request = spec.request(quantity);
    let used = match request {
        // The user states that the table lacks the quantity.
        Some(request) if request.name == NONE && !headings.iter().any(|h| h.name == NONE) => None,
        Some(request) => Some(requested(headings, spec, request)?),
        None => recognized(headings, spec.requests, quantity)?,
    };
    let numbers = request.map_or("", |request| request.name.as_str()).split('#').skip(1);
    let numbers: Vec<&str> =
        numbers.map(|text| text.split(|c: char| !c.is_ascii_digit()).next().unwrap_or("")).collect();
    let by_number = |at: &usize| numbers.contains(&(at + 1).to_string().as_str());
    for at in used.iter().flat_map(Used::column_indices).filter(|at| !by_number(at)) {
        headed_twice(headings, at, quantity)?;
    }
    Ok(used)
}

/// Checks that no other column has the same heading.
fn headed_twice(headings: &[Heading], at: usize, quantity: Quantity) -> Result<()> {
    let same = |(other, heading): &(usize, &Heading)| *other != at && heading.name == headings[at].name;
    let Some((other, _)) = headings.iter().enumerate().find(same) else { return Ok(()) };
    let (first, second, name) = (at.min(other) + 1, at.max(other) + 1, quoted(&headings[at].name));
    let message = format!("columns {first} and {second} are both headed {name}");
    Err(Error::data(message, text!("Name the column by its number: " [Columns = "{}=#{first}", quantity.key()] ".")))
}

/// Selects the column of a quantity by its heading: the canonical one, else the only one that names the quantity.
fn recognized(headings: &[Heading], requests: &[ColumnRequest], quantity: Quantity) -> Result<Option<Used>> {
    let taken: Vec<usize> = requests.iter().filter_map(|r| locate(headings, &r.name)).map(|(at, ..)| at).collect();
    let free = || headings.iter().enumerate().filter(|(at, _)| !taken.contains(at));
    if let Some((at, heading)) = free().find(|(_, h)| h.name == quantity.canonical() && h.unit.is_none()) {
        let unit = heading.understood().and_then(|(_, unit)| unit);
        return column(quantity, Some(at), &heading.name, Formula::AS_IT_IS, unit).map(Some);
    }
    let mut matches = free().filter_map(|(at, heading)| {
        let (found, unit) = heading.understood()?;
        (found == quantity).then_some((at, heading.name.as_str(), unit))
    });
    let Some((at, heading, unit)) = matches.next() else { return Ok(None) };
    if let Some((own, below)) = headings[at].contradiction() {
        let message = format!("{} names the unit {own}, the row below it {below}", quoted(heading));
        let hint = text!("Name its unit: " [Columns = "{}={}:{below}", quantity.key(), name_of(heading)] ".");
        return Err(Error::data(message, hint));
    }
    if let Some((_, other, _)) = matches.next() {
        headed_twice(headings, at, quantity)?;
        let message = format!("both {} and {} look like {quantity}", quoted(heading), quoted(other));
        let hint = text!("Name one of them: " [Columns = "{}={}", quantity.key(), name_of(heading)] ".");
        return Err(Error::data(message, hint));
    }
    column(quantity, Some(at), heading, Formula::AS_IT_IS, unit).map(Some)
}
