//! The folder of `--out`. Its files are replaced as a unit, and files that this program did not write are never changed.
//!
//! New files are written and synced in a staging folder inside it, which is then renamed to [`COMMITTED`]; the rename commits
//! the new report. Its files are then moved to their final names, the index last. If a run is killed after the commit, the next
//! run that uses the folder completes the moves; if it is killed before, the old files are unchanged.

use motorfit::file::sync_folder;
use motorfit::text::{hexadecimal, printable};
use motorfit::{Error, Result};
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// Name of the index, which lists the files of a report.
const INDEX: &str = "motorfit-files.json";
/// Prefix of the staging folder's name, which the process id completes.
const STAGED: &str = ".motorfit-staged-";
/// Name of the folder of complete files that are being moved to their final names.
const COMMITTED: &str = ".motorfit-new";
/// Name of the file in the staging folder that the writing process locks.
const LOCK: &str = ".lock";

/// The index: the files of a report with their digests.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Index {
    /// The version of the program that wrote them.
    motorfit: String,
    files: BTreeMap<String, Entry>,
}

/// Size and digest of a file.
#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Entry {
    bytes: u64,
    sha256: String,
}

impl Entry {
    fn of(bytes: &[u8]) -> Self {
        Self { bytes: bytes.len() as u64, sha256: hexadecimal(&Sha256::digest(bytes)) }
    }

    /// Returns true if a file is unchanged since it was written.
    fn is_of(&self, path: &Path) -> bool {
        path.metadata().is_ok_and(|data| data.is_file() && data.len() == self.bytes)
            && std::fs::read(path).is_ok_and(|bytes| Self::of(&bytes) == *self)
    }
}

impl Index {
    /// Returns the index of a folder, or `None` if it has none. Names that lead out of the folder are ignored.
    fn read(folder: &Path) -> Option<Self> {
        let text = std::fs::read_to_string(folder.join(INDEX)).ok()?;
        let mut index: Self = serde_json::from_str(&text).ok()?;
        index.files.retain(|name, _| is_name(name));
        Some(index)
    }
}

/// Returns true if a name is a plain file name and none of those reserved here.
fn is_name(name: &str) -> bool {
    let path = Path::new(name);
    path.file_name() == Some(path.as_os_str()) && ![INDEX, COMMITTED, LOCK].contains(&name)
}

/// Returns true if this program wrote a file of a folder: the index lists it or, without an index, the folder has a page or
/// document of a version that wrote none.
pub(super) fn is_ours(folder: &Path, name: &str) -> bool {
    if let Some(index) = Index::read(folder) {
        return index.files.contains_key(name);
    }
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap_or_default();
    let document = || serde_json::from_str::<serde_json::Value>(&read("result.json")).unwrap_or_default();
    document()["motorfit"].is_string() || read("report.html").contains("content=\"motorfit ")
}

/// Completes the report of a run that was killed after its commit, and removes staging folders of runs that were killed before.
pub(super) fn recover(folder: &Path) -> std::io::Result<()> {
    move_in(folder)?;
    for entry in std::fs::read_dir(folder)?.flatten() {
        if !entry.file_name().to_string_lossy().starts_with(STAGED) {
            continue;
        }
        // Without a lock file the folder was just created, or its writer was killed before it locked it: it is empty.
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

/// Replaces the files that the index of a folder lists by the (name, text) pairs of `files`.
pub(super) fn replace_all(folder: &Path, files: &[(String, String)]) -> Result<()> {
    let failed = |error: std::io::Error| {
        let remedy =
            "The files in it are unchanged. Free disk space, allow writing to the folder, or name another one.";
        Error::data(format!("cannot be written: {}", printable(&error.to_string())), remedy).in_file(folder)
    };
    let staged = Staged::new(folder).map_err(failed)?;
    staged.write(files).map_err(failed)?;
    staged.commit(folder).map_err(failed)?;
    move_in(folder).map_err(failed)
}

/// A staging folder, which is removed unless it is committed.
struct Staged {
    path: PathBuf,
    /// Lock that is kept until the commit.
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
        // A killed process with the same id may have left one.
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir(&path)?;
        let lock = File::create(path.join(LOCK))?;
        // This fails on file systems without locks; there the user must not start two runs into one folder.
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

    /// Commits the files: renames the staging folder and syncs.
    fn commit(self, folder: &Path) -> std::io::Result<()> {
        let committed = folder.join(COMMITTED);
        if committed.exists() {
            // It is left by another run into this folder, which was killed or is not complete yet.
            move_in(folder)?;
        }
        std::fs::rename(&self.path, &committed)?;
        let _ = self.lock.unlock();
        sync_folder(folder)
    }
}

/// Moves committed files to their final names, removes unchanged files that only the old index lists, moves the index, and
/// removes the folder of committed files after a sync.
fn move_in(folder: &Path) -> std::io::Result<()> {
    let committed = folder.join(COMMITTED);
    if !committed.is_dir() {
        return Ok(());
    }
    // The index is moved last. If it is already moved, a power failure may have left files that it lists.
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

/// Moves a file. It is no error if the file is missing, since a killed or concurrent run may have moved it.
fn moved(from: &Path, to: &Path, name: &str) -> std::io::Result<()> {
    match std::fs::rename(from.join(name), to.join(name)) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(()),
        done => done,
    }
}
