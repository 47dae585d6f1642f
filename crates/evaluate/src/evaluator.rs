//! Batches of candidates and the trait of evaluators.

use super::problem::Problem;
use super::search_problem::SearchProblem;
use motorfit_core::candidates::Candidates;
use motorfit_core::{Error, Result};
use std::any::Any;
use std::sync::Arc;

/// A group of candidates that are evaluated on the same problem, that of the DC motor or of a user's model.
#[derive(Debug)]
pub struct Group<'a, P = Problem> {
    /// The problem that the candidates are evaluated on.
    pub problem: &'a Arc<P>,
    /// The candidates, shape `[candidates, free parameters of the problem]`.
    pub candidates: Candidates<'a>,
    /// A candidate near the others, used as the reference by evaluators that compute in deviations and ignored otherwise.
    pub reference: Option<&'a [f64]>,
}

// Derived, these would ask the same of the problem.
impl<P> Clone for Group<'_, P> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<P> Copy for Group<'_, P> {}

/// A batch of groups that are evaluated together.
#[derive(Debug)]
pub struct Batch<'a, P = Problem> {
    /// The groups, in the order of the costs.
    pub groups: &'a [Group<'a, P>],
}

impl<P: SearchProblem> Batch<'_, P> {
    /// Returns the number of candidates of all groups.
    #[must_use]
    pub fn count(&self) -> usize {
        self.groups.iter().map(|group| group.candidates.count()).sum()
    }

    /// Checks that every group has candidates of its problem's width, and that `costs` has one element per candidate.
    ///
    /// # Errors
    /// Returns a usage error if a length does not match.
    pub fn check(&self, costs: &[f64]) -> Result<()> {
        if costs.len() != self.count() {
            return Err(Error::usage(
                format!("{} costs for {} candidates", costs.len(), self.count()),
                "Give one cost per candidate of the batch.",
            ));
        }
        self.check_candidates()
    }

    /// Checks that every group has candidates of its problem's width.
    #[doc(hidden)]
    pub fn check_candidates(&self) -> Result<()> {
        for group in self.groups {
            let (width, axes) = (group.candidates.width(), group.problem.width());
            if width != axes {
                return Err(Error::usage(
                    format!("candidates of {width} values for a space of {axes} free parameters"),
                    "Give one value per free parameter.",
                ));
            }
        }
        Ok(())
    }
}

/// The state of a batch that an evaluator has begun.
#[must_use = "the batch must be finished by the evaluator that began it"]
#[derive(Default)]
pub struct Pending(Option<Box<dyn Any + Send>>);

impl Pending {
    /// Wraps the state that the evaluator needs to finish the batch.
    pub fn of(state: impl Any + Send) -> Self {
        Self(Some(Box::new(state)))
    }

    /// Returns the wrapped state, or `None` if it is of another type, because another evaluator began the batch.
    #[must_use]
    pub fn take<T: Any>(self) -> Option<T> {
        self.0.and_then(|state| state.downcast().ok()).map(|state| *state)
    }
}

/// An evaluator of batches of candidates, on problems of the DC motor or of users' models.
///
/// A cost is finite and at most 1e30, or +∞ for a candidate that diverges, and never NaN. It depends only on the candidate and
/// its problem, not on the rest of the batch; for an evaluator in deviations also on the reference of its group. In place of a cost
/// above the candidate's cutoff it may return any value between the two.
pub trait Evaluator<P: SearchProblem = Problem>: Send {
    /// Evaluates a batch and writes the cost of every candidate, group after group, to `costs`, shape `[candidates]`.
    ///
    /// # Errors
    /// Returns a usage error if lengths do not match, and a device error if the device fails.
    fn evaluate(&mut self, batch: &Batch<'_, P>, costs: &mut [f64]) -> Result<()>;

    /// Evaluates candidates on one problem and writes their costs, shape `[candidates]`.
    ///
    /// # Errors
    /// Returns an error in the cases of [`Evaluator::evaluate`].
    fn costs(&mut self, problem: &Arc<P>, candidates: Candidates<'_>, costs: &mut [f64]) -> Result<()> {
        self.evaluate(&Batch { groups: &[Group { problem, candidates, reference: None }] }, costs)
    }

    /// Begins a batch. A GPU evaluator starts the computation and returns at once; a CPU evaluator does all the work in
    /// [`Evaluator::finish`].
    ///
    /// # Errors
    /// Returns an error in the cases of [`Evaluator::evaluate`].
    fn begin(&mut self, batch: &Batch<'_, P>) -> Result<Pending> {
        batch.check_candidates().map(|()| Pending::default())
    }

    /// Completes a batch that was begun and writes its costs, shape `[candidates]`.
    ///
    /// # Errors
    /// Returns an error in the cases of [`Evaluator::evaluate`].
    fn finish(&mut self, batch: &Batch<'_, P>, pending: Pending, costs: &mut [f64]) -> Result<()> {
        drop(pending);
        self.evaluate(batch, costs)
    }

    /// Returns true if it is faster to begin a batch before the previous one is finished.
    fn overlaps(&self) -> bool {
        false
    }

    /// Returns true if costs have the accuracy of f64. Otherwise searches evaluate their leaders again on the CPU.
    fn is_exact(&self) -> bool {
        true
    }

    /// Evaluates a batch and returns the computing time by the device's own clock \[s\], `None` if it has no clock.
    ///
    /// # Errors
    /// Returns an error in the cases of [`Evaluator::evaluate`].
    fn evaluate_timed(&mut self, batch: &Batch<'_, P>, costs: &mut [f64]) -> Result<Option<f64>> {
        self.evaluate(batch, costs).map(|()| None)
    }

    /// Returns a description of the device.
    fn name(&self) -> String {
        "an evaluator of the caller".to_owned()
    }
}
