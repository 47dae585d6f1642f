//! The error type of the library: a kind, a message, the location in a file and a hint.

use crate::setting::{Spelling, Text};
use crate::text::printable;
use std::fmt;
use std::path::{Path, PathBuf};

/// Result with the error of this library.
pub type Result<T> = std::result::Result<T, Error>;

/// Kinds of errors; each has one exit code on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ErrorKind {
    /// A setting is wrong (exit code 2).
    Usage,
    /// A file cannot be read or written, or its data are invalid (exit code 3).
    Data,
    /// The data do not identify the requested parameters (exit code 4).
    NotIdentified,
    /// The requested device is not available (exit code 5).
    Device,
}

impl ErrorKind {
    /// Returns the name of the kind in documents.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Usage => "usage",
            Self::Data => "data",
            Self::NotIdentified => "not_identified",
            Self::Device => "device",
        }
    }
}

/// An error with its location in a file and a hint.
///
/// `Display` writes location and message on one line without control characters; [`Error::hint`] is the suggested remedy.
/// Both name settings by the library's names; a front end spells them by [`Error::spelled`] and [`Text::spelled`].
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
    /// Creates an error of a kind from a message and a hint.
    pub fn new(kind: ErrorKind, message: impl Into<Text>, hint: impl Into<Text>) -> Self {
        let (message, hint) = (message.into().printable(), hint.into().printable());
        Self(Box::new(Inner { kind, path: None, part: None, line: None, column: None, message, hint }))
    }

    /// Creates an error of the kind [`ErrorKind::Usage`]: a setting is wrong.
    pub fn usage(message: impl Into<Text>, hint: impl Into<Text>) -> Self {
        Self::new(ErrorKind::Usage, message, hint)
    }

    /// Creates an error of the kind [`ErrorKind::Data`]: a file or its data are invalid.
    pub fn data(message: impl Into<Text>, hint: impl Into<Text>) -> Self {
        Self::new(ErrorKind::Data, message, hint)
    }

    /// Creates an error of the kind [`ErrorKind::NotIdentified`]: the data do not identify the requested parameters.
    pub fn not_identified(message: impl Into<Text>, remedy: impl Into<Text>) -> Self {
        Self::new(ErrorKind::NotIdentified, message, remedy)
    }

    /// Returns the error located in a file, unless it has a file already.
    #[must_use]
    pub fn in_file(mut self, path: &Path) -> Self {
        self.0.path.get_or_insert_with(|| path.to_path_buf());
        self
    }

    /// Returns the error located in a part of the file, such as a sheet or a test, unless it has a part already.
    #[must_use]
    pub fn in_part(mut self, part: &str) -> Self {
        self.0.part.get_or_insert_with(|| part.to_owned());
        self
    }

    /// Returns the error located at a line, counted from 1 with the heading; `None` keeps the present line.
    #[must_use]
    pub fn at_line(mut self, line: impl Into<Option<u64>>) -> Self {
        self.0.line = line.into().or(self.0.line);
        self
    }

    /// Returns the error located in the column with this heading.
    #[must_use]
    pub fn in_column(mut self, column: impl Into<String>) -> Self {
        self.0.column = Some(column.into());
        self
    }

    /// Returns the error with `first` prepended to its hint.
    #[must_use]
    #[doc(hidden)]
    pub fn with_hint_prefix(mut self, first: &Text) -> Self {
        self.0.hint = first.clone().printable().and(" ").and(&self.0.hint);
        self
    }

    /// Returns the kind of the error.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        self.0.kind
    }

    /// Returns the file, if the error is located in one.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        self.0.path.as_deref()
    }

    /// Returns the part of the file, such as a sheet or a test.
    #[must_use]
    pub fn part(&self) -> Option<&str> {
        self.0.part.as_deref()
    }

    /// Returns the line of the file, counted from 1 with the heading.
    #[must_use]
    pub fn line(&self) -> Option<u64> {
        self.0.line
    }

    /// Returns the heading of the column of the file.
    #[must_use]
    pub fn column(&self) -> Option<&str> {
        self.0.column.as_deref()
    }

    /// Returns the message without the location, free of control characters.
    #[must_use]
    pub fn message(&self) -> &Text {
        &self.0.message
    }

    /// Returns the hint, free of control characters.
    #[must_use]
    pub fn hint(&self) -> &Text {
        &self.0.hint
    }

    /// Returns location and message on one line.
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

    /// Returns location and message with settings spelled by a front end.
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
