//! Batches of candidates and what evaluates them.

use super::problem::Problem;
use crate::candidates::Candidates;
use crate::{Error, Result};
use std::any::Any;
use std::sync::Arc;

/// Candidates that are evaluated on one problem.
#[derive(Debug, Clone, Copy)]
pub struct Group<'a> {
    /// The problem on which they are evaluated.
    pub problem: &'a Arc<Problem>,
    /// The candidates, one value per free axis of the problem's space.
    pub candidates: Candidates<'a>,
    /// A candidate near the others, the reference of evaluators that compute in deviations; others ignore it.
    pub reference: Option<&'a [f64]>,
}

/// Groups that are evaluated together.
#[derive(Debug, Clone, Copy)]
pub struct Batch<'a> {
    /// The groups; costs come back in their order.
    pub groups: &'a [Group<'a>],
}

impl Batch<'_> {
    /// Candidates of all groups.
    #[must_use]
    pub fn count(&self) -> usize {
        self.groups.iter().map(|group| group.candidates.count()).sum()
    }

    /// Checks that every group fits its problem and `costs` holds one cost per candidate.
    ///
    /// # Errors
    /// `Usage` when the lengths do not fit.
    pub fn check(&self, costs: &[f64]) -> Result<()> {
        if costs.len() != self.count() {
            return Err(Error::usage(
                format!("{} costs for {} candidates", costs.len(), self.count()),
                "Give one cost per candidate of the batch.",
            ));
        }
        self.check_candidates()
    }

    /// Checks that every group fits its problem.
    pub(super) fn check_candidates(&self) -> Result<()> {
        for group in self.groups {
            let (width, axes) = (group.candidates.width(), group.problem.space().free().len());
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

/// A batch that has begun, for the evaluator that began it.
#[must_use = "what it holds is in use until it is finished"]
#[derive(Default)]
pub struct Pending(Option<Box<dyn Any + Send>>);

impl Pending {
    /// With what the evaluator needs to finish it.
    pub fn of(state: impl Any + Send) -> Self {
        Self(Some(Box::new(state)))
    }

    /// Returns the evaluator's own state; `None` where another evaluator began it.
    #[must_use]
    pub fn take<T: Any>(self) -> Option<T> {
        self.0.and_then(|state| state.downcast().ok()).map(|state| *state)
    }
}

/// Evaluates batches of candidates.
///
/// A cost is finite and at most 1e30, or +∞ for a candidate that diverges; never NaN. It depends on the candidate
/// and its problem alone, not on what else is in the batch.
pub trait Evaluator: Send {
    /// Writes the cost of every candidate, group after group, to `costs`.
    ///
    /// # Errors
    /// `Usage` when lengths do not fit; `Device` when the device fails.
    fn evaluate(&mut self, batch: &Batch<'_>, costs: &mut [f64]) -> Result<()>;

    /// Begins a batch. An evaluator with a device of its own computes while the caller goes on; others do all the work
    /// in `finish`.
    ///
    /// # Errors
    /// As for [`Evaluator::evaluate`].
    fn begin(&mut self, batch: &Batch<'_>) -> Result<Pending> {
        batch.check_candidates().map(|()| Pending::default())
    }

    /// Waits for the same batch and writes its costs.
    ///
    /// # Errors
    /// As for [`Evaluator::evaluate`].
    fn finish(&mut self, batch: &Batch<'_>, pending: Pending, costs: &mut [f64]) -> Result<()> {
        drop(pending);
        self.evaluate(batch, costs)
    }

    /// Returns whether something is gained by beginning a batch before the last is finished.
    fn overlaps(&self) -> bool {
        false
    }

    /// Returns whether costs are those of f64. Where they are not, searches evaluate their leaders again on the CPU.
    fn is_exact(&self) -> bool {
        true
    }

    /// Evaluates, and returns the seconds that its device computed by the device's own clock; `None` without one.
    ///
    /// # Errors
    /// As for [`Evaluator::evaluate`].
    fn evaluate_timed(&mut self, batch: &Batch<'_>, costs: &mut [f64]) -> Result<Option<f64>> {
        self.evaluate(batch, costs).map(|()| None)
    }

    /// Returns a description of the device.
    fn name(&self) -> String {
        "an evaluator of the caller".to_owned()
    }
}
