//! Settings of the page: a JSON object with the names of the settings table.

use motorfit::report::command_line;
use motorfit::setting::{Reference, Setting};
use motorfit::settings::{Given, Kind, PROBLEM, READING, Row, SEARCH, Value, row};
use motorfit::{Error, Result};
use serde_json::Value as Json;

/// The settings of the page.
pub struct Settings {
    /// Their values.
    pub given: Given,
    /// The flags of the program that say the same, each with its setting.
    pub flags: Vec<(Setting, String)>,
}

impl Settings {
    /// Returns the settings of a JSON object; empty texts and lists are left out.
    ///
    /// # Errors
    /// Returns `Usage` if the text is no JSON object, a name is no setting, or a value has another type than the table says.
    pub fn of(text: &str) -> Result<Self> {
        let no_object = || Error::usage("the settings are no JSON object", "Give an object with names of settings.");
        let Ok(Json::Object(object)) = serde_json::from_str(text) else { return Err(no_object()) };
        let rows = rows();
        let mut settings = Self { given: Given::default(), flags: Vec::new() };
        for (name, value) in object {
            let Some(row) = rows.iter().find(|row| row.setting.name() == name) else {
                return Err(Error::usage(format!("\"{name}\" is no setting"), "Use the names of the reference."));
            };
            if let Some(value) = converted(row, &value)? {
                settings.flags.extend(flags(row.setting, &value).into_iter().map(|flag| (row.setting, flag)));
                settings.given.put(row.setting, value);
            }
        }
        Ok(settings)
    }
}

/// Returns the settings that a page has. Its device is the browser's.
pub fn rows() -> Vec<Row> {
    [&READING[..], &PROBLEM, &SEARCH].concat().into_iter().filter_map(row).collect()
}

fn flags(setting: Setting, value: &Value) -> Vec<String> {
    let one = |value: String| command_line(&Reference::Setting(setting, Some(value)));
    match value {
        Value::Switch(on) => on.then(|| command_line(&Reference::Setting(setting, None))).into_iter().collect(),
        Value::Number(number) => vec![one(number.to_string())],
        Value::Count(count) => vec![one(count.to_string())],
        Value::Text(text) => vec![one(text.clone())],
        Value::List(list) if setting == Setting::Mask || setting == Setting::Set => {
            list.iter().cloned().map(one).collect()
        }
        Value::List(list) => vec![one(list.join(","))],
    }
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
