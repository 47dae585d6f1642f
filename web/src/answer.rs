//! Answers to the page as JSON texts.

use crate::given::rows;
use crate::spelling::{as_json, in_page};
use motorfit::report::error_document;
use motorfit::setting::{Reference, Text};
use motorfit::{Error, ErrorKind, Result};
use serde_json::{Value, json};

/// Sign around a reference in a text that is searched for references.
const MARK: char = '\u{1}';

/// Returns the answer of `work` as JSON, or its error.
pub fn answered(work: impl FnOnce() -> Result<Value>) -> String {
    work().map_or_else(|error| described(&error), |answer| answer.to_string())
}

/// Returns an error as JSON, with the setting that its hint proposes for a recording. Hints about settings give examples instead.
pub fn described(error: &Error) -> String {
    let mut document = error_document(error, in_page);
    if error.kind() != ErrorKind::Usage {
        document["proposal"] = proposal(error.hint()).unwrap_or_default();
    }
    json!({ "error": document }).to_string()
}

/// Words in place of values that only the reader knows.
const PLACES: [&str; 7] = ["HEADING", "UNIT", "HZ", "VALUE", "MIN", "SIGMA", "…"];

/// Returns the first setting of a hint that the page has, with a value that can be used as it is.
fn proposal(hint: &Text) -> Option<Value> {
    let marked = |reference: &Reference| format!("{MARK}{}{MARK}", as_json(reference));
    let text = hint.spelled(marked);
    let references = text.split(MARK).skip(1).step_by(2).filter_map(|json| serde_json::from_str::<Value>(json).ok());
    let is_whole = |reference: &Value| {
        let is_of_page = rows().iter().any(|row| reference["setting"] == row.setting.name());
        let value = reference["value"].as_str();
        is_of_page && value.is_some_and(|value| !PLACES.iter().any(|place| value.contains(place)))
    };
    references.into_iter().find(is_whole)
}
