//! JSON files with a recording as a list of objects, one for each sample: `[{"t": 0, "u": 5}, …]`, or one object per line, or
//! a list as a member of an object whose other numbers are constants: `{"mass": 0.49, "entries": [{…}, …]}`.

use super::cells::{Cells, number};
use motorfit_core::setting::text;
use motorfit_core::text::{counted, quoted};
use motorfit_core::{Error, Result};
use serde_json::{Map, Value};

const AS_CSV: &str = "Save the recording as CSV with a heading such as time_s,voltage_V,current_A,speed_rad_s.";
/// Largest number of names that a note or a message lists.
const NAMED_MAX: usize = 5;

/// Reads the objects of a list as the rows of a table. Their members are its columns, in the order in which they first appear.
///
/// `true` is read as 1 and `false` as 0. A member that an object lacks is an empty cell. Objects are counted from 1. `name`
/// selects one of several lists. Numbers beside the list are constants.
///
/// # Errors
/// Returns a `Data` error if the file is not JSON, or has no such list, or several and no valid `name`.
pub fn records(bytes: &[u8], name: Option<&str>) -> Result<Vec<Cells>> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let values = serde_json::Deserializer::from_slice(bytes).into_iter::<Value>();
    let mut values: Vec<Value> = values.collect::<std::result::Result<_, _>>().map_err(|error| {
        let hint = "Check that the file is complete; expected is a list of objects with numbers.";
        Error::data(format!("is not readable JSON: {error}"), hint)
    })?;
    match (values.pop(), values.is_empty()) {
        (Some(Value::Array(list)), true) if is_table(&list) => Ok(vec![table(&list, &Map::new())]),
        (Some(Value::Object(file)), true) => in_object(file, name),
        // One object per line.
        (Some(last), false) if last.is_object() && is_table(&values) => {
            values.push(last);
            Ok(vec![table(&values, &Map::new())])
        }
        _ => Err(none("a list of objects with numbers, one for each sample")),
    }
}

/// Returns the error for JSON without a recording.
fn none(expected: &str) -> Error {
    Error::data(format!("is JSON, but holds no recording: expected {expected}, or the tests of SysId"), AS_CSV)
}

/// Returns true if a list consists of objects.
fn is_table(list: &[Value]) -> bool {
    !list.is_empty() && list.iter().all(Value::is_object)
}

/// Reads the list in an object, and the numbers beside it as constants.
fn in_object(file: Map<String, Value>, name: Option<&str>) -> Result<Vec<Cells>> {
    let is_list = |value: &Value| value.as_array().is_some_and(|list| is_table(list));
    let lists: Vec<String> = file.iter().filter(|(_, value)| is_list(value)).map(|(key, _)| key.clone()).collect();
    let chosen = match (name, &lists[..]) {
        (Some(name), _) if lists.iter().any(|list| list == name) => name.to_owned(),
        (Some(name), _) if !lists.is_empty() => {
            let message = format!("no list {}; the file has {}", quoted(name), shown(&lists));
            return Err(Error::data(message, text!("Choose one of them: " [Sheet = "{}", lists[0]] ".")));
        }
        (None, [list]) => list.clone(),
        (None, [first, _, ..]) => {
            let message = format!("holds {} lists of objects: {}", lists.len(), shown(&lists));
            return Err(Error::data(message, text!("Choose one: " [Sheet = "{first}"] ".")));
        }
        _ => return Err(none("a member that is a list of objects with numbers, one for each sample")),
    };
    let list = file.get(&chosen).and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    let others =
        file.iter().filter(|(_, value)| scalar(value).is_some()).map(|(key, value)| (key.clone(), value.clone()));
    Ok(vec![table(list, &others.collect())])
}

/// Returns the first names of a list in quotation marks.
fn shown(names: &[String]) -> String {
    let shown: Vec<String> = names.iter().take(NAMED_MAX).map(|name| quoted(name)).collect();
    let more = if names.len() > NAMED_MAX { ", …" } else { "" };
    shown.join(", ") + more
}

/// Returns a number, or a Boolean as 1 or 0.
fn scalar(value: &Value) -> Option<f64> {
    match value {
        Value::Number(number) => number.as_f64(),
        Value::Bool(on) => Some(if *on { 1.0 } else { 0.0 }),
        _ => None,
    }
}

/// Returns the text of a cell; `None` for a list or an object.
fn cell(value: &Value) -> Option<String> {
    match value {
        Value::Null => Some(String::new()),
        Value::String(text) => Some(text.clone()),
        Value::Array(_) | Value::Object(_) => None,
        value => scalar(value).map(number),
    }
}

/// Returns the objects of a list as a table, with the numbers in `beside` as constants.
fn table(list: &[Value], beside: &Map<String, Value>) -> Cells {
    let objects = || list.iter().filter_map(Value::as_object);
    let mut headings: Map<String, Value> = Map::new();
    for (key, value) in objects().flatten() {
        if cell(value).is_some() && !key.is_empty() && !headings.contains_key(key) {
            headings.insert(key.clone(), Value::Null);
        }
    }
    let headings: Vec<String> = headings.into_iter().map(|(key, _)| key).collect();
    let row = |object: &Map<String, Value>| {
        headings.iter().map(|key| object.get(key).and_then(cell).unwrap_or_default()).collect()
    };
    let mut rows: Vec<(u64, Vec<String>)> = vec![(0, headings.clone())];
    rows.extend((1..).zip(objects().map(row)));
    let mut notes = Vec::new();
    let constants: Vec<(String, f64)> =
        beside.iter().filter_map(|(key, value)| Some((key.clone(), scalar(value)?))).collect();
    if !constants.is_empty() {
        let shown: Vec<String> = constants.iter().map(|(key, value)| format!("{key} = {}", number(*value))).collect();
        notes.push(format!("constants: {}", shown.join(", ")));
    }
    let mut unused: Vec<String> = Vec::new();
    for (key, value) in objects().flatten() {
        if cell(value).is_none() && !unused.contains(key) && unused.len() <= NAMED_MAX {
            unused.push(key.clone());
        }
    }
    if !unused.is_empty() {
        let what = counted(unused.len(), "member");
        notes.push(format!("{what} of the objects not used, because they are lists or objects: {}", shown(&unused)));
    }
    Cells { name: String::new(), rows, notes, constants }
}
