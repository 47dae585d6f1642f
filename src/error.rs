//! The library's one error: what happened, where, and what to do about it.

use crate::setting::{Spelling, Text};
use crate::text::printable;
use std::fmt;
use std::path::{Path, PathBuf};

/// Result of this library.
pub type Result<T> = std::result::Result<T, Error>;

/// Kinds of errors; each has one exit code on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ErrorKind {
    /// A setting is wrong (exit code 2).
    Usage,
    /// A file cannot be read, trusted or written (exit code 3).
    Data,
    /// The data do not determine what was asked for (exit code 4).
    NotIdentified,
    /// The device that was asked for is not there (exit code 5).
    Device,
}

/// An error with its place and its hint.
///
/// `Display` gives place and message on one line, free of control characters; [`Error::hint`] says what to do. Both name
/// settings as the library does; a front end spells them by [`Error::spelled`] and [`Text::spelled`].
#[derive(Debug, Clone)]
pub struct Error(Box<Inner>);

#[derive(Debug, Clone)]
struct Inner {
    kind: ErrorKind,
    path: Option<PathBuf>,
    part: Option<String>,
    line: Option<u64>,
    column: Option<String>,
    message: Text,
    hint: Text,
}

impl Error {
    /// An error of a kind, with what happened and what to do.
    pub fn new(kind: ErrorKind, message: impl Into<Text>, hint: impl Into<Text>) -> Self {
        let (message, hint) = (message.into().printable(), hint.into().printable());
        Self(Box::new(Inner { kind, path: None, part: None, line: None, column: None, message, hint }))
    }

    /// A wrong setting.
    pub fn usage(message: impl Into<Text>, hint: impl Into<Text>) -> Self {
        Self::new(ErrorKind::Usage, message, hint)
    }

    /// Bad data.
    pub fn data(message: impl Into<Text>, hint: impl Into<Text>) -> Self {
        Self::new(ErrorKind::Data, message, hint)
    }

    /// Data that do not determine what was asked for.
    pub fn not_identified(message: impl Into<Text>, remedy: impl Into<Text>) -> Self {
        Self::new(ErrorKind::NotIdentified, message, remedy)
    }

    /// The file it happened in.
    #[must_use]
    pub fn in_file(mut self, path: &Path) -> Self {
        self.0.path.get_or_insert_with(|| path.to_path_buf());
        self
    }

    /// The part of the file it happened in: a sheet, a test.
    #[must_use]
    pub fn in_part(mut self, part: &str) -> Self {
        self.0.part.get_or_insert_with(|| part.to_owned());
        self
    }

    /// The line it happened at, where it is known, counted from 1 with the heading.
    #[must_use]
    pub fn at_line(mut self, line: impl Into<Option<u64>>) -> Self {
        self.0.line = line.into().or(self.0.line);
        self
    }

    /// The column it happened in, by its heading.
    #[must_use]
    pub fn in_column(mut self, column: impl Into<String>) -> Self {
        self.0.column = Some(column.into());
        self
    }

    /// Returns the error with something to look at before what its hint says.
    #[must_use]
    pub(crate) fn hinted_first(mut self, first: &Text) -> Self {
        self.0.hint = first.clone().printable().and(" ").and(&self.0.hint);
        self
    }

    /// Returns the kind of the error.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        self.0.kind
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        self.0.path.as_deref()
    }

    /// The part of the file: a sheet, a test.
    #[must_use]
    pub fn part(&self) -> Option<&str> {
        self.0.part.as_deref()
    }

    /// The line of the file, counted from 1 with the heading.
    #[must_use]
    pub fn line(&self) -> Option<u64> {
        self.0.line
    }

    /// The column of the file, by its heading.
    #[must_use]
    pub fn column(&self) -> Option<&str> {
        self.0.column.as_deref()
    }

    /// Returns the message, without the place, free of control characters.
    #[must_use]
    pub fn message(&self) -> &Text {
        &self.0.message
    }

    /// Returns the remedy, free of control characters.
    #[must_use]
    pub fn hint(&self) -> &Text {
        &self.0.hint
    }

    /// Place and message on one line.
    #[must_use]
    pub fn text(&self) -> Text {
        let inner = &self.0;
        let place = [
            inner.path.as_ref().map(|path| path.display().to_string()),
            inner.part.clone(),
            inner.line.map(|line| format!("line {line}")),
            inner.column.as_ref().map(|column| format!("column {column}")),
        ];
        let place = place.into_iter().flatten().collect::<Vec<_>>().join(", ");
        let joint = if place.is_empty() { "" } else { ": " };
        Text::from(printable(&place)).and(joint).and(&inner.message)
    }

    /// Place and message in the words of a front end.
    #[must_use]
    pub fn spelled(&self, spelling: Spelling) -> String {
        self.text().spelled(spelling)
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.text().fmt(f)
    }
}

impl std::error::Error for Error {}
