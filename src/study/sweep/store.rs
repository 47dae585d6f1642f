//! Results of a shard: a file that lines are only ever added to, under a lock.
//!
//! A line is a finished run. The last may be torn where a machine was switched off; what is torn is cut off before
//! anything is added, and its run is done again.

use super::head::{Head, Origin};
use super::results::{check_regular, no_results, whole_lines};
use super::shard::Shard;
use crate::file::{is_at, sync, sync_folder, unwritable};
use crate::{Error, Result};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Lines that wait for a disk with room, in bytes, and for how long; then the run ends.
const WAITING_MAX: usize = 16 << 20;
const PATIENCE: Duration = Duration::from_secs(60);
/// The number of tries of a lock, and the pause between them.
const LOCK_TRIES: usize = 5;
const LOCK_WAIT: Duration = Duration::from_millis(10);
/// Time between orders to write to the disk itself.
const SYNC: Duration = Duration::from_secs(1);

/// The file of a shard, open for adding.
pub(super) struct Log {
    file: File,
    path: PathBuf,
    /// Bytes of whole lines.
    whole: u64,
    /// Lines that could not be written yet, and why.
    waiting: String,
    fault: Option<std::io::Error>,
    since: Option<Instant>,
    synced: Instant,
    /// Why what was written is not to be found again.
    gone: Option<Error>,
}

/// A results file that is closed.
#[derive(Default)]
pub(super) struct Closed {
    /// Lines that could not be written.
    pub waiting: u64,
    /// True if lines that were written may not be there.
    pub is_gone: bool,
    /// Why.
    pub fault: Option<Error>,
}

impl Log {
    /// Opens the file of a shard, made with its head where it is new.
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
            // A file system without locks: nothing keeps a second run out.
            Err(TryLockError::Error(error)) if error.kind() == std::io::ErrorKind::Unsupported => {}
            Err(TryLockError::Error(error)) => return Err(failed(error)),
        }
        let (whole, synced) = (whole_lines(&file).map_err(failed)?, Instant::now());
        let line = head.line();
        if whole > 0 {
            Head::read(&path, origin, shard)?;
        } else if !is_beginning(&path, &line) {
            return Err(no_results(&path));
        }
        // An incomplete last line is cut off.
        file.set_len(whole).map_err(failed)?;
        let mut log = Self { file, path, whole, waiting: String::new(), fault: None, since: None, synced, gone: None };
        if whole == 0 {
            if !log.add(&line) {
                let fault = log.fault.take().unwrap_or_else(|| std::io::ErrorKind::StorageFull.into());
                return Err(unwritable(&log.path, &fault));
            }
            sync_folder(origin.folder).map_err(|error| unwritable(&log.path, &error))?;
        }
        Ok(log)
    }

    /// Adds lines. Where the disk has no room for them they wait for the next. Returns whether none wait.
    pub(super) fn add(&mut self, lines: &str) -> bool {
        self.waiting.push_str(lines);
        if self.waiting.is_empty() {
            return true;
        }
        match self.file.write_all(self.waiting.as_bytes()) {
            Ok(()) => {
                self.whole += self.waiting.len() as u64;
                self.waiting.clear();
                (self.fault, self.since) = (None, None);
            }
            Err(error) => {
                self.fault = Some(error);
                self.since.get_or_insert_with(Instant::now);
                // A part of them may have been written: whole lines of it are kept, the rest is cut off.
                let before = self.whole;
                let kept = whole_lines(&self.file).unwrap_or(before).max(before);
                self.whole = kept;
                let _ = self.file.set_len(kept);
                let taken = usize::try_from(kept - before).unwrap_or(0).min(self.waiting.len());
                self.waiting.drain(..taken);
                return false;
            }
        }
        if self.synced.elapsed() > SYNC {
            // What a crash of the machine loses is done again.
            self.check();
            self.synced = Instant::now();
        }
        true
    }

    /// Returns whether going on makes no sense: too much waits, or what was written is gone.
    pub(super) fn is_stuck(&self) -> bool {
        self.gone.is_some()
            || self.waiting.len() > WAITING_MAX
            || self.since.is_some_and(|since| since.elapsed() > PATIENCE)
    }

    /// Has the lines written to the disk, and looks whether the file at the path is the one that is open, with all of
    /// them. One that was removed is made anew.
    fn check(&mut self) {
        let synced = sync(&self.file).map_err(|error| unwritable(&self.path, &error));
        self.gone = self.gone.take().or_else(|| synced.and_then(|()| self.kept()).err());
    }

    fn kept(&mut self) -> Result<()> {
        let was = |what: &str, why: &str| {
            let remedy = "Run it again: runs that are missing are done once more. Leave the folder alone meanwhile.";
            Error::data(format!("was {what} while it was being written{why}"), remedy).in_file(&self.path)
        };
        if self.file.metadata().is_ok_and(|facts| facts.len() < self.whole) {
            return Err(was("shortened", ""));
        }
        if is_at(&self.file, &self.path) {
            return Ok(());
        }
        let anew = |path: &Path| {
            let mut anew = OpenOptions::new().read(true).append(true).create_new(true).open(path)?;
            let _ = lock(&anew);
            (&self.file).rewind()?;
            std::io::copy(&mut (&self.file).take(self.whole), &mut anew)?;
            sync(&anew)?;
            sync_folder(path.parent().unwrap_or(path))?;
            Ok::<_, std::io::Error>(anew)
        };
        match anew(&self.path) {
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => return Err(was("replaced", "")),
            Err(error) => return Err(was("removed", &format!(", and cannot be made anew: {error}"))),
            Ok(anew) => self.file = anew,
        }
        Ok(())
    }

    /// The last try.
    pub(super) fn close(mut self) -> Closed {
        let is_written = self.add("");
        self.check();
        let waiting = if is_written { 0 } else { self.waiting.matches('\n').count() as u64 };
        let fault = self.gone.take();
        let is_gone = fault.is_some();
        Closed { waiting, is_gone, fault: fault.or_else(|| self.fault.as_ref().map(|e| unwritable(&self.path, e))) }
    }
}

