//! Merging of all shards into `results.jsonl` without times and `timings.jsonl` with them, and the progress of a sweep.

use super::line::{Outcome, split};
use super::lines::LineLocation;
use super::planned::Sweep;
use super::results::{ResultsFile, files};
use super::runs::Bits;
use super::shard::Shard;
use super::summary::SweepSummary;
use motorfit_core::file::{replace, unreadable, unwritable};
use motorfit_core::{Error, Result};
use std::fs::{File, TryLockError};
use std::io::{BufReader, Read as _, Write as _};
use std::path::PathBuf;

/// File name of the merged results.
pub(super) const RESULTS: &str = "results.jsonl";
const TIMINGS: &str = "timings.jsonl";

/// Result of a merge.
#[derive(Debug, Clone, PartialEq)]
pub struct Merged {
    /// Path of the merged results, one line per run, sorted by number.
    pub results: PathBuf,
    /// Summary of the results.
    pub summary: SweepSummary,
    /// Number of damaged lines, which were skipped.
    pub damaged: u64,
}

/// Progress of one shard by its results file.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct ShardStatus {
    /// The shard.
    #[serde(flatten)]
    pub shard: Shard,
    /// Number of finished runs in the file.
    pub done: u64,
    /// Number of finished runs without a result.
    pub failed: u64,
    /// True if a process is running the shard now.
    pub running: bool,
}

/// Progress of a sweep.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct SweepStatus {
    /// Name of the study.
    pub name: String,
    /// Number of runs of the study.
    pub runs: u64,
    /// Number of finished runs.
    pub done: u64,
    /// Number of finished runs without a result.
    pub failed: u64,
    /// Number of unfinished runs.
    pub missing: u64,
    /// True if merged results exist.
    pub merged: bool,
    /// Progress by results file.
    pub shards: Vec<ShardStatus>,
}

/// Location of the line of a run: number of the file (from 1; 0 for none), length and offset \[bytes\].
type Location = (u32, u32, u64);

/// Returns the location of the line of each run and the number of damaged lines.
pub(super) fn index(sweep: &Sweep, found: &[ResultsFile<'_>]) -> Result<(Vec<Location>, u64)> {
    let runs = usize::try_from(sweep.manifest.runs).unwrap_or(usize::MAX);
    let (mut locations, mut good, mut damaged) = (vec![(0, 0, 0); runs], Bits::new(sweep.manifest.runs), 0);
    for (file, found) in (1..).zip(found) {
        // A run that was repeated under another number of shards counts once: its first result or, without one, its
        // last failure.
        damaged += found.scan(|LineLocation { row, length, offset }| {
            let location = usize::try_from(row.id).ok().and_then(|n| locations.get_mut(n));
            if let Some(location) = location.filter(|_| !good.get(row.id)) {
                *location = (file, length, offset);
                good.set(row.id, !row.is_retried());
            }
        })?;
    }
    Ok((locations, damaged))
}

impl Sweep {
    /// Merges the finished runs; runs may be missing.
    ///
    /// # Errors
    /// Returns a `Data` error if files cannot be read or written, or results belong to another study.
    pub fn merge(&self) -> Result<Merged> {
        let origin = self.origin();
        let found = files(&origin)?;
        let (locations, damaged) = index(self, &found)?;
        let mut readers = found.into_iter().map(|found| Reader::open(found.path)).collect::<Result<Vec<_>>>()?;
        let mut summary = SweepSummary::new(self);
        let (results, timings) = (self.folder.join(RESULTS), self.folder.join(TIMINGS));
        let failed = |error: std::io::Error| unwritable(&results, &error);
        replace(&results, |sorted| {
            replace(&timings, |times| {
                self.sorted(&locations, &mut readers, &mut summary, &mut |result, id, seconds| {
                    sorted.write_all(result.as_bytes()).map_err(failed)?;
                    sorted.write_all(b"\n").map_err(failed)?;
                    writeln!(times, "{{\"id\":{id},\"seconds\":{seconds:.9}}}").map_err(failed)
                })
            })
        })?;
        Ok(Merged { results, summary, damaged })
    }

    /// Visits the runs in the order of their numbers.
    fn sorted(
        &self,
        locations: &[Location],
        readers: &mut [Reader],
        summary: &mut SweepSummary,
        write: &mut dyn FnMut(&str, u64, f64) -> Result<()>,
    ) -> Result<()> {
        for (id, &(file, length, offset)) in (0..).zip(locations) {
            if file == 0 {
                summary.missing += 1;
                continue;
            }
            let reader = &mut readers[file as usize - 1];
            let line = reader.line(offset, length)?;
            let broken = || {
                let remedy = "Run the sweep again: damaged runs are repeated.";
                Error::data(format!("the line of run {id} is damaged"), remedy).in_file(&reader.path)
            };
            let (result, seconds) = split(line.trim_end()).ok_or_else(broken)?;
            let outcome: Outcome = serde_json::from_str(&result).map_err(|_| broken())?;
            write(&result, id, seconds)?;
            summary.add(self, &self.runs.job(id), outcome, seconds);
        }
        Ok(())
    }

    /// Returns the progress of the sweep.
    ///
    /// # Errors
    /// Returns a `Data` error if files cannot be read, or results belong to another study.
    pub fn status(&self) -> Result<SweepStatus> {
        let bits = || Bits::new(self.manifest.runs);
        let (mut all, mut good, mut shards) = (bits(), bits(), Vec::new());
        let origin = self.origin();
        for file in files(&origin)? {
            let (mut done, mut own) = (bits(), bits());
            file.scan(|LineLocation { row, .. }| {
                [&mut done, &mut all].into_iter().for_each(|bits| bits.set(row.id, true));
                if row.error.is_none() {
                    [&mut own, &mut good].into_iter().for_each(|bits| bits.set(row.id, true));
                }
            })?;
            let running = File::open(&file.path)
                .is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)));
            let failed = done.count() - own.count();
            shards.push(ShardStatus { shard: file.shard, done: done.count(), failed, running });
        }
        Ok(SweepStatus {
            name: self.manifest.name.clone(),
            runs: self.manifest.runs,
            done: all.count(),
            failed: all.count() - good.count(),
            missing: self.manifest.runs - all.count(),
            merged: self.folder.join(RESULTS).exists(),
            shards,
        })
    }
}

/// Reader of lines of a results file, mostly in sequence.
struct Reader {
    file: BufReader<File>,
    at: u64,
    path: PathBuf,
}

impl Reader {
    fn open(path: PathBuf) -> Result<Self> {
        let file = File::open(&path).map_err(|error| unreadable(&path, &error))?;
        Ok(Self { file: BufReader::with_capacity(1 << 16, file), at: 0, path })
    }

    fn line(&mut self, offset: u64, length: u32) -> Result<String> {
        let mut bytes = vec![0; length as usize];
        // A relative seek keeps the buffer if the target is in it.
        let moved = self.file.seek_relative(offset.cast_signed() - self.at.cast_signed());
        moved.and_then(|()| self.file.read_exact(&mut bytes)).map_err(|error| unreadable(&self.path, &error))?;
        self.at = offset + u64::from(length);
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }
}
