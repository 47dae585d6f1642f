//! The command-line program: parses arguments, calls the library and prints results. Each command has its file.

mod adapters;
mod args;
mod bench;
mod bench_args;
mod cache;
mod candidates;
mod compare;
mod devices;
mod evaluate;
mod evaluation;
mod export;
mod failure;
mod flags;
mod folder;
mod help;
mod identified;
mod identify;
mod inputs;
mod inspect;
mod model;
mod next;
mod out;
mod outcome;
mod output;
mod plot;
mod prelude;
mod profile;
mod progress;
mod shell;
mod signal_table;
mod signals;
mod simulate;
mod slice;
mod stdio;
mod sweep;
mod sysid;
mod sysid_args;
mod terminal;
#[cfg(feature = "view")]
mod view;

use args::{Cli, Command};
use outcome::Outcome;
use output::Style;
use std::ffi::OsString;
use std::process::ExitCode;

pub(crate) fn main() -> ExitCode {
    if is_version(std::env::args_os().skip(1)) {
        return printed(&format!("motorfit {}\n", env!("CARGO_PKG_VERSION")));
    }
    adapters::with_runtime_folder();
    let mut command = help::command_for(std::env::args_os());
    let parsed = command.try_get_matches_from_mut(std::env::args_os()).and_then(|matches| Cli::parsed(&matches));
    let cli = match parsed {
        Ok(cli) => cli,
        Err(error) => return refuse(&error),
    };
    let style = Style::new(&cli.common);
    match signals::listen(style.quiet).and_then(|()| run(&cli, &style)) {
        Ok(outcome) => ExitCode::from(failure::code_of(&outcome)),
        Err(error) => {
            style.error(&error);
            output::error_document(&error);
            ExitCode::from(failure::code_of_error(&error))
        }
    }
}

fn run(cli: &Cli, style: &Style) -> motorfit::Result<Outcome> {
    match &cli.command {
        Command::Identify(args) => identify::run(args, style),
        Command::Compare(args) => compare::run(args, style),
        Command::Evaluate(args) => evaluate::run(args, style),
        Command::Sweep(args) => sweep::run(args, style),
        Command::Simulate(args) => simulate::run(args, style),
        Command::Inspect(args) => inspect::run(args, style),
        Command::Model(args) => model::run(args, style),
        Command::Sysid(args) => sysid::run(args, style),
        Command::Bench(args) => bench::run(args, style),
        Command::Devices(args) => devices::run(args),
        #[cfg(feature = "view")]
        Command::View(args) => view::run(args, style),
        #[cfg(not(feature = "view"))]
        Command::View(args) => without_view(args),
        Command::Completions(args) => shell::completions(args.shell),
        Command::Man(args) => shell::man(args.dir.as_deref(), style),
    }
}

/// Refuses the command `view` in a build without the server.
#[cfg(not(feature = "view"))]
fn without_view(_: &args::ViewArgs) -> motorfit::Result<Outcome> {
    Err(motorfit::Error::usage("this build cannot serve the page", "Build it with the feature `view`."))
}

/// Returns true for the version alone, which needs no parser.
fn is_version(mut arguments: impl Iterator<Item = OsString>) -> bool {
    arguments.next().is_some_and(|first| first == "--version" || first == "-V") && arguments.next().is_none()
}

fn printed(text: &str) -> ExitCode {
    match output::data(text) {
        Ok(()) => ExitCode::SUCCESS,
        Err(_) => ExitCode::from(3),
    }
}

/// Prints help and version to stdout; any other error of clap is wrong usage, exit code 2.
fn refuse(error: &clap::Error) -> ExitCode {
    if !error.use_stderr() {
        return printed(&error.render().ansi().to_string());
    }
    output::usage(error);
    ExitCode::from(2)
}
