//! The error for a file that cannot be read.

use motorfit_core::Error;
use motorfit_core::text::printable;

/// Returns the error for a log that cannot be read.
#[must_use]
pub fn unreadable(error: &std::io::Error) -> Error {
    let remedy = match error.kind() {
        std::io::ErrorKind::NotFound => "Check the path; relative paths start at the current folder.",
        std::io::ErrorKind::PermissionDenied => "Allow reading it, or run as a user with permission to read it.",
        _ => "Check the file and its disk.",
    };
    Error::data(format!("cannot be read: {}", printable(&error.to_string())), remedy)
}
