//! A planned sweep.

use super::estimates::{RunEstimate, RunEstimates};
use super::limits::Limits;
use super::line;
use super::line::Outcome;
use super::lines::Origin;
use super::manifest::Manifest;
use super::runs::Runs;
use super::shard::Shard;
use super::study::Study;
use motorfit_core::setting::text;
use motorfit_core::text::excerpt;
use motorfit_core::{Error, Result};
use std::path::{Path, PathBuf};

/// A planned sweep.
#[derive(Debug, Clone)]
pub struct Sweep {
    /// Folder of the manifest and the results.
    pub(super) folder: PathBuf,
    pub(super) manifest: Manifest,
    /// SHA-256 digest of the manifest.
    pub(super) digest: String,
    pub(super) runs: Runs,
}

impl Sweep {
    /// Returns the manifest.
    #[must_use]
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Returns the folder of the sweep.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Returns the digest of the manifest, to which results files belong.
    #[must_use]
    pub fn digest(&self) -> &str {
        &self.digest
    }

    /// Returns the given acceptance limits, or those of the study if none are given.
    ///
    /// # Errors
    /// Returns a `Usage` error if a limit is of a parameter that no machine of the study has.
    pub fn limits_or_own(&self, given: Limits) -> Result<Limits> {
        if given.is_empty() {
            return Ok(self.study().limits.clone());
        }
        match self.study().unlimited(&given) {
            Some((symbol, hint)) => {
                let message = text!([Limits](": no model of the study has {}", excerpt(&symbol)));
                Err(Error::usage(message, hint))
            }
            None => Ok(given),
        }
    }

    pub(super) fn study(&self) -> &Study {
        self.runs.study()
    }

    /// Returns the shard, from 0 to `count` − 1, that a run belongs to. With at least eight motors per shard a shard has
    /// complete motors, so that each recording is read once.
    pub(super) fn owner(&self, count: u64, id: u64) -> u64 {
        let motors = self.manifest.motors.len() as u64;
        let number = if motors >= count.saturating_mul(8) { id / self.runs.per_motor() } else { id };
        number.checked_rem(count).unwrap_or(0)
    }

    pub(super) fn owns(&self, shard: Shard, id: u64) -> bool {
        shard.index.checked_sub(1) == Some(self.owner(shard.count, id))
    }

    /// Returns the folder of the results files and the test for lines that belong to this sweep.
    pub(super) fn origin(&self) -> Origin<'_> {
        Origin { folder: &self.folder, manifest: &self.digest, is_of: Box::new(|line| self.is_of(line)) }
    }

    /// Returns true if all factors of a line are those of the run with its number.
    pub(super) fn is_of(&self, line: &line::Line) -> bool {
        if line.id >= self.manifest.runs {
            return false;
        }
        let job = self.runs.job(line.id);
        let own = line::Line::of(self.study(), &job, &self.manifest.motors[job.motor].motor, line.outcome.clone());
        let level = self.study().machine(&job.factors);
        let is_own = |e: &RunEstimate| level.parameter(&e.name).is_some();
        own == *line && line.outcome.estimates.iter().flat_map(RunEstimates::all).all(is_own)
    }

    pub(super) fn failed(&self, error: &Error) -> Outcome {
        let root = format!("{}{}", self.manifest.folder, std::path::MAIN_SEPARATOR);
        Outcome::failed(error, &motorfit_core::text::printable(&root))
    }
}
