//! Results file of a shard: append-only, written under a lock.
//!
//! Each line is a finished run. After a crash of the machine the last line may be incomplete; it is then truncated
//! before anything is appended, and its run is repeated.

use super::head::Head;
use super::lines::{Origin, no_results};
use super::results::{check_regular, complete_lines_end};
use super::shard::Shard;
use motorfit_core::file::{is_at, sync, sync_folder, unwritable};
use motorfit_core::{Error, Result};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Largest size of the lines that wait for space on the disk \[bytes\]; beyond it the session ends.
const WAITING_MAX: usize = 16 << 20;
/// Longest time that lines wait for space on the disk; after it the session ends.
const WAITING_TIME_MAX: Duration = Duration::from_secs(60);
/// Number of attempts to take a lock.
const LOCK_TRIES: usize = 5;
/// Pause between attempts to take a lock.
const LOCK_WAIT: Duration = Duration::from_millis(10);
/// Interval at which the file is synchronized with the disk.
const SYNC: Duration = Duration::from_secs(1);

/// Results file of a shard, open for appending.
pub(super) struct Log {
    file: File,
    path: PathBuf,
    /// Length of the complete lines \[bytes\].
    complete: u64,
    /// Lines that are not written yet.
    waiting: String,
    /// Error of the last attempt to write them.
    fault: Option<std::io::Error>,
    /// Time of the first failed attempt to write them.
    since: Option<Instant>,
    /// Time of the last synchronization with the disk.
    synced: Instant,
    /// Reason why lines that were written are lost.
    gone: Option<Error>,
}

/// Outcome of closing a results file.
#[derive(Default)]
pub(super) struct Closed {
    /// Number of lines that could not be written.
    pub waiting: u64,
    /// True if lines that were written may be lost.
    pub is_gone: bool,
    /// Reason why lines were not written or are lost.
    pub fault: Option<Error>,
}

impl Log {
    /// Opens the file of a shard; a new file is created with its head.
    pub(super) fn open(origin: &Origin<'_>, head: &Head) -> Result<Self> {
        let shard = Shard { index: head.shard[0], count: head.shard[1] };
        let path = origin.folder.join(shard.file());
        let failed = |error: std::io::Error| unwritable(&path, &error);
        check_regular(&path)?;
        let file = OpenOptions::new().read(true).append(true).create(true).open(&path).map_err(failed)?;
        match lock(&file) {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let message = "is being written by another run of this shard";
                return Err(Error::data(message, "Wait for it, or run another shard.").in_file(&path));
            }
            // On a file system without locks a second session cannot be excluded.
            Err(TryLockError::Error(error)) if error.kind() == std::io::ErrorKind::Unsupported => {}
            Err(TryLockError::Error(error)) => return Err(failed(error)),
        }
        let (complete, synced) = (complete_lines_end(&file).map_err(failed)?, Instant::now());
        let line = head.line();
        if complete > 0 {
            Head::read(&path, origin, shard)?;
        } else if !is_beginning(&path, &line) {
            return Err(no_results(&path));
        }
        // An incomplete last line is truncated.
        file.set_len(complete).map_err(failed)?;
        let mut log =
            Self { file, path, complete, waiting: String::new(), fault: None, since: None, synced, gone: None };
        if complete == 0 {
            if !log.add(&line) {
                let fault = log.fault.take().unwrap_or_else(|| std::io::ErrorKind::StorageFull.into());
                return Err(unwritable(&log.path, &fault));
            }
            sync_folder(origin.folder).map_err(|error| unwritable(&log.path, &error))?;
        }
        Ok(log)
    }

    /// Appends lines. If the disk is full they wait for the next call. Returns true if no lines wait.
    pub(super) fn add(&mut self, lines: &str) -> bool {
        self.waiting.push_str(lines);
        if self.waiting.is_empty() {
            return true;
        }
        match self.file.write_all(self.waiting.as_bytes()) {
            Ok(()) => {
                self.complete += self.waiting.len() as u64;
                self.waiting.clear();
                (self.fault, self.since) = (None, None);
            }
            Err(error) => {
                self.fault = Some(error);
                self.since.get_or_insert_with(Instant::now);
                // Some of the lines may have been written: complete lines are kept, the rest is truncated.
                let before = self.complete;
                let kept = complete_lines_end(&self.file).unwrap_or(before).max(before);
                self.complete = kept;
                let _ = self.file.set_len(kept);
                let taken = usize::try_from(kept - before).unwrap_or(0).min(self.waiting.len());
                self.waiting.drain(..taken);
                return false;
            }
        }
        if self.synced.elapsed() > SYNC {
            // Runs that a crash of the machine loses are repeated.
            self.check();
            self.synced = Instant::now();
        }
        true
    }

    /// Returns true if the session must end: too many lines wait, they have waited too long, or written lines are lost.
    pub(super) fn is_stuck(&self) -> bool {
        self.gone.is_some()
            || self.waiting.len() > WAITING_MAX
            || self.since.is_some_and(|since| since.elapsed() > WAITING_TIME_MAX)
    }

    /// Synchronizes the file with the disk and checks that the file at the path is the open one with all its lines. A
    /// removed file is created anew.
    fn check(&mut self) {
        let synced = sync(&self.file).map_err(|error| unwritable(&self.path, &error));
        self.gone = self.gone.take().or_else(|| synced.and_then(|()| self.kept()).err());
    }

    fn kept(&mut self) -> Result<()> {
        let was = |what: &str, why: &str| {
            let remedy = "Run it again: missing runs are repeated. Do not change the folder meanwhile.";
            Error::data(format!("was {what} while it was being written{why}"), remedy).in_file(&self.path)
        };
        if self.file.metadata().is_ok_and(|facts| facts.len() < self.complete) {
            return Err(was("shortened", ""));
        }
        if is_at(&self.file, &self.path) {
            return Ok(());
        }
        let anew = |path: &Path| {
            let mut anew = OpenOptions::new().read(true).append(true).create_new(true).open(path)?;
            let _ = lock(&anew);
            (&self.file).rewind()?;
            std::io::copy(&mut (&self.file).take(self.complete), &mut anew)?;
            sync(&anew)?;
            sync_folder(path.parent().unwrap_or(path))?;
            Ok::<_, std::io::Error>(anew)
        };
        match anew(&self.path) {
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => return Err(was("replaced", "")),
            Err(error) => return Err(was("removed", &format!(", and cannot be created anew: {error}"))),
            Ok(anew) => self.file = anew,
        }
        Ok(())
    }

    /// Tries once more to write the lines that wait, and closes the file.
    pub(super) fn close(mut self) -> Closed {
        let is_written = self.add("");
        self.check();
        let waiting = if is_written { 0 } else { self.waiting.matches('\n').count() as u64 };
        let fault = self.gone.take();
        let is_gone = fault.is_some();
        Closed { waiting, is_gone, fault: fault.or_else(|| self.fault.as_ref().map(|e| unwritable(&self.path, e))) }
    }
}

