//! Which columns of a table are used: those that the user names, the others by their headings.

use super::formula::{Formula, Suffix, suffix};
use super::parse::{Separator, parse_number};
use crate::record::Column;
use crate::record::heading::{ColumnRequest, Quantity, understand};
use crate::setting::text;
use crate::text::{excerpt, printable, quoted};
use crate::{Error, Result};

/// What a reader needs of a table.
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
}

impl Wish<'_> {
    fn request(&self, quantity: Quantity) -> Option<&ColumnRequest> {
        self.requests.iter().find(|request| request.quantity == quantity)
    }

    pub(super) fn separator_of(&self, line: &str) -> Separator {
        self.separator.unwrap_or_else(|| Separator::of(line))
    }
}

/// What names no column.
pub(super) const NONE: &str = "-";

/// A heading, with the unit that a row of units below it names.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Heading {
    pub name: String,
    pub unit: Option<String>,
}

impl Heading {
    /// Whether the heading and the row below it name different units.
    fn contradiction(&self) -> Option<(String, String)> {
        let (quantity, unit) = understand(&self.name)?;
        let (own, below) = (unit?, self.unit.clone()?);
        let factors = [quantity.factor(&own)?, quantity.factor(&below)?];
        ((factors[0] / factors[1] - 1.0).abs() > 1e-9).then_some((own, below))
    }

    /// What it says: its quantity and its unit, if any.
    fn understood(&self) -> Option<(Quantity, Option<String>)> {
        let (quantity, unit) = understand(&self.name)?;
        Some((quantity, self.unit.clone().or(unit)))
    }
}

/// A column that is used: where it stands and what turns its cells into SI.
#[derive(Debug)]
pub(super) struct Used {
    pub at: usize,
    pub column: Column,
    pub formula: Formula,
    pub factor: f64,
}

/// How many columns of a line the user names or their headings explain.
pub(super) fn understood(headings: &[Heading], requests: &[ColumnRequest]) -> usize {
    let named = requests.iter().filter(|request| place(headings, &request.name).is_some()).count();
    named + headings.iter().filter(|heading| heading.understood().is_some()).count()
}

/// Chooses the columns.
pub(super) fn choose(headings: &[Heading], wish: &Wish<'_>) -> Result<Vec<Used>> {
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
    let position = wish.request(Quantity::Position);
    if need != Need::Inputs && !has(&used, Quantity::Speed) {
        // A position in metres or counts is no fault where the current serves.
        let dispensable = has(&used, Quantity::Current) && position.is_none();
        let position = one(headings, wish, Quantity::Position);
        used.extend(position.or_else(|error| if dispensable { Ok(None) } else { Err(error) })?);
    } else if let Some(request) = position {
        let message = text!([Columns](" names position {}, but there is a speed", excerpt(&request.name)));
        let hint = "Position serves as a source of speed: leave it out, or rename the heading of the speed.";
        return Err(Error::usage(message, hint));
    }
    let without_voltage = wish.request(Quantity::Voltage).is_some_and(|request| request.name == NONE);
    let unused = headings.iter().enumerate().filter(|(at, _)| !used.iter().any(|u| u.at == *at));
    let drives = !without_voltage && unused.into_iter().any(|(_, heading)| is_drive(heading));
    let missing = missing(&|quantity| has(&used, quantity), need, drives, timed);
    if !missing.is_empty() {
        return Err(lacking(headings, &missing));
    }
    let twice = used.iter().enumerate().find(|(n, u)| used[..*n].iter().any(|other| other.at == u.at));
    let Some((_, twice)) = twice else { return Ok(used) };
    let message = format!("column {} is named for two quantities", quoted(&twice.column.heading));
    Err(Error::data(message, "Name a column of its own for each quantity."))
}

fn one(headings: &[Heading], wish: &Wish<'_>, quantity: Quantity) -> Result<Option<Used>> {
    let request = wish.request(quantity);
    let used = match request {
        // The user says that there is none.
        Some(request) if request.name == NONE && !headings.iter().any(|h| h.name == NONE) => None,
        Some(request) => Some(requested(headings, request)?),
        None => recognized(headings, wish.requests, quantity)?,
    };
    if let Some(used) = used.as_ref().filter(|_| !request.is_some_and(|request| request.name.starts_with('#'))) {
        headed_twice(headings, used.at, quantity)?;
    }
    Ok(used)
}

