//! Files that are whole or not there: written beside, synced and renamed, and the folder synced.

use crate::text::{nearest, printable};
use crate::{Error, Result};
use same_file::Handle;
use std::fs::{File, TryLockError};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// A file beside another is left by a process that was killed if it is older, where the file system has no locks.
const LEFTOVER: Duration = Duration::from_secs(3600);

/// Returns the error of a file that cannot be written.
#[must_use]
pub fn unwritable(path: &Path, error: &io::Error) -> Error {
    let remedy = match error.kind() {
        io::ErrorKind::StorageFull => "Make room on the disk and run it again: what is finished is kept.",
        io::ErrorKind::NotFound => "Check the path.",
        _ => "Allow writing there, and run it again: what is finished is kept.",
    };
    Error::data(format!("cannot be written: {}", printable(&error.to_string())), remedy).in_file(path)
}

/// Returns the error of a file that cannot be read, with the file of a similar name in the same folder, if there is one.
#[must_use]
pub fn unreadable(path: &Path, error: &io::Error) -> Error {
    let message = format!("cannot be read: {}", printable(&error.to_string()));
    let near = || Some(printable(&path.with_file_name(near(path)?).display().to_string()));
    let remedy = match error.kind() {
        io::ErrorKind::NotFound => near().map_or_else(
            || "Check the path; relative paths start at the current folder.".to_owned(),
            |near| format!("Check the path: did you mean {near}?"),
        ),
        io::ErrorKind::PermissionDenied => "Allow reading it, or run as a user who may.".to_owned(),
        _ => "Check the file and its disk; it must be a regular file.".to_owned(),
    };
    Error::data(message, remedy).in_file(path)
}

/// Names of a folder that are looked at for a similar one.
const NAMES_MAX: usize = 10_000;

/// The name in the folder of a path that is most similar to its own, if one is.
fn near(path: &Path) -> Option<String> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let entries = std::fs::read_dir(folder).ok()?.take(NAMES_MAX).flatten();
    let names: Vec<String> = entries.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    let known: Vec<&str> = names.iter().map(String::as_str).collect();
    nearest(path.file_name()?.to_str()?, &known).map(str::to_owned)
}

/// Has the entries of a folder written to the disk, where the system can: a rename then survives a loss of power.
///
/// # Errors
/// Those of the disk, and `NotADirectory` for what is no folder. A folder that may not be opened, and a file system without
/// this order, are none.
pub fn sync_folder(folder: &Path) -> io::Result<()> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    if !cfg!(unix) {
        return Ok(());
    }
    // A pipe would wait for its other end.
    if std::fs::metadata(folder).is_ok_and(|facts| !facts.is_dir()) {
        return Err(io::ErrorKind::NotADirectory.into());
    }
    match File::open(folder).and_then(|folder| folder.sync_all()) {
        Err(error) if matches!(error.kind(), io::ErrorKind::StorageFull | io::ErrorKind::NotFound) => Err(error),
        // EIO has no kind of its own.
        Err(error) if error.raw_os_error() == Some(5) => Err(error),
        _ => Ok(()),
    }
}

/// Returns whether an open file is the one at a path, which is a regular file.
#[must_use]
pub fn is_at(file: &File, path: &Path) -> bool {
    let same = || Ok::<_, io::Error>(Handle::from_file(file.try_clone()?)? == Handle::from_path(path)?);
    // A pipe would wait for its other end.
    let is_file = || std::fs::metadata(path).is_ok_and(|facts| facts.is_file());
    is_file() && same().unwrap_or(false)
}

/// Writes a file to the disk.
///
/// # Errors
/// Those of the disk. A file system without this order is none.
pub fn sync(file: &File) -> io::Result<()> {
    match file.sync_data() {
        Err(error) if matches!(error.kind(), io::ErrorKind::Unsupported | io::ErrorKind::InvalidInput) => Ok(()),
        done => done,
    }
}

/// Replaces a file as a whole. The old one stays until the new one is written and synced; what processes that were killed
/// left of others goes.
///
/// # Errors
/// `Data` when the file cannot be written, and those of `write`; the old file is as it was then.
pub fn replace(path: &Path, write: impl FnOnce(&mut BufWriter<File>) -> Result<()>) -> Result<()> {
    replace_if(path, |file| write(file).map(Some)).map(|_: Option<()>| ())
}

