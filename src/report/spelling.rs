//! The program's words for the settings that texts of the library refer to. Documents and pages use them too: they are
//! those of the program, whoever makes them.

use crate::setting::{Command, Reference};

/// Spells a reference as a flag or a command of the program: `--fix K=…`.
#[must_use]
pub fn command_line(reference: &Reference) -> String {
    match reference {
        Reference::Setting(setting, value) => {
            let flag = format!("--{}", setting.name().replace('_', "-"));
            value.as_ref().map_or(flag.clone(), |value| format!("{flag} {value}"))
        }
        Reference::Command(command) => {
            let command = match command {
                Command::Identify => "identify",
                Command::Devices => "devices",
                Command::PlanSweep => "sweep plan STUDY.toml --out DIR",
                Command::RunSweep => "sweep run DIR",
            };
            format!("motorfit {command}")
        }
    }
}
