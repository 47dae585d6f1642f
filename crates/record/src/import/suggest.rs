//! Suggestion of a request for columns from the headings and the first rows of a table, for the user to check.

use super::columns::choose;
use super::headings::Heading;
use super::lacking::is_drive;
use super::request::name_of;
use super::spec::TableSpec;
use crate::heading::Quantity;
use crate::requests::parse_columns;

/// Number of rows from which units are guessed.
pub(super) const ROWS: usize = 3000;
/// Placeholder for the supply voltage \[V\] in a suggested voltage, for the user to replace.
const SUPPLY: &str = "12";
/// Placeholder for the counts per turn in a suggested position, for the user to replace.
const COUNTS: &str = "4096";

/// A suggested request and the guesses in it.
pub(super) struct Suggestion {
    pub request: String,
    /// Placeholders in the request with their replacements, such as `12 by the supply in volts`.
    pub replaced: Vec<String>,
    /// Keys of the quantities whose unit is guessed.
    pub guessed: Vec<&'static str>,
}

/// Returns a request by which a table can be read; `None` if the headings do not suffice. `rows` are the cells of the first
/// rows as numbers.
pub(super) fn suggestion(headings: &[Heading], spec: &TableSpec<'_>, rows: &[Vec<Option<f64>>]) -> Option<Suggestion> {
    let mut items: Vec<String> =
        spec.requests.iter().map(|request| format!("{}={}", request.quantity.key(), request.name)).collect();
    let mut taken: Vec<usize> = Vec::new();
    let mut suggestion = Suggestion { request: String::new(), replaced: Vec::new(), guessed: Vec::new() };
    for quantity in [Quantity::Time, Quantity::Voltage, Quantity::Speed, Quantity::Current, Quantity::Position] {
        let has_speed = items.iter().any(|item| item.starts_with("speed="));
        if spec.request(quantity).is_some() || quantity == Quantity::Position && has_speed {
            continue;
        }
        let free = (0..headings.len()).filter(|at| !taken.contains(at) && !headings[*at].name.is_empty());
        let found = free.filter_map(|at| Some((at, guess(quantity, &headings[at], &column(rows, at))?)));
        let Some((at, guess)) = found.max_by_key(|(at, guess)| (guess.certainty, std::cmp::Reverse(*at))) else {
            continue;
        };
        taken.push(at);
        let twice = headings.iter().filter(|heading| heading.name == headings[at].name).count() > 1;
        let name = match twice || headings[at].name.contains('"') {
            true => format!("#{}", at + 1),
            false => name_of(&headings[at].name),
        };
        let is_known = headings[at].unit_of(quantity).is_some();
        let is_unit = guess.certainty < 2 && guess.replaced.is_empty() && !is_known;
        suggestion.replaced.extend(guess.replaced);
        suggestion.guessed.extend(is_unit.then_some(quantity.key()));
        items.push(format!("{}={}", quantity.key(), guess.form.replace("NAME", &name)));
    }
    suggestion.request = items.join(",");
    let requests = parse_columns(&suggestion.request).ok()?;
    choose(headings, &TableSpec { requests: &requests, ..*spec }).ok()?;
    Some(suggestion)
}

/// Returns the numbers of a column.
fn column(rows: &[Vec<Option<f64>>], at: usize) -> Vec<f64> {
    rows.iter().filter_map(|row| *row.get(at)?).collect()
}

/// A guessed request for a quantity in a column.
struct Guess {
    /// Request with `NAME` in place of the column.
    form: String,
    /// Placeholders in the request with their replacements.
    replaced: Vec<String>,
    /// 2 if the heading names the unit, 1 if it names the quantity only, 0 if it names neither.
    certainty: u8,
}