/// Whether another column has the same heading.
fn headed_twice(headings: &[Heading], at: usize, quantity: Quantity) -> Result<()> {
    let same = |(other, heading): &(usize, &Heading)| *other != at && heading.name == headings[at].name;
    let Some((other, _)) = headings.iter().enumerate().find(same) else { return Ok(()) };
    let (first, second, name) = (at.min(other) + 1, at.max(other) + 1, quoted(&headings[at].name));
    let message = format!("columns {first} and {second} are both headed {name}");
    Err(Error::data(message, text!("Say which by its number: " [Columns = "{}=#{first}", quantity.key()] ".")))
}

/// The quantities that are not there, by their canonical headings. A current drives a speed where there is no voltage,
/// unless some column looks like one.
fn missing(has: &dyn Fn(Quantity) -> bool, need: Need, drives: bool, timed: bool) -> Vec<&'static str> {
    let moves = has(Quantity::Speed) || has(Quantity::Position);
    let output = || has(Quantity::Current) || moves;
    let mut missing = Vec::new();
    if !has(Quantity::Time) && !timed {
        missing.push("time_s");
    }
    if !has(Quantity::Voltage) && need != Need::Part {
        match (need == Need::Recording && !drives, has(Quantity::Current), moves) {
            (true, true, true) => {}
            (true, true, false) => missing.push("voltage_V or speed_rad_s"),
            (true, false, true) => missing.push("voltage_V or current_A"),
            _ => missing.push("voltage_V"),
        }
    }
    if need == Need::Recording && !output() {
        missing.push("current_A or speed_rad_s");
    }
    if need == Need::Part && !(output() || has(Quantity::Voltage) || has(Quantity::Torque)) {
        missing.push("voltage_V, current_A or speed_rad_s");
    }
    missing
}

fn lacking(headings: &[Heading], missing: &[&str]) -> Error {
    if headings.iter().all(|h| parse_number(&h.name, true).is_ok()) {
        let hint = text!(
            "Put a heading in front of the rows, or name columns by their numbers: "
            [Columns = "time=1:s,voltage=2:V,current=3:A,speed=4:rad/s"] "; without a time column give " [Rate = "HZ"] "."
        );
        return Error::data("found numbers, expected a heading", hint);
    }
    let mut hint = text!(
        "Rename the headings (time_s,voltage_V,current_A,speed_rad_s) or name them: "
        [Columns = "time=HEADING:UNIT,voltage=HEADING:UNIT,current=HEADING:UNIT,speed=HEADING:UNIT"] "."
    );
    if missing.contains(&"time_s") {
        hint.push(text!(" Without a time column give " [Rate = "HZ"] "."));
    }
    let drive = headings.iter().find(|heading| is_drive(heading));
    if let Some(heading) = drive.filter(|_| missing.iter().any(|m| m.starts_with("voltage_V"))) {
        let name = printable(&heading.name);
        hint.push(text!(
            " Duty or PWM ticks become volts by operations (" [Columns = "voltage={name}*12/255:V"] "), a flag by its \
             two voltages (" [Columns = "voltage={name}:0..12"] ")."
        ));
        if missing == ["voltage_V"] {
            hint.push(text!(" If it drives nothing, say so: " [Columns = "voltage=-"] "."));
        }
    } else if missing.contains(&"voltage_V or speed_rad_s") {
        hint.push(" A current alone tells nothing: with a voltage it gives R and L, with a speed the mechanical side.");
    } else if missing.contains(&"voltage_V or current_A") {
        hint.push(" A speed alone tells nothing: what drives it must be there.");
    }
    Error::data(format!("no column for {}; the heading has {}", missing.join(" and "), listed(headings)), hint)
}

fn listed(headings: &[Heading]) -> String {
    headings.iter().map(|heading| quoted(&heading.name)).collect::<Vec<_>>().join(", ")
}

