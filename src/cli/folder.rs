//! The folder of `--out`: its files are replaced as a unit, and files of others are never touched.
//!
//! New files are written and synced in a folder inside it, which is then renamed to [`COMMITTED`]: from there on the new
//! state counts. Its files are moved to their places, the index last. A run that was killed in between is finished by the
//! next one that takes the folder, and one that was killed before leaves the old files as they were.

use motorfit::file::sync_folder;
use motorfit::text::{hexadecimal, printable};
use motorfit::{Error, Result};
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// The list of the files of a report.
const INDEX: &str = "motorfit-files.json";
/// Files of a report that are being written, and those that are whole and being moved.
const STAGED: &str = ".motorfit-staged-";
const COMMITTED: &str = ".motorfit-new";
/// A file in the folder of staged files, locked by who writes them.
const LOCK: &str = ".lock";

/// The files of a report with their digests.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Index {
    /// The version of the program that wrote them.
    motorfit: String,
    files: BTreeMap<String, Entry>,
}

/// One file.
#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Entry {
    bytes: u64,
    sha256: String,
}

impl Entry {
    fn of(bytes: &[u8]) -> Self {
        Self { bytes: bytes.len() as u64, sha256: hexadecimal(&Sha256::digest(bytes)) }
    }

    /// Returns whether a file is as it was written.
    fn is_of(&self, path: &Path) -> bool {
        path.metadata().is_ok_and(|data| data.is_file() && data.len() == self.bytes)
            && std::fs::read(path).is_ok_and(|bytes| Self::of(&bytes) == *self)
    }
}

impl Index {
    /// The index of a folder; an empty one where there is none. Names that lead out of the folder are not followed.
    fn read(folder: &Path) -> Option<Self> {
        let text = std::fs::read_to_string(folder.join(INDEX)).ok()?;
        let mut index: Self = serde_json::from_str(&text).ok()?;
        index.files.retain(|name, _| is_name(name));
        Some(index)
    }
}

/// Returns whether a name is that of a file in the folder itself.
fn is_name(name: &str) -> bool {
    let path = Path::new(name);
    path.file_name() == Some(path.as_os_str()) && ![INDEX, COMMITTED, LOCK].contains(&name)
}

/// Returns whether a file of a folder was written by this program: the index lists it, or it is a page or a document of a
/// version that wrote no index.
pub(super) fn is_ours(folder: &Path, name: &str) -> bool {
    if let Some(index) = Index::read(folder) {
        return index.files.contains_key(name);
    }
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap_or_default();
    let document = || serde_json::from_str::<serde_json::Value>(&read("result.json")).unwrap_or_default();
    document()["motorfit"].is_string() || read("report.html").contains("content=\"motorfit ")
}

/// Finishes what a run that was killed had begun, and removes what one left that had not come so far.
pub(super) fn recover(folder: &Path) -> std::io::Result<()> {
    move_in(folder)?;
    for entry in std::fs::read_dir(folder)?.flatten() {
        if !entry.file_name().to_string_lossy().starts_with(STAGED) {
            continue;
        }
        // One without a lock was made this instant, or its writer was killed before it took it: it is empty.
        let is_left = match File::open(entry.path().join(LOCK)) {
            Ok(lock) => lock.try_lock().is_ok(),
            Err(_) => std::fs::remove_dir(entry.path()).is_ok(),
        };
        if is_left {
            let _ = std::fs::remove_dir_all(entry.path());
        }
    }
    Ok(())
}

/// Replaces the files that the index of a folder lists by others.
pub(super) fn replace_all(folder: &Path, files: &[(String, String)]) -> Result<()> {
    let failed = |error: std::io::Error| {
        let remedy =
            "The files that were there are as they were. Make room or allow writing there, or name another folder.";
        Error::data(format!("cannot be written: {}", printable(&error.to_string())), remedy).in_file(folder)
    };
    let staged = Staged::new(folder).map_err(failed)?;
    staged.write(files).map_err(failed)?;
    staged.commit(folder).map_err(failed)?;
    move_in(folder).map_err(failed)
}

/// A folder of files that are being written; what is not committed is removed.
struct Staged {
    path: PathBuf,
    /// Locked for as long as it is written.
    lock: File,
}

impl Drop for Staged {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.path);
    }
}

impl Staged {
    fn new(folder: &Path) -> std::io::Result<Self> {
        let path = folder.join(format!("{STAGED}{}", std::process::id()));
        // One of a process that had the same number and was killed.
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir(&path)?;
        let lock = File::create(path.join(LOCK))?;
        // A file system without locks: then two runs into one folder at once are up to the user.
        let _ = lock.try_lock();
        Ok(Self { path, lock })
    }

    /// Writes the files and their index, all synced.
    fn write(&self, files: &[(String, String)]) -> std::io::Result<()> {
        let write = |name: &str, text: &str| {
            let mut file = File::create(self.path.join(name))?;
            file.write_all(text.as_bytes())?;
            file.sync_all()
        };
        files.iter().try_for_each(|(name, text)| write(name, text))?;
        let entries = files.iter().map(|(name, text)| (name.clone(), Entry::of(text.as_bytes())));
        let index = Index { motorfit: env!("CARGO_PKG_VERSION").to_owned(), files: entries.collect() };
        write(INDEX, &(serde_json::to_string_pretty(&index)? + "\n"))?;
        sync_folder(&self.path)
    }

    /// Makes the new state count.
    fn commit(self, folder: &Path) -> std::io::Result<()> {
        let committed = folder.join(COMMITTED);
        if committed.exists() {
            // Of another run into the same folder, which was killed or is not quite done.
            move_in(folder)?;
        }
        std::fs::rename(&self.path, &committed)?;
        let _ = self.lock.unlock();
        sync_folder(folder)
    }
}

/// Moves files that are committed to their places, removes those that the index listed before and lists no more if nobody
/// has changed them, then moves the index, and removes the folder when all is on the disk.
fn move_in(folder: &Path) -> std::io::Result<()> {
    let committed = folder.join(COMMITTED);
    if !committed.is_dir() {
        return Ok(());
    }
    // The index goes last; where it has gone, files that a loss of power left behind are still those it lists.
    let new = Index::read(&committed).or_else(|| Index::read(folder)).unwrap_or_default();
    for name in new.files.keys() {
        moved(&committed, folder, name)?;
    }
    let old = Index::read(folder).unwrap_or_default();
    for (name, entry) in old.files.iter().filter(|(name, _)| !new.files.contains_key(*name)) {
        if entry.is_of(&folder.join(name)) {
            std::fs::remove_file(folder.join(name))?;
        }
    }
    moved(&committed, folder, INDEX)?;
    sync_folder(folder)?;
    let _ = std::fs::remove_file(committed.join(LOCK));
    match std::fs::remove_dir(&committed) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Moves a file, unless it was moved before a run was killed, or another run has just done it.
fn moved(from: &Path, to: &Path, name: &str) -> std::io::Result<()> {
    match std::fs::rename(from.join(name), to.join(name)) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(()),
        done => done,
    }
}