/// Takes the lock of a file. A status query holds it for an instant, hence several attempts.
fn lock(file: &File) -> std::result::Result<(), TryLockError> {
    for _ in 0..LOCK_TRIES {
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => std::thread::sleep(LOCK_WAIT),
            done => return done,
        }
    }
    file.try_lock()
}

/// Returns true if a file consists of an incomplete first line only.
fn is_beginning(path: &Path, line: &str) -> bool {
    let mut found = Vec::new();
    let read = File::open(path).and_then(|file| file.take(line.len() as u64 + 1).read_to_end(&mut found));
    read.is_ok() && line.as_bytes().starts_with(&found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::results::files;

    const SECOND: Shard = Shard { index: 1, count: 2 };

    fn open(folder: &Path, manifest: &str) -> Result<Log> {
        Log::open(&Origin { folder, manifest, is_of: Box::new(|_| true) }, &Head::new(manifest, SECOND))
    }

    fn line(id: u64) -> String {
        use crate::sweep::machine::ModelTexts;
        use crate::sweep::study::Study;
        let study = Study::parse(
            "methods = [\"sm\"]\nrecordings = [\"a\"]\nseeds = \"1..9\"",
            Path::new("s.toml"),
            ModelTexts::Known(&[]),
        )
        .unwrap();
        let runs = crate::sweep::runs::Runs::new(study.clone(), 1);
        let outcome = crate::sweep::sample::sample();
        crate::sweep::line::line(&study, &runs.job(id), "m", &outcome, 0.1)
    }

    fn ids(folder: &Path) -> Vec<u64> {
        let mut ids = Vec::new();
        for found in files(&Origin { folder, manifest: "m", is_of: Box::new(|_| true) }).unwrap() {
            found.scan(|place| ids.push(place.row.id)).unwrap();
        }
        ids
    }

    #[test]
    fn an_incomplete_line_is_truncated_and_a_second_writer_excluded() {
        let folder = tempfile::tempdir().unwrap();
        let mut log = open(folder.path(), "m").unwrap();
        assert!(log.add(&(line(0) + &line(1))));
        let second = open(folder.path(), "m").err().unwrap();
        assert!(second.to_string().contains("another run of this shard"), "{second}");
        assert_eq!(log.close().waiting, 0);
        let path = folder.path().join("results-1-of-2.jsonl");
        let whole = std::fs::read(&path).unwrap();
        // Complete lines survive a cut at any byte.
        for cut in 1..whole.len() {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let mut log = open(folder.path(), "m").unwrap();
            assert!(log.add(&line(7)));
            drop(log);
            let lines = whole[..cut].iter().filter(|b| **b == b'\n').count();
            let expected: Vec<u64> = (0..lines.saturating_sub(1) as u64).chain([7]).collect();
            assert_eq!(ids(folder.path()), expected, "cut at {cut}");
        }
        std::fs::write(&path, whole).unwrap();
        let other = open(folder.path(), "another").err().unwrap();
        assert!(other.to_string().contains("results of another study"), "{other}");
    }
}
