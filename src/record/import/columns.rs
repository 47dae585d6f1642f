//! Which columns of a table are used: those that the user names, the others by their headings.

use super::bad_rows::BadRows;
use super::formula::{Formula, Operand};
use super::lacking::{is_drive, lacking, missing};
use super::parse::Separator;
use super::request::{is_placed, name_of, place, requested};
use crate::record::Column;
use crate::record::heading::{ColumnRequest, Quantity, understand};
use crate::setting::{Text, text};
use crate::text::{excerpt, quoted};
use crate::{Error, Result};

/// Requirements of a reader on a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Need {
    /// Voltage, and current or speed; or current and speed.
    Recording,
    /// Voltage.
    Inputs,
    /// Anything but time: other files hold the rest.
    Part,
}

/// The request of a reader to a table.
#[derive(Clone, Copy)]
pub(super) struct Wish<'a> {
    pub requests: &'a [ColumnRequest],
    pub need: Need,
    /// True where time comes from a rate.
    pub timed: bool,
    /// The separator where it is known.
    pub separator: Option<Separator>,
    pub bad_rows: BadRows,
    /// Numbers that stand beside the rows, with their names.
    pub constants: &'a [(String, f64)],
}

impl Wish<'_> {
    pub(super) fn request(&self, quantity: Quantity) -> Option<&ColumnRequest> {
        self.requests.iter().find(|request| request.quantity == quantity)
    }

    pub(super) fn separator_of(&self, line: &str) -> Separator {
        self.separator.unwrap_or_else(|| Separator::of(line))
    }
}

/// The name of no column.
pub(super) const NONE: &str = "-";

/// A heading, with the unit that a row of units below it names.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Heading {
    pub name: String,
    pub unit: Option<String>,
}

impl Heading {
    /// Returns whether the heading and the row below it name different units.
    fn contradiction(&self) -> Option<(String, String)> {
        let (quantity, unit) = understand(&self.name)?;
        let (own, below) = (unit?, self.unit.clone()?);
        let factors = [quantity.factor(&own)?, quantity.factor(&below)?];
        ((factors[0] / factors[1] - 1.0).abs() > 1e-9).then_some((own, below))
    }

    /// Returns its quantity and its unit, if any.
    pub(super) fn understood(&self) -> Option<(Quantity, Option<String>)> {
        let (quantity, unit) = understand(&self.name)?;
        Some((quantity, self.unit.clone().or(unit)))
    }
}

/// A quantity that is used: where its column stands and what turns cells into SI.
#[derive(Debug)]
pub(super) struct Used {
    /// The place of its column; none for an expression.
    pub at: Option<usize>,
    pub column: Column,
    pub formula: Formula,
    pub factor: f64,
}

impl Used {
    /// The places of the columns that it is made of.
    pub(super) fn places(&self) -> Vec<usize> {
        let column = |operand| if let Operand::Column(at) = operand { Some(at) } else { None };
        self.at.into_iter().chain(self.operands().into_iter().filter_map(column)).collect()
    }

    /// The other quantities that it is made of.
    pub(super) fn quantities(&self) -> Vec<Quantity> {
        let quantity = |operand| if let Operand::Quantity(quantity) = operand { Some(quantity) } else { None };
        self.operands().into_iter().filter_map(quantity).collect()
    }

    fn operands(&self) -> Vec<Operand> {
        if let Formula::Expression(expression) = &self.formula { expression.names() } else { Vec::new() }
    }
}

/// Returns the number of columns of a line that the user names or that are explained by their headings.
pub(super) fn understood(headings: &[Heading], wish: &Wish<'_>) -> usize {
    let named = wish.requests.iter().filter(|request| is_placed(headings, wish, request)).count();
    named + headings.iter().filter(|heading| heading.understood().is_some()).count()
}

/// Chooses the columns.
pub(super) fn choose(headings: &[Heading], wish: &Wish<'_>) -> Result<Vec<Used>> {
    match chosen(headings, wish)? {
        (_, missing) if !missing.is_empty() => Err(lacking(headings, &missing, None)),
        (used, _) => Ok(used),
    }
}

/// Returns the error of a table with which nothing is wrong but that quantities are not there, with the words of a request.
pub(super) fn advised(headings: &[Heading], wish: &Wish<'_>, named: Option<Text>) -> Option<Error> {
    let (_, missing) = chosen(headings, wish).ok().filter(|(_, missing)| !missing.is_empty())?;
    Some(lacking(headings, &missing, named))
}

