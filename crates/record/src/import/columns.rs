//! Selection of the columns of a table: those that the user requests, the others by their headings.

use super::bad_rows::BadRows;
use super::formula::{Formula, Operand};
use super::lacking::{is_drive, lacking, missing};
use super::named::{self, SignalRequest};
use super::options::ReadOptions;
use super::parse::Separator;
use super::request::{is_satisfiable, locate, name_of, requested};
use crate::Column;
use crate::heading::{Quantity, understand};
use crate::requests::ColumnRequest;
use motorfit_core::setting::{Text, text};
use motorfit_core::text::{excerpt, quoted};
use motorfit_core::{Error, Result};

/// Quantities that a table must have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Need {
    /// Voltage and at least one of current and speed; or current and speed.
    Recording,
    /// Voltage, as the input of a simulation.
    Inputs,
    /// At least one quantity beside time; other files have the remaining ones.
    Part,
    /// The signals of a model.
    Signals,
}

/// Specification of the table to read: requests, requirements and known properties.
#[derive(Clone, Copy)]
pub(super) struct TableSpec<'a> {
    /// Columns that the user assigns to quantities.
    pub requests: &'a [ColumnRequest],
    pub need: Need,
    /// True if time follows from a sample rate.
    pub timed: bool,
    /// The separator of cells, if it is known; otherwise it is detected.
    pub separator: Option<Separator>,
    pub bad_rows: BadRows,
    /// Names and values of constants beside the rows, for use in formulas.
    pub constants: &'a [(String, f64)],
    /// Signals of a model that are read in place of the known quantities.
    pub signals: &'a [SignalRequest],
}

impl<'a> TableSpec<'a> {
    /// Returns the specification of options.
    pub(super) fn of(options: &'a ReadOptions, need: Need) -> Self {
        let ReadOptions { columns: requests, bad_rows, signals, .. } = options;
        let timed = options.rate_hz.is_some();
        Self { requests, need, timed, bad_rows: *bad_rows, separator: None, constants: &[], signals }
    }
}

impl TableSpec<'_> {
    /// Returns the user's request for a quantity.
    pub(super) fn request(&self, quantity: Quantity) -> Option<&ColumnRequest> {
        self.requests.iter().find(|request| request.quantity == quantity)
    }

    /// Returns the separator, detected from `line` unless it is known.
    pub(super) fn separator_of(&self, line: &str) -> Separator {
        self.separator.unwrap_or_else(|| Separator::of(line))
    }
}

/// Name in a request that says that the table lacks the quantity.
pub(super) const NONE: &str = "-";

/// A heading with the unit from the row of units below it, if there is one.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Heading {
    pub name: String,
    pub unit: Option<String>,
    /// Text in which the quantity is recognized in place of the name; empty if the column is used on request alone.
    pub alias: Option<String>,
}

impl Heading {
    /// Returns the units of the heading and of the row below it if they differ.
    fn contradiction(&self) -> Option<(String, String)> {
        let (quantity, unit) = understand(&self.name)?;
        let (own, below) = (unit?, self.unit.clone()?);
        let factors = [quantity.factor(&own)?, quantity.factor(&below)?];
        ((factors[0] / factors[1] - 1.0).abs() > 1e-9).then_some((own, below))
    }

    /// Returns the quantity that the heading names, and the unit; the row of units takes precedence over the heading.
    pub(super) fn understood(&self) -> Option<(Quantity, Option<String>)> {
        let (quantity, unit) = understand(self.alias.as_ref().unwrap_or(&self.name))?;
        Some((quantity, self.unit.clone().or(unit)))
    }
}

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
    let position = spec.request(Quantity::Position);
    if need != Need::Inputs && !has(&used, Quantity::Speed) && !has(&used, Quantity::Position) {
        // If there is a current, a position with an unusable unit is ignored rather than an error.
        let dispensable = has(&used, Quantity::Current) && position.is_none();
        let position = one(headings, spec, Quantity::Position);
        used.extend(position.or_else(|error| if dispensable { Ok(None) } else { Err(error) })?);
    } else if let Some(request) = position.filter(|_| !has(&used, Quantity::Position) && need != Need::Inputs) {
        let message = text!([Columns](" names position {}, but there is a speed", excerpt(&request.name)));
        let hint = "A position is used to compute the speed, or in formulas: leave it out, or rename the heading of the speed.";
        return Err(Error::usage(message, hint));
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

/// Largest number of headings that a message lists.
const LISTED_MAX: usize = 60;

/// Returns the headings in quotation marks; of many the first ones and their number.
pub(super) fn listed(headings: &[Heading]) -> String {
    let mut all: Vec<String> = headings.iter().take(LISTED_MAX).map(|heading| quoted(&heading.name)).collect();
    if headings.len() > LISTED_MAX {
        all.push(format!("… ({} in all)", headings.len()));
    }
    all.join(", ")
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

/// Creates the selection of a column, or of an expression for `at = None`, after a check of its unit.
pub(super) fn column(
    quantity: Quantity,
    at: Option<usize>,
    heading: &str,
    formula: Formula,
    unit: Option<String>,
) -> Result<Used> {
    let unit_named = unit.is_some() || matches!(formula, Formula::Levels(_));
    if quantity == Quantity::Position && !unit_named {
        // Counts, turns and radians are all common, so that no unit can be assumed.
        quantity.check_unit("none").map_err(|e| e.in_column(heading))?;
    }
    let unit = unit.unwrap_or_else(|| quantity.unit().to_owned());
    let factor = if unit_named && unit != quantity.unit() {
        quantity.check_unit(&unit).map_err(|e| e.in_column(heading))?
    } else {
        1.0
    };
    let conversion = formula.shown();
    let unit = unit.replace("rad_s", "rad/s");
    let column = Column { quantity, heading: heading.to_owned(), conversion, unit, unit_named };
    Ok(Used { at, column, formula, factor })
}
