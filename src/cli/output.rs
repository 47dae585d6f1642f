//! Output streams: data go to stdout, everything else to stderr.

use super::args::{Common, When};
use super::failure;
use super::terminal::{Stream, fitted};
use anstyle::{AnsiColor, Style as Paint};
use clap::error::{ContextKind, ContextValue};
use motorfit::file::with_similar_name;
use motorfit::identify::Trust;
use motorfit::record::Severity;
use motorfit::report::command_line;
use motorfit::text::{nearest as nearest_of, printable};
use motorfit::warning::Warning;
use motorfit::{Error, Result};
use std::io::{self, IsTerminal as _, Write as _};
use std::sync::atomic::{AtomicBool, Ordering};

pub(crate) struct Style {
    pub quiet: bool,
    pub verbose: bool,
    pub progress: Progress,
}

#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Progress {
    Hidden,
    Bar,
    Json,
}

const ERROR: Paint = AnsiColor::Red.on_default().bold();
const WARNING: Paint = AnsiColor::Yellow.on_default().bold();
const HELP: Paint = AnsiColor::Cyan.on_default();
pub(crate) const STRONG: Paint = Paint::new().bold();
pub(crate) const DIM: Paint = Paint::new().dimmed();
/// Text in place of reasons for a level of trust.
pub(crate) const WITHOUT_REASONS: &str =
    "no test of the residuals, the search or the recordings contradicts the standard errors";

impl Style {
    pub(crate) fn new(common: &Common) -> Self {
        match common.color {
            When::Auto => {} // anstream respects the terminal, NO_COLOR and CLICOLOR
            When::Always => anstream::ColorChoice::Always.write_global(),
            When::Never => anstream::ColorChoice::Never.write_global(),
        }
        let progress = if common.no_progress || common.quiet {
            Progress::Hidden
        } else if common.progress == super::args::ProgressKind::Json {
            Progress::Json
        } else if io::stderr().is_terminal() {
            Progress::Bar
        } else {
            Progress::Hidden
        };
        Self { quiet: common.quiet, verbose: common.verbose, progress }
    }

    pub(crate) fn error(&self, error: &Error) {
        let error = with_similar_name(error.clone());
        let (message, hint) = (error.spelled(command_line), error.hint().spelled(command_line));
        self.line(&format!("{ERROR}error:{ERROR:#} {message}\n{HELP}help:{HELP:#} {hint}"));
    }

    /// Prints warnings; those of minor severity only with `--verbose`.
    pub(crate) fn warnings(&self, warnings: &[Warning]) {
        let shown = |w: &&Warning| self.verbose || w.severity == Severity::Report;
        self.findings(warnings.iter().filter(shown));
    }

    pub(crate) fn findings<'a>(&self, warnings: impl IntoIterator<Item = &'a Warning>) {
        for warning in warnings.into_iter().filter(|_| !self.quiet) {
            let text = printable(&warning.spelled(command_line));
            match warning.severity {
                Severity::Report => self.line(&format!("{WARNING}warning:{WARNING:#} {text} [{}]", warning.code)),
                Severity::Mention => self.line(&format!("{DIM}note:{DIM:#} {text} [{}]", warning.code)),
            }
        }
    }

    /// Prints a text as a warning.
    pub(crate) fn complaint(&self, text: &str) {
        if !self.quiet {
            self.line(&format!("{WARNING}warning:{WARNING:#} {}", printable(text)));
        }
    }

    pub(crate) fn note(&self, text: &str) {
        for line in text.lines().filter(|_| !self.quiet) {
            self.line(&printable(line));
        }
    }

    /// Writes a line to stderr; a failure is ignored, since there is nowhere to report it.
    fn line(&self, text: &str) {
        let _ = writeln!(anstream::stderr(), "{}", fitted(text, Stream::Stderr));
    }
}

/// Writes text for people to stdout, wrapped to the terminal.
pub(crate) fn show(text: &str) -> Result<()> {
    data(&fitted(text, Stream::Stdout))
}

/// True once anything was written to stdout.
static WRITTEN: AtomicBool = AtomicBool::new(false);

/// Returns true if the command line requests JSON. It is read before the arguments are parsed, since they may be wrong.
fn is_json() -> bool {
    std::env::args_os().skip(1).any(|word| word == "--json")
}

/// With `--json`, writes the document of an error to stdout, unless it already has a document or the result that was asked for.
pub(crate) fn error_document(error: &Error) {
    if is_json() && !WRITTEN.load(Ordering::Relaxed) {
        let _ = data(&failure::document(error, &[]));
    }
}

/// True until a write to stdout fails because its reader is gone.
static READ: AtomicBool = AtomicBool::new(true);

/// Returns false once the reader of stdout is gone, so that a stream of results can end early.
pub(crate) fn is_read() -> bool {
    READ.load(Ordering::Relaxed)
}

/// Writes data to stdout. A broken pipe is not an error.
pub(crate) fn data(text: &str) -> Result<()> {
    let mut stdout = anstream::stdout();
    WRITTEN.fetch_or(!text.is_empty(), Ordering::Relaxed);
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Error::data(format!("stdout cannot be written: {error}"), "Check where the output goes."))
        }
        done => {
            READ.fetch_and(done.is_ok(), Ordering::Relaxed);
            Ok(())
        }
    }
}

/// Prints clap's message on wrong arguments, free of control characters, with the nearest value.
pub(crate) fn usage(error: &clap::Error) {
    let mut lines: Vec<String> = error.render().to_string().lines().map(printable).collect();
    if let Some(near) = nearest(error) {
        let at = lines.iter().rposition(String::is_empty).unwrap_or(lines.len());
        lines.splice(at..at, [String::new(), format!("  tip: a similar value exists: '{near}'")]);
    }
    let text = lines.join("\n");
    let _ = writeln!(anstream::stderr(), "{}", fitted(&text, Stream::Stderr));
    // The first paragraph is the fault, the others are tips and the usage.
    let (fault, rest) = text.split_once("\n\n").unwrap_or((&text, ""));
    let fault = fault.trim_start_matches("error: ").split_whitespace().collect::<Vec<_>>().join(" ");
    let rest = rest.split_whitespace().collect::<Vec<_>>().join(" ");
    error_document(&Error::usage(fault, rest));
}

/// Returns the valid value that is most similar to an invalid one, if clap itself suggests none.
fn nearest(error: &clap::Error) -> Option<&str> {
    let Some(ContextValue::String(given)) = error.get(ContextKind::InvalidValue) else { return None };
    let Some(ContextValue::Strings(values)) = error.get(ContextKind::ValidValue) else { return None };
    if error.get(ContextKind::SuggestedValue).is_some() {
        return None;
    }
    let values: Vec<&str> = values.iter().map(String::as_str).collect();
    nearest_of(given, &values)
}

/// Returns the level of trust with that to which it applies and its reasons, or `otherwise` without any, and the next step if there is one.
pub(super) fn trust_line(trust: &Trust, otherwise: &str, next: Option<&str>) -> String {
    let reasons: Vec<String> = trust.reasons.iter().map(|reason| reason.message.spelled(command_line)).collect();
    let reasons = if reasons.is_empty() { otherwise.to_owned() } else { reasons.join("; ") };
    let next = next.map_or(String::new(), |next| format!("  next      {next}\n"));
    let of = match trust.subject() {
        of if of.is_empty() => of,
        of => format!(" for {of}"),
    };
    let (level, of, reasons) = (trust.level.name(), printable(&of), printable(&reasons));
    format!("  {STRONG}trust     {level}{STRONG:#}{of}: {reasons}\n{next}\n")
}
