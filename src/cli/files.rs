//! Files that are written.

use motorfit::{Error, Result};
use std::io::Write as _;
use std::path::Path;

/// Beside, synced, renamed: the file is whole or not there.
pub(super) fn write(path: &Path, text: &str) -> Result<()> {
    let failed = |error: std::io::Error| {
        Error::data(format!("cannot be written: {error}"), "Choose a folder that exists and may be written to.")
            .in_file(path)
    };
    if path.is_dir() {
        return Err(Error::data("is a folder, expected a file to write", "Name a file in it.").in_file(path));
    }
    // A link is written through, a device or pipe written to, a protected file left alone.
    let resolved = path.canonicalize();
    let path = resolved.as_deref().unwrap_or(path);
    match path.metadata() {
        Ok(metadata) if !metadata.is_file() => return std::fs::write(path, text).map_err(failed),
        Ok(metadata) if metadata.permissions().readonly() => {
            return Err(
                Error::data("is protected against writing", "Choose another file, or allow writing it.").in_file(path)
            );
        }
        _ => {}
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut beside = tempfile::Builder::new();
    #[cfg(unix)]
    {
        // Those of an ordinary new file; the system takes its mask off.
        use std::os::unix::fs::PermissionsExt as _;
        beside.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = beside.tempfile_in(folder).map_err(failed)?;
    file.write_all(text.as_bytes()).and_then(|()| file.as_file().sync_all()).map_err(failed)?;
    file.persist(path).map_err(|error| failed(error.error))?;
    Ok(())
}
