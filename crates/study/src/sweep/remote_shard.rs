//! Shards on machines without access to the folder: the files that a shard needs there, and the import of its results.

use super::Shard;
use super::head::Head;
use super::lines::{LineLocation, row};
use super::manifest::{FORMAT, parts};
use super::planned::Sweep;
use super::results::{ResultsFile, files};
use super::runs::Bits;
use super::store::Log;
use motorfit_core::text::printable;
use motorfit_core::{Error, Result};
use std::collections::BTreeSet;
use std::path::Path;

impl Sweep {
    /// Returns the sweep with its recordings relative to another folder. The results do not depend on it.
    #[must_use]
    pub fn with_recordings(mut self, folder: &Path) -> Self {
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
        self.manifest.folder = folder.to_string_lossy().into_owned();
        self
    }

    /// Returns the number of unfinished runs of each of `count` shards.
    ///
    /// # Errors
    /// Returns a `Usage` error for an invalid number of shards, and a `Data` error if results cannot be read or belong
    /// to another study.
    pub fn left(&self, count: u64) -> Result<Vec<u64>> {
        Shard { index: 1, count }.checked()?;
        let mut done = Bits::new(self.manifest.runs);
        for found in files(&self.origin())? {
            mark(&found, &mut done)?;
        }
        let mut left = vec![0; usize::try_from(count).unwrap_or(0)];
        for id in (0..self.manifest.runs).filter(|id| !done.get(*id)) {
            left[motorfit_core::numeric::index(self.owner(count, id))] += 1;
        }
        Ok(left)
    }

    /// Returns the paths of the recordings that a shard reads, as in the study.
    #[must_use]
    pub fn recordings(&self, shard: Shard) -> Vec<String> {
        let per_motor = self.runs.per_motor();
        let is_read = |motor: u64| (motor * per_motor..(motor + 1) * per_motor).any(|id| self.owns(shard, id));
        let folder = Path::new(&self.manifest.folder);
        let motors = (0..).zip(&self.manifest.motors).filter(|(number, _)| is_read(*number));
        let paths = motors.flat_map(|(_, motor)| motor.all_files()).flat_map(|file| parts(folder, &file.path));
        // Motors may share held-out recordings.
        let mut seen = BTreeSet::new();
        paths.map(|path| path.to_string_lossy().into_owned()).filter(|path| seen.insert(path.clone())).collect()
    }

    /// Returns results files as pairs of name and content, reduced to the finished runs of a shard, which need not be
    /// repeated.
    ///
    /// # Errors
    /// Returns a `Data` error if results cannot be read or belong to another study.
    pub fn finished(&self, shard: Shard) -> Result<Vec<(String, Vec<u8>)>> {
        let mut all = Vec::new();
        for found in files(&self.origin())? {
            if found.shard.count == shard.count && found.shard != shard {
                continue;
            }
            let mut lines = found.head.line().into_bytes();
            let head = lines.len();
            found.scan_lines(|place, line| {
                if self.owns(shard, place.row.id) && !place.row.is_retried() {
                    lines.extend_from_slice(line);
                }
            })?;
            if lines.len() > head {
                all.push((found.shard.file(), lines));
            }
        }
        Ok(all)
    }

    /// Adds the results of a shard that was run elsewhere to the folder, without runs that it has already. Returns the
    /// number of runs added.
    ///
    /// # Errors
    /// Returns a `Usage` error for an invalid shard, and a `Data` error if `results` is damaged or of another study or
    /// shard, another session runs this shard in the folder, or the folder cannot be written.
    pub fn take(&self, shard: Shard, results: &[u8]) -> Result<u64> {
        let shard = shard.checked()?;
        let wrong = |what: &str| {
            let message = format!("results of shard {}/{} {what}", shard.index, shard.count);
            Error::data(message, "Run the shard again; none of these results were kept.").in_file(&self.folder)
        };
        let mut lines = results.split_inclusive(|byte| *byte == b'\n');
        let head = lines.next().and_then(Head::of_line);
        let head = head.ok_or_else(|| wrong("have no valid first line"))?;
        if head.manifest != self.digest || head.format != FORMAT || head.shard != [shard.index, shard.count] {
            let of = printable(&format!("{}/{}", head.shard[0], head.shard[1]));
            return Err(wrong(&format!("are of another study or shard ({of})")));
        }
        let origin = self.origin();
        let mut log = Log::open(&origin, &head)?;
        let mut done = Bits::new(self.manifest.runs);
        files(&origin)?.iter().filter(|found| found.shard == shard).try_for_each(|found| mark(found, &mut done))?;
        let (mut new, mut count) = (String::new(), 0);
        for line in lines {
            let is_own = |id: u64| id < self.manifest.runs && self.owns(shard, id);
            let valid = row(line).filter(|row| line.ends_with(b"\n") && is_own(row.id));
            let (Some(row), Ok(text)) = (valid, std::str::from_utf8(line)) else {
                return Err(wrong("are damaged"));
            };
            if !done.get(row.id) {
                done.set(row.id, !row.is_retried());
                new.push_str(text);
                count += 1;
            }
        }
        log.add(&new);
        log.close().fault.map_or(Ok(count), Err)
    }
}

/// Marks the runs of a results file that need not be repeated.
fn mark(found: &ResultsFile<'_>, done: &mut Bits) -> Result<()> {
    let mark = |place: LineLocation| {
        if !place.row.is_retried() {
            done.set(place.row.id, true);
        }
    };
    found.scan(mark).map(drop)
}