/// The columns, and the quantities that are not there.
fn chosen(headings: &[Heading], wish: &Wish<'_>) -> Result<(Vec<Used>, Vec<&'static str>)> {
    let Wish { need, timed, .. } = *wish;
    let wanted: &[Quantity] = match need {
        Need::Inputs => &[Quantity::Time, Quantity::Voltage, Quantity::Torque],
        Need::Recording | Need::Part => &Quantity::ALL,
    };
    let mut used = Vec::new();
    for &quantity in wanted {
        used.extend(one(headings, wish, quantity)?);
    }
    let has = |used: &[Used], quantity| used.iter().any(|u| u.column.quantity == quantity);
    // What the formulas of others are made of is used too.
    while let Some(quantity) = used.iter().flat_map(Used::quantities).find(|quantity| !has(&used, *quantity)) {
        match one(headings, wish, quantity)? {
            Some(more) => used.push(more),
            None => return Err(not_there(wish, quantity)),
        }
    }
    let position = wish.request(Quantity::Position);
    if need != Need::Inputs && !has(&used, Quantity::Speed) && !has(&used, Quantity::Position) {
        // A position in metres or counts is no fault where the current serves.
        let dispensable = has(&used, Quantity::Current) && position.is_none();
        let position = one(headings, wish, Quantity::Position);
        used.extend(position.or_else(|error| if dispensable { Ok(None) } else { Err(error) })?);
    } else if let Some(request) = position.filter(|_| !has(&used, Quantity::Position) && need != Need::Inputs) {
        let message = text!([Columns](" names position {}, but there is a speed", excerpt(&request.name)));
        let hint =
            "Position serves as a source of speed, and in formulas: leave it out, or rename the heading of the speed.";
        return Err(Error::usage(message, hint));
    }
    let without_voltage = wish.request(Quantity::Voltage).is_some_and(|request| request.name == NONE);
    let unused = headings.iter().enumerate().filter(|(at, _)| !used.iter().any(|u| u.places().contains(at)));
    let drives = !without_voltage && unused.into_iter().any(|(_, heading)| is_drive(heading));
    let missing = missing(&|quantity| has(&used, quantity), need, drives, timed);
    let twice =
        used.iter().enumerate().find(|(n, u)| u.at.is_some() && used[..*n].iter().any(|other| other.at == u.at));
    let Some((_, twice)) = twice else { return Ok((ordered(used)?, missing)) };
    let message = format!("column {} is named for two quantities", quoted(&twice.column.heading));
    Err(Error::data(message, "Name a column of its own for each quantity."))
}

fn not_there(wish: &Wish<'_>, quantity: Quantity) -> Error {
    let whose = |request: &&ColumnRequest| request.quantity != quantity && request.name.contains(quantity.key());
    let of =
        wish.requests.iter().find(whose).map_or_else(String::new, |request| format!(" of {}", excerpt(&request.name)));
    let hint = text!("Name its column: " [Columns = "{}=HEADING:UNIT", quantity.key()] ".");
    Error::usage(format!("the {quantity}{of} is not there"), hint)
}

/// Checks that the formulas can be evaluated one after the other.
fn ordered(used: Vec<Used>) -> Result<Vec<Used>> {
    match order(&used) {
        Ok(_) => Ok(used),
        Err(stuck) => {
            let message = format!("{} is a formula of itself", quoted(&used[stuck].column.heading));
            Err(Error::usage(message, "Write formulas of columns, or of quantities that are formulas of columns."))
        }
    }
}

/// An order in which formulas come after what they are made of; or one that has no place in it.
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

fn one(headings: &[Heading], wish: &Wish<'_>, quantity: Quantity) -> Result<Option<Used>> {
    let request = wish.request(quantity);
    let used = match request {
        // The user says that there is none.
        Some(request) if request.name == NONE && !headings.iter().any(|h| h.name == NONE) => None,
        Some(request) => Some(requested(headings, wish, request)?),
        None => recognized(headings, wish.requests, quantity)?,
    };
    let numbers = request.map_or("", |request| request.name.as_str()).split('#').skip(1);
    let numbers: Vec<&str> =
        numbers.map(|text| text.split(|c: char| !c.is_ascii_digit()).next().unwrap_or("")).collect();
    let by_number = |at: &usize| numbers.contains(&(at + 1).to_string().as_str());
    for at in used.iter().flat_map(Used::places).filter(|at| !by_number(at)) {
        headed_twice(headings, at, quantity)?;
    }
    Ok(used)
}

/// Returns whether another column has the same heading.
fn headed_twice(headings: &[Heading], at: usize, quantity: Quantity) -> Result<()> {
    let same = |(other, heading): &(usize, &Heading)| *other != at && heading.name == headings[at].name;
    let Some((other, _)) = headings.iter().enumerate().find(same) else { return Ok(()) };
    let (first, second, name) = (at.min(other) + 1, at.max(other) + 1, quoted(&headings[at].name));
    let message = format!("columns {first} and {second} are both headed {name}");
    Err(Error::data(message, text!("Say which by its number: " [Columns = "{}=#{first}", quantity.key()] ".")))
}

pub(super) fn listed(headings: &[Heading]) -> String {
    headings.iter().map(|heading| quoted(&heading.name)).collect::<Vec<_>>().join(", ")
}

fn recognized(headings: &[Heading], requests: &[ColumnRequest], quantity: Quantity) -> Result<Option<Used>> {
    let taken: Vec<usize> = requests.iter().filter_map(|r| place(headings, &r.name)).map(|(at, ..)| at).collect();
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
        let hint = text!("Say which: " [Columns = "{}={}:{below}", quantity.key(), name_of(heading)] ".");
        return Err(Error::data(message, hint));
    }
    if let Some((_, other, _)) = matches.next() {
        headed_twice(headings, at, quantity)?;
        let message = format!("both {} and {} look like {quantity}", quoted(heading), quoted(other));
        let hint = text!("Say which: " [Columns = "{}={}", quantity.key(), name_of(heading)] ".");
        return Err(Error::data(message, hint));
    }
    column(quantity, Some(at), heading, Formula::AS_IT_IS, unit).map(Some)
}

pub(super) fn column(
    quantity: Quantity,
    at: Option<usize>,
    heading: &str,
    formula: Formula,
    unit: Option<String>,
) -> Result<Used> {
    let unit_named = unit.is_some() || matches!(formula, Formula::Levels(_));
    if quantity == Quantity::Position && !unit_named {
        // Counts, turns and radians are all common: none can be assumed.
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
