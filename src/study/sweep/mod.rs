//! Sweeps: the runs of a study, or the recordings of a production line, as one batch that can be interrupted at any
//! instant and goes on where it was.
//!
//! A study becomes a folder with a manifest that never changes; shards of its runs append finished runs to files of
//! their own; a merge puts them in order. The bytes of the merge depend on the manifest, the device kind, the precision
//! and the class of instructions alone.

mod dataset;
mod fits;
mod head;
mod keys;
mod line;
mod manifest;
mod merge;
mod pattern;
mod plan;
mod remote_shard;
mod results;
mod run;
mod runs;
#[cfg(test)]
mod sample;
mod search;
mod shard;
mod store;
mod streaming;
mod study;
mod summary;
mod toml;
mod trust;

#[cfg(all(feature = "report", feature = "parquet"))]
pub(crate) use line::Line;
pub use line::{Failure, HeldOutFit, Outcome};
pub use manifest::{File, Manifest, Motor, PinnedDevice};
pub use merge::{Merged, ShardStatus, SweepStatus};
pub use run::{FailedRun, Failures, Observe, SweepProgress, Tally};
pub use runs::Job;
use runs::Runs;
pub use shard::Shard;
pub use study::Factors;
use study::Study;
pub use summary::{Cell, Limits, MOTOR, Named, NamedRun, Quantiles, SweepBlock, SweepSummary};
pub use trust::{LevelCounts, RunTrust, TrustCounts};

use crate::Error;
use crate::limit::{Limit, limit, limit_of};
use head::Origin;
use std::path::{Path, PathBuf};

/// The limits of studies.
pub(super) const LIMITS: [Limit; 4] = [
    limit("bytes of a study", plan::BYTES_MAX, "refused"),
    limit("runs of a study", manifest::RUNS_MAX, "refused"),
    limit("shards of a sweep", shard::SHARDS_MAX, "refused"),
    limit_of("folders that a pattern leads into", pattern::FOLDERS_MAX, "refused"),
];

/// A planned sweep.
#[derive(Debug, Clone)]
pub struct Sweep {
    /// Where it lies.
    folder: PathBuf,
    manifest: Manifest,
    /// The digest of the manifest.
    digest: String,
    runs: Runs,
}

impl Sweep {
    /// Returns the manifest.
    #[must_use]
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Its folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The digest of its manifest: what results files belong to.
    #[must_use]
    pub fn digest(&self) -> &str {
        &self.digest
    }

    fn study(&self) -> &Study {
        self.runs.study()
    }

    /// Which of so many shards a run belongs to, from 0 on: whole motors where there are many, so that each is read once.
    fn owner(&self, count: u64, id: u64) -> u64 {
        let motors = self.manifest.motors.len() as u64;
        let number = if motors >= count.saturating_mul(8) { id / self.runs.per_motor() } else { id };
        number.checked_rem(count).unwrap_or(0)
    }

    fn owns(&self, shard: Shard, id: u64) -> bool {
        shard.index.checked_sub(1) == Some(self.owner(shard.count, id))
    }

    /// Where its results files lie, and which lines belong to it.
    fn origin(&self) -> Origin<'_> {
        Origin { folder: &self.folder, manifest: &self.digest, is_of: Box::new(|line| self.is_of(line)) }
    }

    /// Returns whether a line is of one of its runs: all of its factors must be those of the run with its number.
    fn is_of(&self, line: &line::Line) -> bool {
        if line.id >= self.manifest.runs {
            return false;
        }
        let job = self.runs.job(line.id);
        let own = line::Line::of(self.study(), &job, &self.manifest.motors[job.motor].motor, line.outcome.clone());
        own == *line
    }

    fn failed(&self, error: &Error) -> Outcome {
        let root = format!("{}{}", self.manifest.folder, std::path::MAIN_SEPARATOR);
        Outcome::failed(error, &crate::text::printable(&root))
    }
}