/// Returns the request for a quantity in a column, guessed from its heading and its values; `None` if the column does not
/// look like the quantity.
fn guess(quantity: Quantity, heading: &Heading, values: &[f64]) -> Option<Guess> {
    let name = heading.name.to_lowercase();
    let understood = heading.understood().filter(|(found, _)| *found == quantity);
    if let Some((_, Some(unit))) = &understood
        && quantity.factor(unit).is_some()
    {
        return Some(Guess { form: format!("NAME:{unit}"), replaced: Vec::new(), certainty: 2 });
    }
    // A column whose unit is known is taken in it, and never scaled.
    if let Some(unit) = heading.unit_of(quantity) {
        return Some(Guess { form: format!("NAME:{unit}"), replaced: Vec::new(), certainty: 1 });
    }
    if Quantity::COLUMNS.iter().any(|other| heading.unit_of(*other).is_some()) {
        return None;
    }
    let is_named = understood.is_some();
    let is_one_of = |words: &[&str]| name.split(|c: char| !c.is_alphanumeric()).any(|word| words.contains(&word));
    let guess = |form: &str, certainty: u8| Some(Guess { form: form.to_owned(), replaced: Vec::new(), certainty });
    let whole = values.iter().all(|value| value.fract() == 0.0);
    let peak = values.iter().fold(0.0, |peak: f64, value| peak.max(value.abs()));
    match quantity {
        Quantity::Time if is_one_of(&["millis", "ms", "msec"]) => guess("NAME:ms", 2),
        Quantity::Time if is_one_of(&["micros", "us", "usec"]) => guess("NAME:us", 2),
        Quantity::Time if is_named => guess(if whole { ticks(values) } else { "NAME:s" }, 1),
        Quantity::Time if is_one_of(&["dt", "delta", "interval"]) => {
            guess(if whole { "cumsum(NAME):ms" } else { "cumsum(NAME):s" }, 0)
        }
        Quantity::Voltage if is_one_of(&["degrau", "step", "flag"]) && has_two_values(values) => {
            let replaced = vec![format!("0 and {SUPPLY} by its two voltages")];
            Some(Guess { form: format!("NAME:0..{SUPPLY}"), replaced, certainty: 1 })
        }
        Quantity::Voltage if is_drive(heading) || is_one_of(DUTY) => {
            let full = full_scale(&name, peak);
            let supply = format!("{SUPPLY} by the supply in volts");
            let (form, replaced) = match full.as_str() {
                "1" => (format!("NAME*{SUPPLY}:V"), vec![supply]),
                _ => (
                    format!("NAME*{SUPPLY}/{full}:V"),
                    vec![supply, format!("{full} by the ticks of a full duty cycle")],
                ),
            };
            Some(Guess { form, replaced, certainty: 1 })
        }
        Quantity::Voltage if is_named => guess("NAME:V", 1),
        Quantity::Speed if is_one_of(&["rpm"]) => guess("NAME:rpm", 2),
        Quantity::Speed if is_named => guess(if whole { "NAME:rpm" } else { "NAME:rad/s" }, 1),
        Quantity::Current if is_one_of(&["ma"]) => guess("NAME:mA", 2),
        Quantity::Current if is_named => guess(if whole && peak > 20.0 { "NAME:mA" } else { "NAME:A" }, 1),
        Quantity::Position if is_named || is_one_of(&["encoder", "enc", "count", "counts", "pos", "ticks"]) => {
            let replaced = vec![format!("{COUNTS} by the counts per turn")];
            Some(Guess { form: format!("NAME/{COUNTS}:turns"), replaced, certainty: 1 })
        }
        _ => None,
    }
}

/// Further words for a duty cycle in headings.
const DUTY: &[&str] = &["ciclo", "tastgrad", "tastverhältnis", "rapport", "dutycycle", "throttle"];

/// Returns true if a column has exactly two values, like a flag.
fn has_two_values(values: &[f64]) -> bool {
    let mut distinct: Vec<f64> = Vec::new();
    for value in values {
        if !distinct.iter().any(|known| known.to_bits() == value.to_bits()) {
            distinct.push(*value);
        }
        if distinct.len() > 2 {
            return false;
        }
    }
    distinct.len() == 2
}

/// Returns the guessed request for integer times: microseconds if the median step exceeds 500, else milliseconds.
fn ticks(values: &[f64]) -> &'static str {
    let mut steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    let usual = if steps.is_empty() { 1.0 } else { motorfit_core::numeric::upper_median(&mut steps) };
    if usual > 500.0 { "NAME:us" } else { "NAME:ms" }
}

/// Returns the value of a full duty cycle: one in the heading, else the next common one not below `peak`, else `peak`.
fn full_scale(name: &str, peak: f64) -> String {
    const USUAL: [&str; 6] = ["1", "100", "255", "1023", "4095", "65535"];
    let in_name = name.split(|c: char| !c.is_ascii_digit()).find(|number| USUAL[2..].contains(number));
    if let Some(full) = in_name {
        return full.to_owned();
    }
    let is_percent = name.contains('%') || name.contains("percent");
    // PWM ticks are taken for 8 bits unless the values exceed 255.
    let from = if peak <= 1.0 && peak > 0.0 {
        0
    } else if is_percent {
        1
    } else {
        2
    };
    let next = USUAL[from..USUAL.len() - 1].iter().find(|full| full.parse().is_ok_and(|full: f64| full >= peak));
    next.map_or_else(|| peak.to_string(), |full| (*full).to_owned())
}
