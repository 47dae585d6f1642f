//! The program's words for the settings that texts of the library refer to. Documents and pages use them too: they are
//! those of the program, whoever makes them.

use crate::setting::{Command, Reference, Setting};

/// Spells a reference as a flag or a command of the program.
#[must_use]
pub fn command_line(reference: &Reference) -> String {
    match reference {
        Reference::Setting(setting, value) => {
            let flag = format!("--{}", setting.name().replace('_', "-"));
            value.as_ref().map_or(flag.clone(), |value| format!("{flag} {value}"))
        }
        Reference::Command(command) => {
            let out = command_line(&Setting::Out.to("DIR"));
            match command {
                Command::Identify => program("identify"),
                Command::Devices => program("devices"),
                Command::PlanSweep => program(&format!("sweep plan STUDY.toml {out}")),
                Command::RunSweep => program("sweep run DIR"),
            }
        }
    }
}

/// Returns a command with the name of the program.
fn program(command: &str) -> String {
    format!("motorfit {command}")
}
