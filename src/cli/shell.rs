//! The commands `completions` and `man`.

use super::outcome::Outcome;
use super::output::Style;
use super::{help, out, output};
use motorfit::{Error, Result};
use std::path::Path;

pub(super) fn completions(shell: clap_complete::Shell) -> Result<Outcome> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut help::command(), "motorfit", &mut script);
    output::data(&String::from_utf8_lossy(&script))?;
    Ok(Outcome::Done)
}

/// Prints the manual pages of the program and its commands, or writes one file per page into a folder.
pub(super) fn man(folder: Option<&Path>, style: &Style) -> Result<Outcome> {
    let mut command = help::command();
    command.build();
    let pages = pages(&command, "motorfit")?;
    let Some(folder) = folder else {
        output::data(&pages.iter().map(|(_, page)| page.as_str()).collect::<String>())?;
        return Ok(Outcome::Done);
    };
    std::fs::create_dir_all(folder).map_err(|error| motorfit::file::unwritable(folder, &error))?;
    for (name, page) in &pages {
        out::write_file(&folder.join(format!("{name}.1")), page)?;
    }
    style.note(&format!("wrote {} pages to {}", pages.len(), folder.display()));
    Ok(Outcome::Done)
}

/// Returns the (name, page) pairs of a command and its subcommands.
fn pages(command: &clap::Command, name: &str) -> Result<Vec<(String, String)>> {
    let mut page = Vec::new();
    clap_mangen::Man::new(command.clone().name(name.to_owned()))
        .render(&mut page)
        .map_err(|error| Error::data(format!("the manual cannot be generated: {error}"), "Try again."))?;
    let page = with_examples(&String::from_utf8_lossy(&page), &name.replacen("motorfit", "", 1).replace('-', " "));
    let mut all = vec![(name.to_owned(), page)];
    for below in command.get_subcommands().filter(|below| below.get_name() != "help") {
        all.extend(pages(below, &format!("{name}-{}", below.get_name()))?);
    }
    Ok(all)
}

/// Returns a manual page with the examples of its command in a section before the version.
fn with_examples(page: &str, path: &str) -> String {
    // In roff a plain hyphen may become a typographic one, and a backslash begins an escape.
    let line = |example: &&str| format!("motorfit {}\n", example.replace('\\', "\\e").replace('-', "\\-"));
    let lines: String = help::examples(path.trim_start()).iter().map(line).collect();
    let at = page.find(".SH VERSION").unwrap_or(page.len());
    format!("{}.SH EXAMPLES\n.nf\n{lines}.fi\n{}", &page[..at], &page[at..])
}