/// Whether a heading looks like what drives a motor: by a word, or by a unit of volts.
fn is_drive(heading: &Heading) -> bool {
    const WORDS: [&str; 8] = ["pwm", "duty", "throttle", "command", "degrau", "step", "flag", "volt"];
    let name = heading.name.to_lowercase();
    let in_volts = |name: &str| {
        let name = name.trim_end_matches([')', ']']);
        let stands_apart = |rest: &str| rest.ends_with(['_', '[', '(', ' ']);
        ["v", "mv", "kv"].into_iter().any(|unit| name.strip_suffix(unit).is_some_and(stands_apart))
    };
    let unit = heading.unit.as_ref().map(|unit| format!("[{}", unit.to_lowercase()));
    WORDS.iter().any(|word| name.contains(word)) || in_volts(&name) || unit.is_some_and(|unit| in_volts(&unit))
}

/// Where the column of a request stands, and what is said of it: behind the longest heading that the request begins
/// with, or behind its number.
fn place(headings: &[Heading], name: &str) -> Option<(usize, Suffix)> {
    let mut order: Vec<usize> = (0..headings.len()).filter(|&n| !headings[n].name.is_empty()).collect();
    order.sort_by_key(|&n| std::cmp::Reverse(headings[n].name.len()));
    let behind = |at: usize| suffix(name.strip_prefix(headings[at].name.as_str())?);
    order.into_iter().find_map(|at| Some((at, behind(at)?))).or_else(|| {
        let text = name.strip_prefix('#')?;
        let digits = text.bytes().take_while(u8::is_ascii_digit).count();
        let at = text[..digits].parse::<usize>().ok()?.checked_sub(1).filter(|&at| at < headings.len())?;
        Some((at, suffix(&text[digits..])?))
    })
}

fn requested(headings: &[Heading], request: &ColumnRequest) -> Result<Used> {
    let quantity = request.quantity;
    let Some((at, Suffix { formula, unit })) = place(headings, &request.name) else {
        let (name, found) = (quoted(&request.name), listed(headings));
        let hint = text!(
            "Give " [Columns] " the exact heading, capitals included, or its number as #2; behind it may stand \
             operations (*12/255, +0.5), a unit (:mA), or a flag's two voltages (:0..12)."
        );
        return Err(Error::data(format!("no column {name} for {quantity}; the heading has {found}"), hint));
    };
    let own = || headings[at].understood().filter(|(q, _)| *q == quantity).and_then(|(_, unit)| unit);
    // Operations make volts of a flag or a duty, whatever the heading says of the cells.
    let unit =
        unit.or_else(|| if formula == Formula::AS_IT_IS { headings[at].unit.clone().or_else(own) } else { None });
    column(quantity, at, &headings[at].name, formula, unit)
}

fn recognized(headings: &[Heading], requests: &[ColumnRequest], quantity: Quantity) -> Result<Option<Used>> {
    let taken: Vec<usize> = requests.iter().filter_map(|r| place(headings, &r.name)).map(|(at, ..)| at).collect();
    let free = || headings.iter().enumerate().filter(|(at, _)| !taken.contains(at));
    if let Some((at, heading)) = free().find(|(_, h)| h.name == quantity.canonical() && h.unit.is_none()) {
        let unit = heading.understood().and_then(|(_, unit)| unit);
        return column(quantity, at, &heading.name, Formula::AS_IT_IS, unit).map(Some);
    }
    let mut matches = free().filter_map(|(at, heading)| {
        let (found, unit) = heading.understood()?;
        (found == quantity).then_some((at, heading.name.as_str(), unit))
    });
    let Some((at, heading, unit)) = matches.next() else { return Ok(None) };
    if let Some((own, below)) = headings[at].contradiction() {
        let message = format!("{} names the unit {own}, the row below it {below}", quoted(heading));
        let hint = text!("Say which: " [Columns = "{}={}:{below}", quantity.key(), printable(heading)] ".");
        return Err(Error::data(message, hint));
    }
    if let Some((_, other, _)) = matches.next() {
        headed_twice(headings, at, quantity)?;
        let message = format!("both {} and {} look like {quantity}", quoted(heading), quoted(other));
        let hint = text!("Say which: " [Columns = "{}={}", quantity.key(), printable(heading)] ".");
        return Err(Error::data(message, hint));
    }
    column(quantity, at, heading, Formula::AS_IT_IS, unit).map(Some)
}

fn column(quantity: Quantity, at: usize, heading: &str, formula: Formula, unit: Option<String>) -> Result<Used> {
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
