//! Results of a shard: a file that lines are only ever added to, under a lock; and all shards read back.
//!
//! A line is a finished run. The last may be torn where a machine was switched off; what is torn is cut off before
//! anything is added, and its run is done again.

use super::line::{Row, split};
use super::manifest::FORMAT;
use super::shard::Shard;
use crate::text::printable;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufRead as _, BufReader, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// What a results file begins with.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Head {
    pub motorfit: String,
    pub format: u32,
    /// The digest of the manifest that it belongs to.
    pub manifest: String,
    /// Which shard, of how many.
    pub shard: [u64; 2],
    /// The class of instructions: another may round otherwise.
    pub instructions: String,
}

/// Lines that wait for a disk with room, in bytes, and for how long; then the run ends.
const WAITING_MAX: usize = 16 << 20;
const PATIENCE: Duration = Duration::from_secs(60);
/// How often, and with what pauses, a lock is tried.
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
}

impl Log {
    /// Opens the file of a shard, made with its head where it is new.
    pub(super) fn open(folder: &Path, head: &Head) -> Result<Self> {
        let shard = Shard { index: head.shard[0], count: head.shard[1] };
        let path = folder.join(shard.file());
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
        let mut log =
            Self { file, path, whole: 0, waiting: String::new(), fault: None, since: None, synced: Instant::now() };
        log.whole = whole_lines(&log.file).map_err(|error| unwritable(&log.path, &error))?;
        let line = serde_json::to_string(head).unwrap_or_default() + "\n";
        if log.whole > 0 {
            check_head(&log.path, &head.manifest)?;
        } else if !is_beginning(&log.path, &line) {
            return Err(no_results(&log.path));
        }
        // What is no whole line is cut off.
        log.file.set_len(log.whole).map_err(|error| unwritable(&log.path, &error))?;
        if log.whole == 0 && !log.add(&line) {
            let fault = log.fault.take().unwrap_or_else(|| std::io::ErrorKind::StorageFull.into());
            return Err(unwritable(&log.path, &fault));
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
            let _ = self.file.sync_data();
            self.synced = Instant::now();
        }
        true
    }

    /// Whether so much waits that going on makes no sense.
    pub(super) fn is_stuck(&self) -> bool {
        self.waiting.len() > WAITING_MAX || self.since.is_some_and(|since| since.elapsed() > PATIENCE)
    }