/// Takes the lock of a file. Whoever only asks whether it is taken has it for an instant, which is waited for.
fn lock(file: &File) -> std::result::Result<(), TryLockError> {
    for _ in 0..LOCK_TRIES {
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => std::thread::sleep(LOCK_WAIT),
            done => return done,
        }
    }
    file.try_lock()
}

/// Returns whether a file holds nothing but the beginning of its first line, which was torn.
fn is_beginning(path: &Path, line: &str) -> bool {
    let mut found = Vec::new();
    let read = File::open(path).and_then(|file| file.take(line.len() as u64 + 1).read_to_end(&mut found));
    read.is_ok() && line.as_bytes().starts_with(&found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::sweep::results::files;

    const SECOND: Shard = Shard { index: 1, count: 2 };

    fn open(folder: &Path, manifest: &str) -> Result<Log> {
        Log::open(&Origin { folder, manifest, is_of: Box::new(|_| true) }, &Head::new(manifest, SECOND))
    }

    fn line(id: u64) -> String {
        use crate::study::sweep::study::Study;
        let study =
            Study::parse("methods = [\"sm\"]\nrecordings = [\"a\"]\nseeds = \"1..9\"", Path::new("s.toml")).unwrap();
        let runs = crate::study::sweep::runs::Runs::new(study.clone(), 1);
        let outcome = crate::study::sweep::sample::sample();
        crate::study::sweep::line::line(&study, &runs.job(id), "m", &outcome, 0.1)
    }

    fn ids(folder: &Path) -> Vec<u64> {
        let mut ids = Vec::new();
        for found in files(&Origin { folder, manifest: "m", is_of: Box::new(|_| true) }).unwrap() {
            found.scan(|place| ids.push(place.row.id)).unwrap();
        }
        ids
    }

    #[test]
    fn a_torn_line_is_cut_off_and_a_second_writer_kept_out() {
        let folder = tempfile::tempdir().unwrap();
        let mut log = open(folder.path(), "m").unwrap();
        assert!(log.add(&(line(0) + &line(1))));
        let second = open(folder.path(), "m").err().unwrap();
        assert!(second.to_string().contains("another run of this shard"), "{second}");
        assert_eq!(log.close().waiting, 0);
        let path = folder.path().join("results-1-of-2.jsonl");
        let whole = std::fs::read(&path).unwrap();
        // Cut at every byte: whole lines stay, the rest goes.
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
