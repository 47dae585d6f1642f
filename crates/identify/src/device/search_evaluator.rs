//! A device that evaluates populations, whatever the machine of the problems.

use super::batch_search::BatchSearchEvaluator;
use super::problem::DeviceProblem;
use super::used::DeviceUsed;
use motorfit_optimize::Evaluate;
use motorfit_record::warning::Warning;

/// Evaluates the populations of searches on a device, on the problems of a machine that it was opened for.
#[doc(hidden)]
pub trait SearchEvaluator: Evaluate + Send {
    /// Sets the problem of each run that is evaluated next, by its index.
    fn set_runs(&mut self, problems: &[usize]);

    /// Returns the number of candidates between two calls of the observer.
    fn slice(&self) -> usize;

    /// Returns the work of a candidate of the first problem by which batches are sized, in steps of the kernel of the linear motor.
    fn steps(&self) -> usize;

    /// Returns the description of the device.
    fn device(&self) -> DeviceUsed;

    /// Returns warnings about the device.
    fn warnings(&self) -> &[Warning];
}

impl<P: DeviceProblem> SearchEvaluator for BatchSearchEvaluator<P> {
    fn set_runs(&mut self, problems: &[usize]) {
        self.set_problems(problems.iter().map(|problem| self.given()[*problem].clone()).collect());
    }

    fn slice(&self) -> usize {
        self.slice()
    }

    fn steps(&self) -> usize {
        self.given().first().map_or(1, |problem| self.steps(problem))
    }

    fn device(&self) -> DeviceUsed {
        self.device()
    }

    fn warnings(&self) -> &[Warning] {
        self.warnings()
    }
}
