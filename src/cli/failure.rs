//! Errors as JSON documents, and the exit codes of all outcomes: one table for the program, its help and the reference.

use super::outcome::Outcome;
use motorfit::file::with_similar_name;
use motorfit::report::{command_line, error_document, json};
use motorfit::{Error, ErrorKind};
use serde_json::{Value, json as value};

/// Exit codes with their meanings.
pub(super) const EXIT_CODES: [(&str, &str); 7] = [
    ("0", "done"),
    ("2", "wrong usage"),
    ("3", "bad data, or a file that cannot be written"),
    ("4", "not identified; some runs of a sweep failed; with --strict, a result that is not good"),
    ("5", "the device is not available"),
    ("6", "with --strict-limits, motors outside the limits"),
    ("129, 130, 143", "ended by SIGHUP, Ctrl-C, SIGTERM; the best so far is printed and finished runs are kept"),
];

/// Returns the exit codes as text for the help.
pub(super) fn exit_codes() -> String {
    let lines = EXIT_CODES.iter().map(|(code, meaning)| format!("\n  {code:<13}  {meaning}"));
    format!("Exit codes:{}", lines.collect::<String>())
}

/// Returns the exit code of an outcome that is no error.
pub(super) fn code_of(outcome: &Outcome) -> u8 {
    match outcome {
        Outcome::Done => 0,
        Outcome::Interrupted => super::signals::exit_code(),
        Outcome::Incomplete | Outcome::Untrusted => 4,
        Outcome::OutsideLimits => 6,
    }
}

/// Returns the exit code of an error.
pub(super) fn code_of_error(error: &Error) -> u8 {
    match error.kind() {
        ErrorKind::Usage => 2,
        ErrorKind::NotIdentified => 4,
        ErrorKind::Device => 5,
        _ => 3,
    }
}

/// Returns the JSON document of an error, beside what was found before it.
pub(super) fn document(error: &Error, found: &[(&str, Value)]) -> String {
    let error = with_similar_name(error.clone());
    let mut described = error_document(&error, command_line);
    described["exit_code"] = code_of_error(&error).into();
    let mut whole = value!({ "motorfit": env!("CARGO_PKG_VERSION"), "error": described });
    for (key, of) in found {
        whole[*key] = of.clone();
    }
    json(&whole)
}

#[cfg(test)]
mod tests {
    use super::EXIT_CODES;

    #[test]
    fn the_documents_have_the_table_of_exit_codes() {
        let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/trust.md")).unwrap();
        let rows = text.lines().skip_while(|line| *line != "## Exit codes").filter(|line| line.starts_with("| "));
        let written: Vec<String> = rows.skip(1).map(|row| row.replace('`', "")).collect();
        assert_eq!(written, EXIT_CODES.map(|(code, meaning)| format!("| {code} | {meaning} |")));
    }
}
