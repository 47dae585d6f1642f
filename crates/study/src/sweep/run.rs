//! Execution of the unfinished runs of a shard, in pieces of bounded memory.

use super::head::Head;
use super::line::{Outcome, line};
use super::planned::Sweep;
use super::results::files;
use super::runs::{Bits, Job, TrustLevels};
use super::shard::Shard;
use super::store::{Closed, Log};
use super::trust::LevelCounts;
use motorfit_core::clock::Instant;
use motorfit_core::numeric::count_u64;
use motorfit_core::{Error, Result};
use motorfit_identify::TrustLevel;
use motorfit_identify::device::DeviceUsed;
use motorfit_record::warning::Warning;
use std::ops::ControlFlow;

/// Progress of a shard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SweepProgress {
    /// Number of finished runs of the shard, those of earlier sessions included.
    pub done: u64,
    /// Number of runs of the shard.
    pub total: u64,
    /// Number of runs that were finished in earlier sessions.
    pub before: u64,
    /// Number of finished runs without a result.
    pub failed: u64,
    /// Work in progress, in units of one run.
    pub under_way: f64,
    /// Time since the start of this session \[s\].
    pub seconds: f64,
}

impl SweepProgress {
    /// Returns the throughput \[runs/s\]; `None` before any work is done.
    #[must_use]
    pub fn rate(&self) -> Option<f64> {
        let rate = (count_u64(self.done.saturating_sub(self.before)) + self.under_way) / self.seconds;
        (rate.is_finite() && rate > 0.0).then_some(rate)
    }

    /// Returns the remaining time at this throughput \[s\].
    #[must_use]
    pub fn remaining(&self) -> Option<f64> {
        Some(((count_u64(self.total.saturating_sub(self.done)) - self.under_way) / self.rate()?).max(0.0))
    }
}

/// Runs of one motor that have no result for the same reason.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct FailedRun {
    /// Number of the first of these runs.
    pub id: u64,
    /// Number of these runs.
    pub runs: u64,
    /// Name of the motor.
    pub motor: String,
    /// Error message.
    pub message: String,
}

/// Runs without a result, by motor and reason.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Failures {
    /// Failures that are listed, by motor and reason.
    pub named: Vec<FailedRun>,
    /// Number of failed runs that are not listed.
    pub others: u64,
}

/// Largest number of listed pairs of motor and reason.
const FAILURES_NAMED: usize = 100;

impl Failures {
    /// Adds a failed run.
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

/// Counts of one session of a shard.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    /// Number of runs of the shard.
    pub total: u64,
    /// Number of runs that were finished in earlier sessions.
    pub before: u64,
    /// Number of runs that were finished in this session.
    pub finished: u64,
    /// Number of runs without a result, those of earlier sessions included.
    pub failed: u64,
    /// Number of results by level of trust, those of earlier sessions included.
    pub trust: LevelCounts,
    /// Failures of this session.
    pub failures: Failures,
    /// Number of finished runs that could not be written or were lost.
    pub lost: u64,
    /// Reason why runs were not written or are lost.
    pub fault: Option<Error>,
    /// True if the observer ended the session.
    pub interrupted: bool,
    /// Device that evaluated the searches; `None` without a search.
    pub device: Option<DeviceUsed>,
    /// Warnings about the results files and the device.
    pub warnings: Vec<Warning>,
    /// Duration of the session \[s\].
    pub seconds: f64,
}

/// Observer that receives the progress and may end the session.
pub type Observe<'a> = dyn FnMut(&SweepProgress) -> ControlFlow<()> + 'a;

/// State of a running shard.
pub(super) struct Running<'a> {
    pub sweep: &'a Sweep,
    shard: Shard,
    done: Bits,
    log: Log,
    pub tally: Tally,
    observe: &'a mut Observe<'a>,
    begun: Instant,
}

/// Reason why a session ends early.
pub(super) enum End {
    Interrupted,
    /// Results cannot be written any more.
    Stuck,
    Failed(Error),
}

impl From<Error> for End {
    fn from(error: Error) -> Self {
        Self::Failed(error)
    }
}

/// Result of a step of a session.
pub(super) type Step = std::result::Result<(), End>;

impl Sweep {
    /// Executes the unfinished runs of a shard in the caller's rayon pool. `observe` receives the progress and may end
    /// the session.
    ///
    /// # Errors
    /// Returns a `Usage` error for an invalid shard, a `Data` error if the folder cannot be written, another process
    /// runs the shard or results belong to another study, and a `Device` error if the device is missing or lost.
    /// Finished runs are kept.
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
                // A run that failed because of its recording is repeated, unless another results file has its result.
                if !place.row.is_retried() {
                    done.set(place.row.id, true);
                    failed.set(place.row.id, place.row.error.is_some());
                    levels.set(place.row.id, place.row.trust.map(|trust| trust.level));
                }
            })?;
            if !found.head.instructions.is_empty() && found.head.instructions != head.instructions {
                let message = format!(
                    "{}: computed with {} instructions, this machine has {}: the last digits may differ",
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
            let message = format!("{damaged} lines of results are damaged; runs without an intact line are repeated");
            running.tally.warnings.push(Warning::new("results_damaged", message));
        }
        let end = running.stream(false).and_then(|()| running.stream(true)).and_then(|()| running.search());
        running.close(end)
    }
}

impl Sweep {
    /// Returns the runs that have a line in any results file.
    fn runs_written(&self) -> Result<Bits> {
        let mut written = Bits::new(self.manifest.runs);
        files(&self.origin())?
            .iter()
            .try_for_each(|found| found.scan(|place| written.set(place.row.id, true)).map(drop))?;
        Ok(written)
    }
}

impl Running<'_> {
    /// Returns true if a run belongs to this shard and is not finished.
    pub(super) fn is_due(&self, id: u64) -> bool {
        self.sweep.owns(self.shard, id) && !self.done.get(id)
    }

    /// Returns true if any run of a motor is due, a quick test before its units are built.
    pub(super) fn may_be_due(&self, motor: usize) -> bool {
        let per_motor = self.sweep.runs.per_motor();
        let first = motor as u64 * per_motor;
        (first..first + per_motor).any(|id| self.is_due(id))
    }

    /// Reports the progress to the observer, with the work `under_way` in units of one run.
    pub(super) fn progress(&mut self, under_way: f64) -> Step {
        let Tally { total, before, finished, failed, .. } = self.tally;
        let (done, seconds) = (before + finished, self.begun.elapsed().as_secs_f64());
        let progress = SweepProgress { done, total, before, failed, under_way, seconds };
        if (self.observe)(&progress).is_break() { Err(End::Interrupted) } else { Ok(()) }
    }

    /// Writes finished runs and counts them.
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

    /// Ends the session: closes the results file, counts lost runs, and then returns the error that ended it, if any.
    fn close(self, end: Step) -> Result<Tally> {
        let Self { sweep, shard, done, mut tally, log, begun, .. } = self;
        let Closed { waiting, is_gone, fault } = log.close();
        (tally.lost, tally.fault) = (waiting, fault);
        if is_gone {
            // Lines of earlier sessions may be lost too.
            let written = sweep.runs_written().unwrap_or_else(|_| Bits::new(0));
            let is_lost = |id: &u64| sweep.owns(shard, *id) && done.get(*id) && !written.get(*id);
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
    /// Name of the motor and error message of a run without a result.
    pub failure: Option<(String, String)>,
    /// Level of trust in the result.
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
