//! An evaluator whose sums the page brings: it hands out a job when a batch begins, and takes the sums when it is finished.

use crate::job::Job;
use motorfit::evaluate::gpu::Submission;
use motorfit::evaluate::{Batch, Evaluator, Pending};
use motorfit::{Error, Result};
use std::sync::{Arc, Mutex, PoisonError};

/// Jobs and sums that page and evaluator exchange.
#[derive(Default)]
pub struct Exchange {
    /// The job of the batch that was begun.
    pub job: Option<Job>,
    /// The sums of that batch.
    pub sums: Option<Vec<u8>>,
}

/// An exchange that page and evaluator share.
pub type Shared = Arc<Mutex<Exchange>>;

/// Works with the content of an exchange.
pub fn with<T>(shared: &Shared, work: impl FnOnce(&mut Exchange) -> T) -> T {
    work(&mut shared.lock().unwrap_or_else(PoisonError::into_inner))
}

/// The evaluator, in f32, of one group at a time.
pub struct ByPage(pub Shared);

fn out_of_order() -> Error {
    Error::usage("the page brought no sums", "Begin a batch, bring its sums, and finish it.")
}

impl Evaluator for ByPage {
    fn evaluate(&mut self, _: &Batch<'_>, _: &mut [f64]) -> Result<()> {
        Err(out_of_order())
    }

    fn begin(&mut self, batch: &Batch<'_>) -> Result<Pending> {
        let [group] = batch.groups else { return Err(out_of_order()) };
        let submission = Submission::new(group.problem, group.candidates.count(), group.reference)?;
        let job = Job::of(&submission, submission.maps(group.candidates)?);
        with(&self.0, |exchange| exchange.job = Some(job));
        Ok(Pending::of(submission))
    }

    fn finish(&mut self, batch: &Batch<'_>, pending: Pending, costs: &mut [f64]) -> Result<()> {
        let [group] = batch.groups else { return Err(out_of_order()) };
        let sums = with(&self.0, |exchange| exchange.sums.take());
        let (Some(submission), Some(sums)) = (pending.take::<Submission>(), sums) else { return Err(out_of_order()) };
        costs.copy_from_slice(&submission.costs(group.candidates, &sums)?);
        Ok(())
    }

    fn is_exact(&self) -> bool {
        false
    }

    fn name(&self) -> String {
        "WebGPU".to_owned()
    }
}
