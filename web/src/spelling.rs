//! Spelling of settings and commands in the page, where a setting is a field of the form with the setting's name.

use motorfit::setting::{Command, Reference};
use serde_json::json;

/// Spells a reference by the names of the page's form.
pub fn in_page(reference: &Reference) -> String {
    match reference {
        Reference::Setting(setting, None) => format!("“{}”", setting.name()),
        Reference::Setting(setting, Some(value)) => format!("“{}” as {value}", setting.name()),
        Reference::Command(command) => match command {
            Command::Identify => "Identify".to_owned(),
            Command::Inspect => "Inspect".to_owned(),
            _ => "the program on the command line".to_owned(),
        },
    }
}

/// Spells a reference as a JSON object with the setting and its value, or with the command.
pub fn as_json(reference: &Reference) -> String {
    let object = match reference {
        Reference::Setting(setting, value) => json!({ "setting": setting.name(), "value": value }),
        Reference::Command(_) => json!({ "command": in_page(reference) }),
    };
    object.to_string()
}
