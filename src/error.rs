//! The library's one error: what happened, where, and what to do about it.

use crate::text::printable;
use std::fmt;
use std::path::{Path, PathBuf};

/// Result of this library.
pub type Result<T> = std::result::Result<T, Error>;

/// What sort of fault it is; each has one exit code on the command line.
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

/// An error with its place and its remedy.
///
/// `Display` gives place and message on one line, free of control characters; [`Error::remedy`] says what to do.
#[derive(Debug, Clone)]
pub struct Error(Box<Inner>);

#[derive(Debug, Clone)]
struct Inner {
    kind: ErrorKind,
    path: Option<PathBuf>,
    part: Option<String>,
    line: Option<u64>,
    column: Option<String>,
    message: String,
    remedy: String,
}

impl Error {
    /// An error of a kind, with what happened and what to do.
    pub fn new(kind: ErrorKind, message: impl Into<String>, remedy: impl Into<String>) -> Self {
        let (message, remedy) = (message.into(), remedy.into());
        Self(Box::new(Inner { kind, path: None, part: None, line: None, column: None, message, remedy }))
    }

    /// A wrong setting.
    pub fn usage(message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::new(ErrorKind::Usage, message, remedy)
    }

    /// Bad data.
    pub fn data(message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::new(ErrorKind::Data, message, remedy)
    }

    /// Data that do not determine what was asked for.
    pub fn not_identified(message: impl Into<String>, remedy: impl Into<String>) -> Self {
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

    /// The line it happened at, counted from 1 with the heading.
    #[must_use]
    pub fn at_line(mut self, line: u64) -> Self {
        self.0.line = Some(line);
        self
    }

    /// The column it happened in, by its heading.
    #[must_use]
    pub fn in_column(mut self, column: impl Into<String>) -> Self {
        self.0.column = Some(column.into());
        self
    }

    /// What sort of fault it is.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        self.0.kind
    }

    /// The line of the file, counted from 1 with the heading.
    #[must_use]
    pub fn line(&self) -> Option<u64> {
        self.0.line
    }

    /// What happened, without its place.
    #[must_use]
    pub fn message(&self) -> String {
        printable(&self.0.message)
    }

    /// What to do about it, free of control characters.
    #[must_use]
    pub fn remedy(&self) -> String {
        printable(&self.0.remedy)
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let inner = &self.0;
        let mut place = Vec::new();
        if let Some(path) = &inner.path {
            place.push(path.display().to_string());
        }
        if let Some(part) = &inner.part {
            place.push(part.clone());
        }
        if let Some(line) = inner.line {
            place.push(format!("line {line}"));
        }
        if let Some(column) = &inner.column {
            place.push(format!("column {column}"));
        }
        let place = place.join(", ");
        let joint = if place.is_empty() { "" } else { ": " };
        f.write_str(&printable(&format!("{place}{joint}{}", inner.message)))
    }
}

impl std::error::Error for Error {}