/// Replaces a file as [`replace`] does if `write` returns something; else leaves it as it is.
///
/// # Errors
/// Those of [`replace`].
pub fn replace_if<T>(path: &Path, write: impl FnOnce(&mut BufWriter<File>) -> Result<Option<T>>) -> Result<Option<T>> {
    remove_leftovers(path);
    let failed = |error: io::Error| unwritable(path, &error);
    let beside = Beside::new(path).map_err(failed)?;
    let Some(written) = beside.write(path, write)? else { return Ok(None) };
    std::fs::rename(&beside.path, path).map_err(failed)?;
    sync_folder(path.parent().unwrap_or(path)).map_err(failed)?;
    Ok(Some(written))
}

/// Makes a file where none is: of two writers at once, one gets an error of the kind `AlreadyExists`.
///
/// # Errors
/// Those of the file system; no file is there then that was not there before.
pub fn create(path: &Path, bytes: &[u8]) -> Result<io::Result<()>> {
    use std::io::Write as _;
    let beside = Beside::new(path).map_err(|error| unwritable(path, &error))?;
    beside.write(path, |file| file.write_all(bytes).map(Some).map_err(|error| unwritable(path, &error)))?;
    let placed = match std::fs::hard_link(&beside.path, path) {
        // A file system without links.
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => std::fs::rename(&beside.path, path),
        placed => placed,
    };
    Ok(placed.and_then(|()| sync_folder(path.parent().unwrap_or(path))))
}

/// A file beside another, locked while it is written, and removed unless it was renamed.
struct Beside {
    path: PathBuf,
    file: File,
}

impl Drop for Beside {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

/// The beginning of the names of files beside one; names have at most 255 bytes.
fn beginning(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    format!(".{}.", name.chars().take(50).collect::<String>())
}

impl Beside {
    fn new(path: &Path) -> io::Result<Self> {
        static WRITTEN: AtomicU64 = AtomicU64::new(0);
        loop {
            let number = WRITTEN.fetch_add(1, Ordering::Relaxed);
            let beside = path.with_file_name(format!("{}{}.{number}", beginning(path), std::process::id()));
            let file = match File::create_new(&beside) {
                // Left by a process that had the same number.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
                file => file?,
            };
            // Whoever removes leftovers may have taken it for one before it was locked.
            let is_taken = matches!(file.try_lock(), Err(TryLockError::WouldBlock));
            if !is_taken && is_at(&file, &beside) {
                return Ok(Self { path: beside, file });
            }
        }
    }

    /// Writes and syncs it, unless `write` returns `None`.
    fn write<T>(&self, of: &Path, write: impl FnOnce(&mut BufWriter<File>) -> Result<Option<T>>) -> Result<Option<T>> {
        let failed = |error: io::Error| unwritable(of, &error);
        let mut buffer = BufWriter::with_capacity(1 << 18, self.file.try_clone().map_err(failed)?);
        let Some(written) = write(&mut buffer)? else { return Ok(None) };
        let file = buffer.into_inner().map_err(|error| failed(error.into_error()))?;
        file.sync_all().map_err(failed)?;
        Ok(Some(written))
    }
}

/// Removes files beside one that were left by processes that were killed. One that is being written is locked.
pub fn remove_leftovers(path: &Path) {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let beginning = beginning(path);
    let is_beside = |name: &str| {
        let rest = name.strip_prefix(&beginning).and_then(|rest| rest.split_once('.'));
        rest.is_some_and(|(a, b)| [a, b].iter().all(|n| n.parse::<u64>().is_ok()))
    };
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        if is_beside(&entry.file_name().to_string_lossy()) && is_left(&entry) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

fn is_left(entry: &std::fs::DirEntry) -> bool {
    let age = || entry.metadata().and_then(|facts| facts.modified()).ok()?.elapsed().ok();
    // A pipe would wait for its other end.
    if !entry.file_type().is_ok_and(|kind| kind.is_file()) {
        return false;
    }
    match File::open(entry.path()).map(|file| file.try_lock()) {
        Ok(Ok(())) => true,
        Ok(Err(TryLockError::WouldBlock)) => false,
        _ => age().is_some_and(|age| age > LEFTOVER),
    }
}
