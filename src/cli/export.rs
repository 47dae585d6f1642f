//! `identify --export`: a file for a simulator, on stdout in place of the result, or in the folder of `--out`.

use super::args::IdentifyArgs;
use super::prelude::*;
use motorfit::identify::Trust;
use motorfit::report::{ExportFormat, Exported};

/// Checks that stdout has one document only.
pub(super) fn check(args: &IdentifyArgs) -> Result<()> {
    if is_printed(args) && (args.json || args.svg.as_deref().is_some_and(stdio::is_stdio)) {
        let message = "--export prints a file to stdout, which has another document";
        return Err(Error::usage(message, "Add --out DIR, which takes the file."));
    }
    Ok(())
}

/// Returns true if the file takes the place of the result on stdout.
pub(super) fn is_printed(args: &IdentifyArgs) -> bool {
    args.export.is_some() && args.out.is_none()
}

/// Writes the file in the requested format; returns its name and text.
pub(super) fn file(args: &IdentifyArgs, of: impl FnOnce() -> Result<Exported>) -> Result<Option<(String, String)>> {
    let written = |format: ExportFormat| Ok((format!("motor.{}", format.extension()), format.write(&of()?)?));
    args.export.map(written).transpose()
}

/// Prints the file, with the level of trust on stderr.
pub(super) fn print(args: &IdentifyArgs, file: Option<&(String, String)>, trust: &Trust, style: &Style) -> Result<()> {
    let Some((_, text)) = file.filter(|_| is_printed(args)) else { return Ok(()) };
    style.note(&format!("trust in the exported parameters: {}", trust.level.name()));
    data(text)
}
