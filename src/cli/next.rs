//! The recommended next command for a result whose level of trust is not good, complete and quoted for a shell.

use motorfit::record::joined_columns;
use motorfit::report::command_line;
use motorfit::setting::{Reference, Text};
use motorfit::settings::{Kind, READING, row};
use motorfit::text::shell_quoted;
use std::path::PathBuf;

/// Returns the next command: this one with another setting, or an inspection of its recordings. A step that is no command is returned as
/// it is.
pub(super) fn command(next: &Text, records: &[PathBuf]) -> String {
    let step = next.spelled(unquoted);
    if !step.starts_with("--") && !step.starts_with("motorfit ") {
        return next.spelled(command_line);
    }
    let given: Vec<String> = std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned()).collect();
    next_command(&given, &step, records)
}

/// Spells a setting as a flag whose value is not quoted yet.
fn unquoted(reference: &Reference) -> String {
    match reference {
        Reference::Setting(setting, Some(value)) => {
            format!("{} {value}", command_line(&Reference::Setting(*setting, None)))
        }
        other => command_line(other),
    }
}

fn next_command(given: &[String], step: &str, records: &[PathBuf]) -> String {
    let words: Vec<String> = match step.strip_prefix("motorfit ") {
        Some(operation) => {
            let paths = records.iter().map(|path| path.to_string_lossy().into_owned());
            std::iter::once(operation.to_owned()).chain(paths).chain(reading(given)).collect()
        }
        None => {
            let (flag, value) = step.split_once(' ').unwrap_or((step, ""));
            let value = match value_of(given, flag).filter(|_| flag == COLUMNS) {
                Some(given) => joined_columns(&given, value),
                None => value.to_owned(),
            };
            let value = Some(value).filter(|value| !value.is_empty());
            without(given, flag).into_iter().chain([flag.to_owned()]).chain(value).collect()
        }
    };
    let words = words.iter().map(|word| shell_quoted(word));
    std::iter::once("motorfit".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}

/// Flag whose value consists of items that a step adds to.
const COLUMNS: &str = "--columns";

/// Returns the value of a flag among the words of a command.
fn value_of(given: &[String], flag: &str) -> Option<String> {
    let own = given.iter().find_map(|word| word.strip_prefix(flag)?.strip_prefix('=').map(str::to_owned));
    own.or_else(|| given.windows(2).find(|pair| pair[0] == flag).map(|pair| pair[1].clone()))
}

/// Returns the words of a command without a flag and its value.
fn without(given: &[String], flag: &str) -> Vec<String> {
    let mut words = Vec::new();
    let mut rest = given.iter();
    while let Some(word) = rest.next() {
        if word == flag {
            rest.next();
        } else if word.strip_prefix(flag).is_none_or(|rest| !rest.starts_with('=')) {
            words.push(word.clone());
        }
    }
    words
}

/// Returns the flags for reading recordings among the words of a command, with their values.
fn reading(given: &[String]) -> Vec<String> {
    let mut words = Vec::new();
    let mut rest = given.iter();
    while let Some(word) = rest.next() {
        let name = word.split('=').next().unwrap_or(word);
        let is_named =
            |setting: &&motorfit::setting::Setting| name == format!("--{}", setting.name().replace('_', "-"));
        let Some(setting) = READING.iter().find(is_named) else { continue };
        words.push(word.clone());
        let is_switch = row(*setting).is_some_and(|row| matches!(row.kind, Kind::Switch));
        if !is_switch && !word.contains('=') {
            words.extend(rest.next().cloned());
        }
    }
    words
}

#[cfg(test)]
mod tests {
    use super::next_command;
    use std::path::PathBuf;

    #[test]
    fn a_next_command_is_complete_and_quoted() {
        let words = |text: &[&str]| text.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>();
        let given = words(&["identify", "my log.csv", "--with", "coulomb", "--columns=time=t:ms", "--json"]);
        let records = [PathBuf::from("my log.csv")];
        let again = next_command(&given, "--with auto", &records);
        assert_eq!(again, "motorfit identify 'my log.csv' --columns=time=t:ms --json --with auto");
        let inspect = next_command(&given, "motorfit inspect", &records);
        assert_eq!(inspect, "motorfit inspect 'my log.csv' --columns=time=t:ms");
        let named = next_command(&given, "--columns speed=w:rpm,time=t:us", &records);
        assert_eq!(named, "motorfit identify 'my log.csv' --with coulomb --json --columns speed=w:rpm,time=t:us");
        let given = words(&["identify", "a.csv", "--columns", "voltage=a*12/255:V,speed=w"]);
        let named = next_command(&given, "--columns speed=w:rpm", &records);
        assert_eq!(named, "motorfit identify a.csv --columns 'voltage=a*12/255:V,speed=w:rpm'");
        let given = words(&["identify", "a.csv", "--with=load", "--mask", "auto"]);
        assert_eq!(next_command(&given, "--with auto", &records), "motorfit identify a.csv --mask auto --with auto");
    }
}
