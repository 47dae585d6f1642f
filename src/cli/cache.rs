//! The user's cache file: throughput that `bench` measured on this machine, for `--device auto`.

use super::out;
use super::output::Style;
use motorfit::device::ThroughputProfile;
use motorfit::{Error, Result};
use std::path::PathBuf;

/// Returns the path of the cache file, `None` if the user has no home folder.
fn cache_path() -> Option<PathBuf> {
    use etcetera::BaseStrategy as _;
    let strategy = etcetera::choose_base_strategy().ok()?;
    Some(strategy.cache_dir().join("motorfit").join("bench.json"))
}

/// Returns the stored throughput profile if it is of this processor and version. A file that cannot be read is reported and
/// ignored.
pub(super) fn throughput_profile(style: &Style) -> Option<ThroughputProfile> {
    let path = cache_path()?;
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return None,
        Err(error) => {
            style.note(&format!("{} cannot be read: {error}", path.display()));
            return None;
        }
    };
    match serde_json::from_str::<ThroughputProfile>(&text) {
        Ok(throughput_profile) => Some(throughput_profile).filter(ThroughputProfile::is_current),
        Err(error) => {
            style.note(&format!("{} is no measurement of bench ({error}); the next one replaces it", path.display()));
            None
        }
    }
}

/// Stores a throughput profile. Returns the path, `None` if the user has no home folder.
pub(super) fn keep(throughput_profile: &ThroughputProfile) -> Result<Option<PathBuf>> {
    let Some(path) = cache_path() else { return Ok(None) };
    let text = serde_json::to_string_pretty(throughput_profile)
        .map_err(|e| Error::data(format!("the measurement cannot be stored: {e}"), "Add --no-keep."))?;
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(|e| {
            Error::data(format!("the folder cannot be created: {e}"), "Add --no-keep, or allow writing there.")
                .in_file(folder)
        })?;
    }
    out::write_file(&path, &text)?;
    Ok(Some(path))
}
