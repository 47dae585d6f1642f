//! Answers to the page as JSON texts.

use motorfit::report::command_line;
use motorfit::{Error, Result};
use serde_json::{Value, json};

/// The results of a command.
pub struct Answer {
    /// Document of the program with `--json`.
    pub document: Value,
    /// The report as HTML.
    pub report: String,
}

/// Returns the results of `work` as JSON with `document` and `report`, or its error as `error`.
pub fn answered(work: impl FnOnce() -> Result<Answer>) -> String {
    match work() {
        Ok(Answer { document, report }) => json!({ "document": document, "report": report }),
        Err(error) => json!({ "error": described(&error) }),
    }
    .to_string()
}

fn described(error: &Error) -> Value {
    json!({
        "message": error.message().spelled(command_line),
        "hint": error.hint().spelled(command_line),
        "path": error.path().map(|path| path.display().to_string()),
        "part": error.part(),
        "line": error.line(),
        "column": error.column(),
    })
}