    /// The last try; returns how many lines are lost, and why.
    pub(super) fn close(mut self) -> (u64, Option<Error>) {
        if self.add("") {
            let _ = self.file.sync_all();
            return (0, None);
        }
        let lost = self.waiting.matches('\n').count() as u64;
        (lost, self.fault.as_ref().map(|error| unwritable(&self.path, error)))
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

/// Whether a file holds nothing but the beginning of its first line, which was torn.
fn is_beginning(path: &Path, line: &str) -> bool {
    let mut found = Vec::new();
    let read = File::open(path).and_then(|file| file.take(line.len() as u64 + 1).read_to_end(&mut found));
    read.is_ok() && line.as_bytes().starts_with(&found)
}

/// Refuses what is there but no regular file: to open a pipe would wait for its other end.
fn check_regular(path: &Path) -> Result<()> {
    match std::fs::metadata(path) {
        Ok(facts) if !facts.is_file() => {
            let message = "is no regular file, expected one of results";
            Err(Error::data(message, "Move it away; its runs will be done again.").in_file(path))
        }
        _ => Ok(()),
    }
}

fn no_results(path: &Path) -> Error {
    Error::data("is no results file", "Move it away; its runs will be done again.").in_file(path).at_line(1)
}

pub(crate) fn unwritable(path: &Path, error: &std::io::Error) -> Error {
    let remedy = match error.kind() {
        std::io::ErrorKind::StorageFull => "Make room on the disk and run it again: what is finished is kept.",
        std::io::ErrorKind::NotFound => "Check the path.",
        _ => "Allow writing there, and run it again: what is finished is kept.",
    };
    Error::data(format!("cannot be written: {}", printable(&error.to_string())), remedy).in_file(path)
}

/// Where the last whole line of a file ends.
fn whole_lines(mut file: &File) -> std::io::Result<u64> {
    let mut end = file.seek(SeekFrom::End(0))?;
    let mut piece = vec![0; 64 << 10];
    while end > 0 {
        let start = end.saturating_sub(piece.len() as u64);
        let length = usize::try_from(end - start).unwrap_or(0);
        file.seek(SeekFrom::Start(start))?;
        file.read_exact(&mut piece[..length])?;
        if let Some(at) = memchr::memrchr(b'\n', &piece[..length]) {
            return Ok(start + at as u64 + 1);
        }
        end = start;
    }
    Ok(0)
}

/// The head of a results file, which must belong to a manifest.
fn check_head(path: &Path, manifest: &str) -> Result<Head> {
    let file = File::open(path).map_err(|error| unreadable(path, &error))?;
    let mut line = String::new();
    let _ = BufReader::new(file).take(1 << 16).read_line(&mut line);
    let wrong = |message: &str, remedy: &str| Err(Error::data(message, remedy).in_file(path).at_line(1));
    match serde_json::from_str::<Head>(&line) {
        Ok(head) if head.manifest == manifest && head.format == FORMAT => Ok(head),
        Ok(head) if head.format != FORMAT => {
            wrong("is of another version of this program", "Use that version, or plan the study again in a new folder.")
        }
        Ok(_) => wrong("holds results of another study", "Move it away, or run the study it belongs to."),
        Err(_) => Err(no_results(path)),
    }
}

pub(super) fn unreadable(path: &Path, error: &std::io::Error) -> Error {
    let remedy = match error.kind() {
        std::io::ErrorKind::NotFound => "Check the path.",
        std::io::ErrorKind::PermissionDenied => "Allow reading it.",
        _ => "Give the file that is meant, as text in UTF-8.",
    };
    Error::data(format!("cannot be read: {}", printable(&error.to_string())), remedy).in_file(path)
}

/// A results file as it was found.
pub(super) struct ResultsFile {
    pub path: PathBuf,
    pub shard: Shard,
    pub head: Head,
}

/// The results files of a folder.
pub(super) fn files(folder: &Path, manifest: &str) -> Result<Vec<ResultsFile>> {
    let entries = std::fs::read_dir(folder).map_err(|error| unreadable(folder, &error))?;
    let mut found = Vec::new();
    for entry in entries.flatten() {
        let Some(shard) = entry.file_name().to_str().and_then(Shard::of_file) else { continue };
        let path = entry.path();
        check_regular(&path)?;
        // One that was only just made has no head yet.
        let whole = File::open(&path).and_then(|file| whole_lines(&file)).map_err(|error| unreadable(&path, &error))?;
        if whole > 0 {
            found.push(ResultsFile { head: check_head(&path, manifest)?, path, shard });
        }
    }
    found.sort_by_key(|found| (found.shard.count, found.shard.index));
    Ok(found)
}

/// A line of a results file: where it stands, and of which run it is.
pub(super) struct Place {
    pub offset: u64,
    pub length: u32,
    pub row: Row,
}

/// Sees every whole line of a results file; returns how many could not be read.
pub(super) fn scan(path: &Path, mut see: impl FnMut(Place)) -> Result<u64> {
    scan_lines(path, |place, _| see(place))
}

/// The same with the bytes of the line.
pub(super) fn scan_lines(path: &Path, mut see: impl FnMut(Place, &[u8])) -> Result<u64> {
    let failed = |error: std::io::Error| unreadable(path, &error);
    let mut reader = BufReader::with_capacity(1 << 18, File::open(path).map_err(failed)?);
    let (mut line, mut offset, mut damaged) = (Vec::new(), 0_u64, 0);
    loop {
        line.clear();
        let length = reader.read_until(b'\n', &mut line).map_err(failed)?;
        if !line.ends_with(b"\n") {
            // The end, or a line that is being written or was torn.
            return Ok(damaged);
        }
        if offset > 0 {
            match (row(&line), u32::try_from(length)) {
                (Some(row), Ok(length)) => see(Place { offset, length, row }, &line),
                _ => damaged += 1,
            }
        }
        offset += length as u64;
    }
}

/// What a line says, if it is whole.
pub(super) fn row(line: &[u8]) -> Option<Row> {
    let (result, _) = split(std::str::from_utf8(line).ok()?.trim_end())?;
    serde_json::from_str(&result).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(manifest: &str) -> Head {
        let (motorfit, instructions) = ("0".to_owned(), "AVX2".to_owned());
        Head { motorfit, format: FORMAT, manifest: manifest.to_owned(), shard: [1, 2], instructions }
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
        for found in files(folder, "m").unwrap() {
            scan(&found.path, |place| ids.push(place.row.id)).unwrap();
        }
        ids
    }

    #[test]
    fn a_torn_line_is_cut_off_and_a_second_writer_kept_out() {
        let folder = tempfile::tempdir().unwrap();
        let mut log = Log::open(folder.path(), &head("m")).unwrap();
        assert!(log.add(&(line(0) + &line(1))));
        let second = Log::open(folder.path(), &head("m")).err().unwrap();
        assert!(second.to_string().contains("another run of this shard"), "{second}");
        assert_eq!(log.close().0, 0);
        let path = folder.path().join("results-1-of-2.jsonl");
        let whole = std::fs::read(&path).unwrap();
        // Cut at every byte: whole lines stay, the rest goes.
        for cut in 1..whole.len() {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let mut log = Log::open(folder.path(), &head("m")).unwrap();
            assert!(log.add(&line(7)));
            drop(log);
            let lines = whole[..cut].iter().filter(|b| **b == b'\n').count();
            let expected: Vec<u64> = (0..lines.saturating_sub(1) as u64).chain([7]).collect();
            assert_eq!(ids(folder.path()), expected, "cut at {cut}");
        }
        std::fs::write(&path, whole).unwrap();
        let other = Log::open(folder.path(), &head("another")).err().unwrap();
        assert!(other.to_string().contains("results of another study"), "{other}");
        assert!(files(folder.path(), "another").is_err());
    }
}
