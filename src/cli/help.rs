//! Help texts with examples before the options.

use super::args::{Cli, Command as Commands};
use clap::Command;
use clap::builder::StyledStr;
use std::ffi::OsString;

/// Order of the sections: description, examples, usage, options.
const TEMPLATE: &str = "{about-with-newline}\n{before-help}{usage-heading} {usage}\n\n{all-args}{after-help}";

/// Examples of each command, by its path of subcommands.
const EXAMPLES: [(&str, &[&str]); 21] = [
    ("", &["identify log.csv", "identify log.csv --with auto --split 0.7", "inspect log.csv"]),
    (
        "identify",
        &[
            "identify log.csv",
            "identify log.csv --columns 'time=t:ms,voltage=pwm*12/255:V,speed=rpm' --with auto",
            "identify first.csv second.csv --validate third.csv --out report",
        ],
    ),
    (
        "evaluate",
        &[
            "evaluate log.csv --candidates motors.csv",
            "evaluate log.csv --sample lhs:100000 --top 10",
            "evaluate log.csv --slice R,L --svg map.svg",
        ],
    ),
    (
        "compare",
        &[
            "compare --preset paper",
            "compare log.csv --methods gwo,jaya,sm --runs 20 --out report",
            "compare log.csv --population 50,100,200",
            "compare log.csv --model pmsm --methods gwo,de,cmaes --runs 20",
            "compare --suite motors --methods gwo,cmaes,multistart --budgets 1000,10000",
        ],
    ),
    ("sweep", &["sweep study.toml --out night --report report", "sweep status night", "sweep run night --shard 1/4"]),
    ("sweep plan", &["sweep plan study.toml --out night"]),
    ("sweep run", &["sweep run night", "sweep run night --shard 1/4"]),
    ("sweep status", &["sweep status night"]),
    ("sweep merge", &["sweep merge night", "sweep merge night --limits R=0.8:1.0 --parquet all.parquet --out report"]),
    (
        "simulate",
        &[
            "simulate --parameters m2 --input step:12@0.1 --noise 40dB --out recording.csv",
            "simulate --parameters m2,Tc=0.01 --input voltage.csv --out recording.csv",
        ],
    ),
    ("model", &["model list", "model show pmsm > pmsm.toml", "model check pmsm.toml"]),
    ("model check", &["model check machine.toml", "model check pmsm --out report"]),
    ("model list", &["model list"]),
    ("model show", &["model show pmsm > pmsm.toml"]),
    ("inspect", &["inspect log.csv", "inspect log.csv --out report"]),
    (
        "sysid",
        &[
            "sysid FRC_20260301.wpilog",
            "sysid log.wpilog --mechanism arm --controller ctre-v6 --out report",
            "sysid log.wpilog --sheet drive:left --velocity-error 0.5",
        ],
    ),
    ("bench", &["bench", "bench --seconds 10 --populations 100,10000 --svg rates.svg"]),
    ("devices", &["devices", "devices --json"]),
    ("view", &["view", "view log.csv", "view first.csv second.csv --no-open"]),
    ("completions", &["completions bash > ~/.local/share/bash-completion/completions/motorfit"]),
    ("man", &["man | man -l -", "man ~/.local/share/man/man1"]),
];

/// Returns the program's commands with their arguments and examples.
pub(super) fn command() -> Command {
    with_examples(Cli::definition(None), "", None)
}

/// Returns the program's commands for parsing `arguments`: only the command that is named there has its arguments and examples.
pub(super) fn command_for(arguments: impl IntoIterator<Item = OsString>) -> Command {
    let named = |argument: OsString| Some(*Commands::NAMES.iter().find(|name| argument == **name)?);
    let wanted = arguments.into_iter().skip(1).find_map(named).unwrap_or_default();
    with_examples(Cli::definition(Some(wanted)), "", Some(wanted))
}

/// Returns the examples of the command at a path of subcommands, without the name of the program.
pub(super) fn examples(path: &str) -> &'static [&'static str] {
    EXAMPLES.iter().find(|(of, _)| *of == path).map(|(_, examples)| *examples).unwrap_or_default()
}

/// Adds examples to the help of the command at a path of subcommands and of those below it; at the top only of `wanted`.
fn with_examples(command: Command, path: &str, wanted: Option<&str>) -> Command {
    let command = match examples(path) {
        [] => command,
        examples => command.before_help(examples_text(examples)).help_template(TEMPLATE),
    };
    let below = command.get_subcommands().map(|of| of.get_name().to_owned());
    let names: Vec<String> = below.filter(|name| wanted.is_none_or(|wanted| wanted == name)).collect();
    names.into_iter().fold(command, |command, name| {
        let path = format!("{path} {name}");
        command.mut_subcommand(&name, |of| with_examples(of, path.trim_start(), None))
    })
}

fn examples_text(examples: &[&str]) -> StyledStr {
    use super::output::STRONG;
    let lines: String = examples.iter().map(|example| format!("  motorfit {example}\n")).collect();
    format!("{STRONG}Examples:{STRONG:#}\n{}", lines.trim_end()).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_has_examples_that_are_understood() {
        let mut command = command();
        command.build();
        let mut paths = vec![String::new()];
        for one in command.get_subcommands().filter(|of| of.get_name() != "help") {
            paths.push(one.get_name().to_owned());
            let below = one.get_subcommands().filter(|of| of.get_name() != "help");
            paths.extend(below.map(|of| format!("{} {}", one.get_name(), of.get_name())));
        }
        assert_eq!(paths.len(), EXAMPLES.len());
        for path in paths {
            let (_, examples) = EXAMPLES.iter().find(|(of, _)| *of == path).unwrap();
            for example in *examples {
                // The words after a pipe or a redirection are another program's.
                let own = example.split(['|', '>']).next().unwrap();
                let words = std::iter::once("motorfit").chain(own.split_whitespace());
                let words = words.map(|word| word.trim_matches('\'').to_owned());
                let understood = super::command().try_get_matches_from(words);
                assert!(understood.is_ok() && example.starts_with(path.as_str()), "{example}: {:?}", understood.err());
            }
        }
    }

    #[test]
    fn the_command_that_is_run_is_the_same_without_the_arguments_of_the_others() {
        for name in Commands::NAMES {
            let own = |mut all: Command| {
                all.build();
                all.find_subcommand_mut(name).unwrap().render_long_help().to_string()
            };
            let words = ["motorfit", "--color", "never", name, "log.csv"].map(OsString::from);
            let (lean, full) = (super::command_for(words), super::command());
            let others = |of: &Command| of.get_subcommands().map(|of| of.get_arguments().count()).sum::<usize>();
            assert!(others(&lean) < others(&full), "{name}");
            assert_eq!(own(lean), own(full));
        }
    }
}
