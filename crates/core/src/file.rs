//! Atomic replacement of files: a temporary file in the same folder is written, synced and renamed, then the folder is
//! synced. Temporary files of killed processes are recognized by their missing lock and removed.

use crate::text::{nearest, printable, shell_quoted};
use crate::{Error, Result};
use same_file::Handle;
use std::fs::{File, TryLockError};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Age of a temporary file from which it is taken for one of a killed process on a file system without locks.
const LEFTOVER: Duration = Duration::from_secs(3600);

/// Returns the error for a file that cannot be written.
#[must_use]
pub fn unwritable(path: &Path, error: &io::Error) -> Error {
    let remedy = match error.kind() {
        io::ErrorKind::StorageFull => "Make room on the disk and run it again; finished work is kept.",
        io::ErrorKind::NotFound => "Check the path.",
        _ => "Allow writing there and run it again; finished work is kept.",
    };
    Error::data(format!("cannot be written: {}", printable(&error.to_string())), remedy).in_file(path)
}

/// Returns the error for a file that cannot be read.
#[must_use]
pub fn unreadable(path: &Path, error: &io::Error) -> Error {
    let message = format!("cannot be read: {}", printable(&error.to_string()));
    let remedy = match error.kind() {
        io::ErrorKind::NotFound => "Check the path; relative paths start at the current folder.",
        io::ErrorKind::PermissionDenied => "Allow reading it, or run as a user with permission to read it.",
        _ => "Check the file and its disk; it must be a regular file.",
    };
    Error::data(message, remedy).in_file(path)
}

/// Returns the error with a similar name prepended to its hint, if its file is missing and the folder has one. Front ends
/// call this when they show an error; stored errors must not depend on other files in a folder.
#[must_use]
pub fn with_similar_name(error: Error) -> Error {
    let missing = error.path().filter(|path| !path.exists());
    let Some(similar) = missing.and_then(|path| Some(path.with_file_name(near(path)?))) else { return error };
    error.with_hint_prefix(&format!("Did you mean {}?", shell_quoted(&similar.display().to_string())).into())
}

/// Largest number of names of a folder that are searched for a similar one.
const NAMES_MAX: usize = 10_000;

/// Returns the name in the folder of a path that is most similar to the path's file name, if one is similar.
fn near(path: &Path) -> Option<String> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let entries = std::fs::read_dir(folder).ok()?.take(NAMES_MAX).flatten();
    let names: Vec<String> = entries.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    let known: Vec<&str> = names.iter().map(String::as_str).collect();
    nearest(path.file_name()?.to_str()?, &known).map(str::to_owned)
}

/// Syncs the entries of a folder to the disk, so that a rename survives a loss of power. Does nothing on systems other than
/// Unix.
///
/// # Errors
/// Returns an error if the disk fails or is full, if the folder does not exist, and `NotADirectory` if the path is not a
/// folder. It is not an error if the folder may not be opened or the file system cannot sync folders.
pub fn sync_folder(folder: &Path) -> io::Result<()> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    if !cfg!(unix) {
        return Ok(());
    }
    // Opening a named pipe would block.
    if std::fs::metadata(folder).is_ok_and(|facts| !facts.is_dir()) {
        return Err(io::ErrorKind::NotADirectory.into());
    }
    match File::open(folder).and_then(|folder| folder.sync_all()) {
        Err(error) if matches!(error.kind(), io::ErrorKind::StorageFull | io::ErrorKind::NotFound) => Err(error),
        // EIO has no `ErrorKind`.
        Err(error) if error.raw_os_error() == Some(5) => Err(error),
        _ => Ok(()),
    }
}

/// Returns true if the path names a regular file and an open file is that file.
#[must_use]
pub fn is_at(file: &File, path: &Path) -> bool {
    let same = || Ok::<_, io::Error>(Handle::from_file(file.try_clone()?)? == Handle::from_path(path)?);
    // Opening a named pipe would block.
    let is_file = || std::fs::metadata(path).is_ok_and(|facts| facts.is_file());
    is_file() && same().unwrap_or(false)
}

/// Syncs the data of a file to the disk.
///
/// # Errors
/// Returns the error of the disk. It is not an error if the file system cannot sync.
pub fn sync(file: &File) -> io::Result<()> {
    match file.sync_data() {
        Err(error) if matches!(error.kind(), io::ErrorKind::Unsupported | io::ErrorKind::InvalidInput) => Ok(()),
        done => done,
    }
}

/// Replaces a file atomically: the old content stays until the new one is written and synced. Temporary files of killed
/// processes are removed.
///
/// # Errors
/// Returns a `Data` error if the file cannot be written, and propagates the errors of `write`; the old file is unchanged
/// then.
pub fn replace(path: &Path, write: impl FnOnce(&mut BufWriter<File>) -> Result<()>) -> Result<()> {
    replace_if(path, |file| write(file).map(Some)).map(|_: Option<()>| ())
}

