//! Running a shard: what is left of it, in pieces whose memory does not depend on how many there are.

use super::Sweep;
use super::head::Head;
use super::line::{Outcome, line};
use super::results::files;
use super::runs::{Bits, Job, TrustLevels};
use super::shard::Shard;
use super::store::{Closed, Log};
use super::trust::LevelCounts;
use crate::identify::TrustLevel;
use crate::numeric::count_u64;
use crate::warning::Warning;
use crate::{Error, Result};
use std::ops::ControlFlow;
use std::time::Instant;

/// Progress of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweepProgress {
    /// Runs of the shard that are finished, those of earlier times included.
    pub done: u64,
    /// Runs of the shard.
    pub total: u64,
    /// Runs that were finished before.
    pub before: u64,
    /// Runs without a result.
    pub failed: u64,
    /// Runs' worth of work that is under way.
    pub under_way: f64,
    /// Seconds since it began.
    pub seconds: f64,
}

impl SweepProgress {
    /// Runs a second; `None` before there is any.
    #[must_use]
    pub fn rate(&self) -> Option<f64> {
        let rate = (count_u64(self.done.saturating_sub(self.before)) + self.under_way) / self.seconds;
        (rate.is_finite() && rate > 0.0).then_some(rate)
    }

    /// Seconds that are left at this rate.
    #[must_use]
    pub fn remaining(&self) -> Option<f64> {
        Some(((count_u64(self.total.saturating_sub(self.done)) - self.under_way) / self.rate()?).max(0.0))
    }
}

/// Runs of a motor without a result, for one reason.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct FailedRun {
    /// The number of the first.
    pub id: u64,
    /// The number of runs.
    pub runs: u64,
    /// Their motor.
    pub motor: String,
    /// Why.
    pub message: String,
}

/// Runs without a result, by motor and reason.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Failures {
    /// The first of them.
    pub named: Vec<FailedRun>,
    /// Runs for other reasons, or of other motors.
    pub others: u64,
}

/// Reasons that are named.
const FAILURES_NAMED: usize = 100;

impl Failures {
    /// Takes a run in.
    pub fn add(&mut self, id: u64, motor: &str, message: &str) {
        let is_same = |known: &&mut FailedRun| known.motor == motor && known.message == message;
        if let Some(known) = self.named.iter_mut().rev().find(is_same) {
            known.runs += 1;
        } else if self.named.len() < FAILURES_NAMED {
            let (motor, message) = (motor.to_owned(), message.to_owned());
            self.named.push(FailedRun { id, runs: 1, motor, message });
        } else {
            self.others += 1;
        }
    }
}

/// The tally of a run of a shard.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    /// Runs of the shard.
    pub total: u64,
    /// Runs that were finished before.
    pub before: u64,
    /// Runs that were finished now.
    pub finished: u64,
    /// Runs without a result, those of earlier times included.
    pub failed: u64,
    /// The others by their level of trust, those of earlier times included.
    pub trust: LevelCounts,
    /// The first reasons of those of now.
    pub failures: Failures,
    /// Finished runs that could not be written, and why.
    pub lost: u64,
    /// The reason for that.
    pub fault: Option<Error>,
    /// True if the observer ended it.
    pub interrupted: bool,
    /// The device that evaluated searches, with its precision; `None` where none was run.
    pub device: Option<(String, &'static str)>,
    /// Warnings for the reader.
    pub warnings: Vec<Warning>,
    /// Seconds.
    pub seconds: f64,
}

/// Sees the progress, and may end the run.
pub type Observe<'a> = dyn FnMut(&SweepProgress) -> ControlFlow<()> + 'a;

/// A shard on its way.
pub(super) struct Running<'a> {
    pub sweep: &'a Sweep,
    shard: Shard,
    done: Bits,
    log: Log,
    pub tally: Tally,
    observe: &'a mut Observe<'a>,
    begun: Instant,
}

/// Why a run ends early.
pub(super) enum End {
    Interrupted,
    /// The disk takes nothing more.
    Stuck,
    Failed(Error),
}

impl From<Error> for End {
    fn from(error: Error) -> Self {
        Self::Failed(error)
    }
}

/// A step of a run, which may be its last.
pub(super) type Step = std::result::Result<(), End>;

