//! The path `-`, which stands for stdin and stdout.

use motorfit::{Error, Result};
use std::io::Read as _;
use std::path::Path;

/// Returns true for `-`, which stands for stdin and stdout.
pub(super) fn is_stdio(path: &Path) -> bool {
    path == Path::new("-")
}

/// Reads stdin to its end.
pub(super) fn stdin() -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    std::io::stdin().read_to_end(&mut bytes).map_err(|error| {
        let hint = "Check what writes to it.";
        Error::data(format!("stdin cannot be read: {error}"), hint)
    })?;
    Ok(bytes)
}
