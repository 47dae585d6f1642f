//! Command-line spelling of the settings and commands to which texts of the library refer. Documents and pages use it
//! whichever front end creates them.

use motorfit_core::setting::{Command, Reference, Setting};
use motorfit_core::text::shell_quoted;

/// Characters that a shell interprets.
const SPECIAL: [char; 17] = [' ', '(', ')', ';', '&', '|', '<', '>', '*', '?', '$', '`', '"', '\'', '\\', '#', '!'];

/// Spells a reference as a flag or a command of the program.
#[must_use]
pub fn command_line(reference: &Reference) -> String {
    match reference {
        Reference::Setting(setting, value) => {
            let flag = format!("--{}", setting.name().replace('_', "-"));
            // Formulas and names contain characters that are special in a shell; placeholders such as R=… do not.
            let is_special = |value: &String| *setting == Setting::Columns || value.contains(SPECIAL);
            let quote = |value: &String| if is_special(value) { shell_quoted(value) } else { value.clone() };
            value.as_ref().map_or(flag.clone(), |value| format!("{flag} {}", quote(value)))
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