impl Sweep {
    /// Runs what is left of a shard, in the rayon pool of the caller. `observe` sees the progress and may end it.
    ///
    /// # Errors
    /// `Usage` for a shard that there is not; `Data` when the folder cannot be written, another run has the shard, or results
    /// are of another study; `Device`
    /// when the device is not there or is lost for good. What was finished until then is kept.
    pub fn run<'a>(&'a self, shard: Shard, observe: &'a mut Observe<'a>) -> Result<Tally> {
        let shard = shard.checked()?;
        let (origin, head) = (self.origin(), Head::new(&self.digest, shard));
        let log = Log::open(&origin, &head)?;
        let (mut done, mut failed) = (Bits::new(self.manifest.runs), Bits::new(self.manifest.runs));
        let mut levels = TrustLevels::new(self.manifest.runs);
        let mut tally = Tally::default();
        let mut damaged = 0;
        for found in files(&origin)? {
            damaged += found.scan(|place| {
                // A run that failed for its recording is tried again, unless it was done elsewhere.
                if !place.row.is_retried() {
                    done.set(place.row.id, true);
                    failed.set(place.row.id, place.row.error.is_some());
                    levels.set(place.row.id, place.row.trust.map(|trust| trust.level));
                }
            })?;
            if !found.head.instructions.is_empty() && found.head.instructions != head.instructions {
                let message = format!(
                    "{}: made with {} instructions, here are {}: the last digits may differ",
                    found.path.display(),
                    found.head.instructions,
                    head.instructions
                );
                tally.warnings.push(Warning::new("other_instructions", message));
            }
        }
        let mut running = Running { sweep: self, shard, done, log, tally, observe, begun: Instant::now() };
        for id in (0..self.manifest.runs).filter(|id| self.owns(shard, *id)) {
            running.tally.total += 1;
            running.tally.before += u64::from(running.done.get(id));
            running.tally.failed += u64::from(failed.get(id));
            if running.done.get(id) && !failed.get(id) {
                running.tally.trust.add(levels.get(id));
            }
        }
        if damaged > 0 && running.tally.before < running.tally.total {
            let message =
                format!("{damaged} lines of results are damaged; runs that are missing for it are done again");
            running.tally.warnings.push(Warning::new("results_damaged", message));
        }
        let end = running.stream(false).and_then(|()| running.stream(true)).and_then(|()| running.search());
        running.close(end)
    }
}

impl Sweep {
    /// The runs that a results file has a line of.
    fn runs_written(&self) -> Result<Bits> {
        let mut written = Bits::new(self.manifest.runs);
        files(&self.origin())?
            .iter()
            .try_for_each(|found| found.scan(|place| written.set(place.row.id, true)).map(drop))?;
        Ok(written)
    }
}

impl Running<'_> {
    /// Returns whether a run is still to be done here.
    pub(super) fn is_due(&self, id: u64) -> bool {
        self.sweep.owns(self.shard, id) && !self.done.get(id)
    }

    /// Returns whether anything of a motor may be due: a quick look before all of its runs are.
    pub(super) fn may_be_due(&self, motor: usize) -> bool {
        let per_motor = self.sweep.runs.per_motor();
        let first = motor as u64 * per_motor;
        (first..first + per_motor).any(|id| self.is_due(id))
    }

    /// Tells the observer; `under_way` in runs.
    pub(super) fn progress(&mut self, under_way: f64) -> Step {
        let Tally { total, before, finished, failed, .. } = self.tally;
        let (done, seconds) = (before + finished, self.begun.elapsed().as_secs_f64());
        let progress = SweepProgress { done, total, before, failed, under_way, seconds };
        if (self.observe)(&progress).is_break() { Err(End::Interrupted) } else { Ok(()) }
    }

    /// Keeps finished runs.
    pub(super) fn keep(&mut self, runs: Vec<Finished>) -> Step {
        let mut lines = String::new();
        for Finished { id, line, failure, level } in runs {
            lines.push_str(&line);
            self.done.set(id, true);
            self.tally.finished += 1;
            if let Some((motor, message)) = failure {
                self.tally.failed += 1;
                self.tally.failures.add(id, &motor, &message);
            } else {
                self.tally.trust.add(level);
            }
        }
        self.log.add(&lines);
        if self.log.is_stuck() { Err(End::Stuck) } else { self.progress(0.0) }
    }

    /// Ends the run: what waits is tried once more, and the error, if there is one, comes after that.
    fn close(self, end: Step) -> Result<Tally> {
        let Self { sweep, shard, done, mut tally, log, begun, .. } = self;
        let Closed { waiting, is_gone, fault } = log.close();
        (tally.lost, tally.fault) = (waiting, fault);
        if is_gone {
            // Some of those of earlier times may be gone too.
            let there = sweep.runs_written().unwrap_or_else(|_| Bits::new(0));
            let is_lost = |id: &u64| sweep.owns(shard, *id) && done.get(*id) && !there.get(*id);
            tally.lost = (0..sweep.manifest.runs).filter(is_lost).count() as u64;
        }
        let of_now = tally.lost.min(tally.finished);
        tally.finished -= of_now;
        tally.before -= (tally.lost - of_now).min(tally.before);
        tally.failed = tally.failed.min(tally.before + tally.finished);
        tally.seconds = begun.elapsed().as_secs_f64();
        tally.interrupted = matches!(end, Err(End::Interrupted));
        if let Err(End::Failed(error)) = end { Err(error) } else { Ok(tally) }
    }
}

/// A finished run.
pub(super) struct Finished {
    pub id: u64,
    pub line: String,
    /// Its motor, and why there is no result.
    pub failure: Option<(String, String)>,
    /// The level of trust in its result.
    level: Option<TrustLevel>,
}

impl Finished {
    pub(super) fn new(sweep: &Sweep, job: &Job, outcome: &Outcome, seconds: f64) -> Self {
        let motor = &sweep.manifest.motors[job.motor].motor;
        let failure = outcome.error.as_ref().map(|failure| (motor.clone(), failure.message.clone()));
        let level = outcome.trust.as_ref().map(|trust| trust.level);
        Self { id: job.id, line: line(sweep.study(), job, motor, outcome, seconds), failure, level }
    }
}
