//! Requests of users for columns: a quantity, or a signal of a model, by its heading with operations and a unit.

use super::heading::Quantity;
use motorfit_core::setting::text;
use motorfit_core::text::quoted;
use motorfit_core::{Error, Result};

/// A column named by the user: quantity, heading and unit.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnRequest {
    /// Quantity of the column.
    pub quantity: Quantity,
    /// `HEADING[*NUMBER…][:UNIT]` or `HEADING:LOW..HIGH`, as given.
    pub name: String,
}

/// Largest length of a request for columns \[bytes\].
pub(super) const REQUEST_MAX: usize = 4096;

/// Parses a request for columns like [`parse_columns`], with the names of the signals of a model as further quantities.
///
/// # Errors
/// Returns `Usage` in the cases of [`parse_columns`].
pub fn parse_signal_columns(text: &str, signals: &[&str]) -> Result<Vec<ColumnRequest>> {
    parse_requests(text, signals)
}

/// Parses a request for columns, as in `time=Tempo:s,current=Corrente:mA,…`.
///
/// Operations and units after a heading are parsed later, against the headings of the file.
///
/// # Errors
/// Returns `Usage` if an item has no `=`, an empty heading or an unknown quantity, if a quantity is repeated, or if the request
/// exceeds 4096 bytes.
pub fn parse_columns(text: &str) -> Result<Vec<ColumnRequest>> {
    parse_requests(text, &[])
}

/// Returns a request for columns in which items of `more` replace those of `given` with the same key.
#[must_use]
pub fn joined_columns(given: &str, more: &str) -> String {
    let key = |item: &str| item.split('=').next().unwrap_or(item).trim().to_owned();
    let (given, more) = (items(given, &[]), items(more, &[]));
    let is_kept = |item: &&&str| !more.iter().any(|other| key(other) == key(item));
    let kept: Vec<&str> = given.iter().filter(is_kept).chain(&more).copied().collect();
    kept.join(",")
}

/// Returns the quantity with a key: a signal of a model by its name, or a known quantity.
fn keyed(key: &str, signals: &[&str]) -> Option<Quantity> {
    let signal = signals.iter().position(|name| *name == key).and_then(|n| u8::try_from(n).ok());
    signal.map(Quantity::Signal).or_else(|| Quantity::COLUMNS.into_iter().find(|quantity| quantity.key() == key))
}

fn parse_requests(text: &str, signals: &[&str]) -> Result<Vec<ColumnRequest>> {
    let example = || {
        text!(
            "Write " [Columns = "time=Tempo:s,voltage=Tensao:V,current=Corrente:mA,speed=Velocidade:rad/s"]
            ", or columns by their numbers: " [Columns = "time=#1:s,voltage=#2:V"] "."
        )
    };
    if text.len() > REQUEST_MAX {
        let found = text.len();
        let message = text!([Columns] ": found {found} bytes, expected at most {REQUEST_MAX}");
        return Err(Error::usage(message, example()));
    }
    let mut requests: Vec<ColumnRequest> = Vec::new();
    for item in items(text, signals).into_iter().filter(|item| !item.trim().is_empty()) {
        let Some((key, name)) = item.split_once('=').filter(|(_, name)| !name.trim().is_empty()) else {
            return Err(Error::usage(format!("{} names no column", quoted(item)), example()));
        };
        let Some(quantity) = keyed(key.trim(), signals) else {
            let message = format!("{} is not a quantity of a recording", quoted(key.trim()));
            let hint = match signals {
                [] => example(),
                _ => format!("The signals of the model are {}; beside them there is time.", signals.join(", ")).into(),
            };
            return Err(Error::usage(message, hint));
        };
        if requests.iter().any(|r| r.quantity == quantity) {
            return Err(Error::usage(text!([Columns] " names {quantity} twice"), "Name each quantity once."));
        }
        requests.push(ColumnRequest { quantity, name: name.trim().to_owned() });
    }
    Ok(requests)
}

/// Splits a list at its commas, except those in quotation marks and those in brackets that no `KEY=` follows.
fn items<'a>(text: &'a str, signals: &[&str]) -> Vec<&'a str> {
    let mut items: Vec<&str> = Vec::new();
    let (mut start, mut from) = (0, 0);
    while let Some(at) = comma(text, start, from) {
        let item = &text[start..at];
        let is_open = ['(', '['].iter().any(|open| item.contains(*open))
            && item.matches(['(', '[']).count() > item.matches([')', ']']).count();
        let key = text[at + 1..].split(['=', ',']).next().unwrap_or_default().trim();
        if is_open && keyed(key, signals).is_none() {
            from = at + 1;
            continue;
        }
        items.push(item);
        (start, from) = (at + 1, at + 1);
    }
    items.push(&text[start..]);
    items
}

/// Returns the first comma from `from` on outside quotation marks. Marks open only where a name may begin and must be closed.
fn comma(text: &str, start: usize, from: usize) -> Option<usize> {
    let mut end_of_marks = start;
    for (at, c) in text[start..].char_indices().map(|(at, c)| (start + at, c)) {
        let before = || text[start..at].trim_end().chars().next_back();
        if at < end_of_marks {
            continue;
        } else if c == '"' && before().is_some_and(|c| "=+-*/^(".contains(c)) {
            end_of_marks = text[at + 1..].find('"').map_or(end_of_marks, |length| at + length + 2);
        } else if c == ',' && at >= from {
            return Some(at);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commas_in_names_end_no_item() {
        for (text, expected) in [
            ("time=a,voltage=b", &["time=a", "voltage=b"][..]),
            ("time=\"a,b\":s,voltage=2*\"c, d\"", &["time=\"a,b\":s", "voltage=2*\"c, d\""]),
            ("current=data(:,2):A,time=t", &["current=data(:,2):A", "time=t"]),
            ("current=I (mA,time=t", &["current=I (mA", "time=t"]),
            ("speed=12\" wheel:rpm,time=t \"x", &["speed=12\" wheel:rpm", "time=t \"x"]),
            ("speed=\"open,time=t", &["speed=\"open", "time=t"]),
            ("", &[""]),
        ] {
            assert_eq!(items(text, &[]), expected, "{text}");
        }
    }
}
