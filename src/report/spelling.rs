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
            let command = match command {
                Command::Identify => "identify".to_owned(),
                Command::Inspect => "inspect".to_owned(),
                Command::Devices => "devices".to_owned(),
                Command::PlanSweep => format!("sweep plan STUDY.toml {out}"),
                Command::RunSweep => "sweep run DIR".to_owned(),
            };
            format!("motorfit {command}")
        }
    }
}