/// Replaces a file like [`replace`] if `write` returns `Some`; otherwise leaves it unchanged.
///
/// # Errors
/// Returns an error in the cases of [`replace`].
pub fn replace_if<T>(path: &Path, write: impl FnOnce(&mut BufWriter<File>) -> Result<Option<T>>) -> Result<Option<T>> {
    remove_leftovers(path);
    let failed = |error: io::Error| unwritable(path, &error);
    let temporary = TemporaryFile::new(path).map_err(failed)?;
    let Some(written) = temporary.write(path, write)? else { return Ok(None) };
    std::fs::rename(&temporary.path, path).map_err(failed)?;
    sync_folder(path.parent().unwrap_or(path)).map_err(failed)?;
    Ok(Some(written))
}

/// Creates a file with a content, atomically. The inner result is an error of the kind `AlreadyExists` if the file exists;
/// of two concurrent writers one gets it. A file system without hard links replaces the file instead.
///
/// # Errors
/// Returns a `Data` error if the content cannot be written; the file is not created then. The inner result has the error
/// of the file system if the written file cannot be moved to its path or the folder cannot be synced.
pub fn create(path: &Path, bytes: &[u8]) -> Result<io::Result<()>> {
    use std::io::Write as _;
    let temporary = TemporaryFile::new(path).map_err(|error| unwritable(path, &error))?;
    temporary.write(path, |file| file.write_all(bytes).map(Some).map_err(|error| unwritable(path, &error)))?;
    let placed = match std::fs::hard_link(&temporary.path, path) {
        // The file system has no hard links.
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => std::fs::rename(&temporary.path, path),
        placed => placed,
    };
    Ok(placed.and_then(|()| sync_folder(path.parent().unwrap_or(path))))
}

/// A temporary file in the folder of its target, locked while it is written and removed on drop unless it was renamed.
struct TemporaryFile {
    path: PathBuf,
    file: File,
}

impl Drop for TemporaryFile {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Returns the prefix of the names of the temporary files for a target, cut because names have at most 255 bytes.
fn name_prefix(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    format!(".{}.", name.chars().take(50).collect::<String>())
}

impl TemporaryFile {
    fn new(path: &Path) -> io::Result<Self> {
        static WRITTEN: AtomicU64 = AtomicU64::new(0);
        loop {
            let number = WRITTEN.fetch_add(1, Ordering::Relaxed);
            let candidate = path.with_file_name(format!("{}{}.{number}", name_prefix(path), std::process::id()));
            let file = match File::create_new(&candidate) {
                // A killed process with the same identifier left it.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
                file => file?,
            };
            // Another process may have removed it as a leftover before it was locked.
            let is_taken = matches!(file.try_lock(), Err(TryLockError::WouldBlock));
            if !is_taken && is_at(&file, &candidate) {
                return Ok(Self { path: candidate, file });
            }
        }
    }

    /// Writes and syncs the file; returns `None` without syncing if `write` does. `of` is the target, named in errors.
    fn write<T>(&self, of: &Path, write: impl FnOnce(&mut BufWriter<File>) -> Result<Option<T>>) -> Result<Option<T>> {
        let failed = |error: io::Error| unwritable(of, &error);
        let mut buffer = BufWriter::with_capacity(1 << 18, self.file.try_clone().map_err(failed)?);
        let Some(written) = write(&mut buffer)? else { return Ok(None) };
        let file = buffer.into_inner().map_err(|error| failed(error.into_error()))?;
        file.sync_all().map_err(failed)?;
        Ok(Some(written))
    }
}

/// Removes the temporary files for a target that killed processes left. Files that are being written are locked and stay.
pub fn remove_leftovers(path: &Path) {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let prefix = name_prefix(path);
    let is_temporary = |name: &str| {
        let rest = name.strip_prefix(&prefix).and_then(|rest| rest.split_once('.'));
        rest.is_some_and(|(a, b)| [a, b].iter().all(|n| n.parse::<u64>().is_ok()))
    };
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        if is_temporary(&entry.file_name().to_string_lossy()) && is_leftover(&entry) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Returns true if no process holds the lock of a temporary file, or if it is old and the file system has no locks.
fn is_leftover(entry: &std::fs::DirEntry) -> bool {
    let age = || entry.metadata().and_then(|facts| facts.modified()).ok()?.elapsed().ok();
    // Opening a named pipe would block.
    if !entry.file_type().is_ok_and(|kind| kind.is_file()) {
        return false;
    }
    match File::open(entry.path()).map(|file| file.try_lock()) {
        Ok(Ok(())) => true,
        Ok(Err(TryLockError::WouldBlock)) => false,
        _ => age().is_some_and(|age| age > LEFTOVER),
    }
}
