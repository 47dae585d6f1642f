//! `completions` and `man`.

use super::args::Cli;
use super::{Outcome, output};
use clap::CommandFactory as _;
use motorfit::{Error, Result};

pub(super) fn completions(shell: clap_complete::Shell) -> Result<Outcome> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "motorfit", &mut script);
    output::data(&String::from_utf8_lossy(&script))?;
    Ok(Outcome::Done)
}

/// The page of the program, then one for each command.
pub(super) fn man() -> Result<Outcome> {
    let mut page = Vec::new();
    let mut command = Cli::command();
    command.build();
    let commands = command.get_subcommands().filter(|c| c.get_name() != "help").cloned();
    for command in std::iter::once(command.clone()).chain(commands) {
        clap_mangen::Man::new(command)
            .render(&mut page)
            .map_err(|error| Error::data(format!("the manual cannot be made: {error}"), "Try again."))?;
    }
    output::data(&String::from_utf8_lossy(&page))?;
    Ok(Outcome::Done)
}
