//! Settings of the page: a JSON object with the names of the settings table.

use motorfit::setting::Setting;
use motorfit::settings::{DEVICE, Given, Kind, PROBLEM, READING, Row, SEARCH, Value, row};
use motorfit::{Error, Result};
use serde_json::Value as Json;

/// Returns the settings of a JSON object; empty texts and lists are left out.
///
/// # Errors
/// Returns `Usage` if the text is no JSON object, a name is no setting, or a value has another type than the table says.
pub fn of(settings: &str) -> Result<Given> {
    let no_object = || Error::usage("the settings are no JSON object", "Give an object with names of settings.");
    let Ok(Json::Object(object)) = serde_json::from_str(settings) else { return Err(no_object()) };
    let rows: Vec<Row> = [&READING[..], &SEARCH, &PROBLEM, &DEVICE].concat().into_iter().filter_map(row).collect();
    let mut given = Given::default();
    for (name, value) in object {
        let Some(row) = rows.iter().find(|row| row.setting.name() == name) else {
            return Err(Error::usage(format!("\"{name}\" is no setting"), "Use the names of the reference."));
        };
        if let Some(value) = converted(row, &value)? {
            given.put(row.setting, value);
        }
    }
    Ok(given)
}

fn converted(row: &Row, value: &Json) -> Result<Option<Value>> {
    let found = match (&row.kind, value) {
        (_, Json::Null) => return Ok(None),
        (Kind::Switch, Json::Bool(on)) => Some(Value::Switch(*on)),
        (Kind::Number, Json::Number(number)) => number.as_f64().map(Value::Number),
        (Kind::Count, Json::Number(number)) => number.as_u64().map(Value::Count),
        (Kind::Choice(_) | Kind::Word, Json::String(text)) => {
            return Ok((!text.is_empty()).then(|| Value::Text(text.clone())));
        }
        (Kind::List, Json::Array(items)) => {
            let items: Option<Vec<String>> = items.iter().map(|item| Some(item.as_str()?.to_owned())).collect();
            items.map(Value::List)
        }
        _ => None,
    };
    match found {
        Some(Value::List(list)) if list.is_empty() => Ok(None),
        Some(value) => Ok(Some(value)),
        None => Err(wrong(row.setting, value)),
    }
}

fn wrong(setting: Setting, value: &Json) -> Error {
    Error::usage(format!("{}: {value} is no value of it", setting.name()), "Give a value as in the reference.")
}
