//! The SIMD evaluator of users' models.

use super::problem::ModelProblem;
use crate::evaluator::{Batch, Evaluator};
use crate::same_problem::{as_one, by_problem};
use crate::simd::Simd;
use motorfit_core::Result;

impl Evaluator<ModelProblem> for Simd {
    /// Evaluates candidates on all threads of the current rayon pool. Groups with the same problem fill blocks of candidates together.
    fn evaluate(&mut self, batch: &Batch<'_, ModelProblem>, costs: &mut [f64]) -> Result<()> {
        batch.check(costs)?;
        let mut problems = by_problem(batch.groups, costs).into_iter();
        problems.try_for_each(|groups| as_one(groups, |group, costs| group.problem.costs(group.candidates, costs)))
    }

    fn name(&self) -> String {
        Self::name(*self)
    }
}
