//! The user's cache: throughput that a bench measured on this machine, for `--device auto`.

use super::out;
use super::output::Style;
use motorfit::device::ThroughputProfile;
use motorfit::{Error, Result};
use std::path::PathBuf;

/// Where it is kept; `None` for a user without a home.
fn place() -> Option<PathBuf> {
    use etcetera::BaseStrategy as _;
    let strategy = etcetera::choose_base_strategy().ok()?;
    Some(strategy.cache_dir().join("motorfit").join("bench.json"))
}

/// Returns the measured throughput of this processor and version. A file that cannot be read is reported and left out.
pub(super) fn paces(style: &Style) -> Option<ThroughputProfile> {
    let path = place()?;
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return None,
        Err(error) => {
            style.note(&format!("{} cannot be read: {error}", path.display()));
            return None;
        }
    };
    match serde_json::from_str::<ThroughputProfile>(&text) {
        Ok(paces) => Some(paces).filter(ThroughputProfile::are_current),
        Err(error) => {
            style.note(&format!("{} is no measurement of bench ({error}): bench writes it anew", path.display()));
            None
        }
    }
}

/// Keeps what was measured. Returns where.
pub(super) fn keep(paces: &ThroughputProfile) -> Result<Option<PathBuf>> {
    let Some(path) = place() else { return Ok(None) };
    let text = serde_json::to_string_pretty(paces)
        .map_err(|e| Error::data(format!("the measurement cannot be kept: {e}"), "Add --no-keep."))?;
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(|e| {
            Error::data(format!("the folder cannot be made: {e}"), "Add --no-keep, or allow writing there.")
                .in_file(folder)
        })?;
    }
    out::write_file(&path, &text)?;
    Ok(Some(path))
}
