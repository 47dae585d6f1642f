//! All shards put in order: `results.jsonl` without times, `timings.jsonl` with them, and what a sweep has done so far.

use super::Sweep;
use super::line::{Outcome, split};
use super::results::{Place, ResultsFile, files};
use super::runs::Bits;
use super::shard::Shard;
use super::summary::SweepSummary;
use crate::file::{replace, unreadable, unwritable};
use crate::{Error, Result};
use std::fs::{File, TryLockError};
use std::io::{BufReader, Read as _, Write as _};
use std::path::PathBuf;

/// The merged results.
pub(super) const RESULTS: &str = "results.jsonl";
const TIMINGS: &str = "timings.jsonl";

/// The result of a merge.
#[derive(Debug, Clone, PartialEq)]
pub struct Merged {
    /// The results, a line a run, sorted by number.
    pub results: PathBuf,
    /// The summary of the results.
    pub summary: SweepSummary,
    /// Lines of results that could not be read.
    pub damaged: u64,
}

/// A results file of a sweep.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct ShardStatus {
    /// Which shard.
    #[serde(flatten)]
    pub shard: Shard,
    /// Finished runs in its file.
    pub done: u64,
    /// Of these, runs without a result.
    pub failed: u64,
    /// True if it is being run now.
    pub running: bool,
}

/// Progress of a sweep.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct SweepStatus {
    /// The study's name.
    pub name: String,
    /// Its runs.
    pub runs: u64,
    /// Finished runs.
    pub done: u64,
    /// Of these, runs without a result.
    pub failed: u64,
    /// Runs that are not finished.
    pub missing: u64,
    /// True if the merged results are there.
    pub merged: bool,
    /// The results files.
    pub shards: Vec<ShardStatus>,
}

/// Where the line of a run stands: file (from 1 on, 0 for none), length, offset.
type Spot = (u32, u32, u64);

/// Where the line of each run stands, and how many lines are damaged.
fn index(sweep: &Sweep, found: &[ResultsFile<'_>]) -> Result<(Vec<Spot>, u64)> {
    let runs = usize::try_from(sweep.manifest.runs).unwrap_or(usize::MAX);
    let (mut spots, mut good, mut damaged) = (vec![(0, 0, 0); runs], Bits::new(sweep.manifest.runs), 0);
    for (file, found) in (1..).zip(found) {
        // A run that another shard count did again counts once: the first result, and of failures the last.
        damaged += found.scan(|Place { row, length, offset }| {
            let spot = usize::try_from(row.id).ok().and_then(|n| spots.get_mut(n));
            if let Some(spot) = spot.filter(|_| !good.get(row.id)) {
                *spot = (file, length, offset);
                good.set(row.id, !row.is_retried());
            }
        })?;
    }
    Ok((spots, damaged))
}

impl Sweep {
    /// Puts what is finished in order. Runs may be missing.
    ///
    /// # Errors
    /// `Data` when files cannot be read or written, or results are of another study.
    pub fn merge(&self) -> Result<Merged> {
        let origin = self.origin();
        let found = files(&origin)?;
        let (spots, damaged) = index(self, &found)?;
        let mut readers = found.into_iter().map(|found| Reader::open(found.path)).collect::<Result<Vec<_>>>()?;
        let mut summary = SweepSummary::new(self);
        let (results, timings) = (self.folder.join(RESULTS), self.folder.join(TIMINGS));
        let failed = |error: std::io::Error| unwritable(&results, &error);
        replace(&results, |sorted| {
            replace(&timings, |times| {
                self.sorted(&spots, &mut readers, &mut summary, &mut |result, id, seconds| {
                    sorted.write_all(result.as_bytes()).map_err(failed)?;
                    sorted.write_all(b"\n").map_err(failed)?;
                    writeln!(times, "{{\"id\":{id},\"seconds\":{seconds:.9}}}").map_err(failed)
                })
            })
        })?;
        Ok(Merged { results, summary, damaged })
    }

    /// Goes through the runs by number.
    fn sorted(
        &self,
        spots: &[Spot],
        readers: &mut [Reader],
        summary: &mut SweepSummary,
        write: &mut dyn FnMut(&str, u64, f64) -> Result<()>,
    ) -> Result<()> {
        for (id, &(file, length, offset)) in (0..).zip(spots) {
            if file == 0 {
                summary.missing += 1;
                continue;
            }
            let reader = &mut readers[file as usize - 1];
            let line = reader.line(offset, length)?;
            let broken = || {
                let remedy = "Run the sweep again: what is damaged is done once more.";
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
    /// `Data` when files cannot be read, or results are of another study.
    pub fn status(&self) -> Result<SweepStatus> {
        let bits = || Bits::new(self.manifest.runs);
        let (mut all, mut good, mut shards) = (bits(), bits(), Vec::new());
        let origin = self.origin();
        for file in files(&origin)? {
            let (mut done, mut own) = (bits(), bits());
            file.scan(|Place { row, .. }| {
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

/// A results file that lines are read from, mostly in their order.
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
        // Within what is buffered nothing is read again.
        let moved = self.file.seek_relative(offset.cast_signed() - self.at.cast_signed());
        moved.and_then(|()| self.file.read_exact(&mut bytes)).map_err(|error| unreadable(&self.path, &error))?;
        self.at = offset + u64::from(length);
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }
}
