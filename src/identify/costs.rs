//! Costs of candidates from anywhere, on the device that a spec asks for.

use super::device::Evaluation;
use super::search::{around, steiglitz_mcbride};
use super::spec::IdentifySpec;
use super::warnings::Warning;
use crate::Result;
use crate::candidates::Candidates;
use crate::evaluate::Problem;
use crate::record::Record;
use std::sync::Arc;

/// Evaluates tables of candidates, one after the other.
pub struct Costs {
    problem: Arc<Problem>,
    evaluation: Evaluation,
}

impl Costs {
    /// Prepares recordings. Bounds that follow the Steiglitz–McBride estimate do so where there is one. The spec's
    /// population and generations say how many candidates will come, for the choice of a device.
    ///
    /// # Errors
    /// As for a problem; `Device` when the device that is asked for is not there.
    pub fn new(records: &[Record], spec: &IdentifySpec) -> Result<Self> {
        let space = match steiglitz_mcbride(records, spec)? {
            Ok(estimate) if !spec.auto_bounds.is_empty() => around(spec, &estimate)?,
            _ => spec.space.clone(),
        };
        let problem = Arc::new(Problem::new(records, spec.model, space, spec.criterion)?);
        let evaluation = Evaluation::new(spec, &problem)?;
        Ok(Self { problem, evaluation })
    }

    /// What is evaluated: its space says which values a candidate has.
    #[must_use]
    pub fn problem(&self) -> &Arc<Problem> {
        &self.problem
    }

    /// Costs of row-major `values`, one per candidate.
    ///
    /// # Errors
    /// `Usage` when lengths do not fit; `Device` when the device fails.
    pub fn evaluate(&mut self, values: &[f64], costs: &mut [f64]) -> Result<()> {
        let width = self.problem.space().free().len();
        if !values.len().is_multiple_of(width) {
            let message = format!("{} values are not whole rows of {width}", values.len());
            return Err(crate::Error::usage(message, "Give one value per free parameter."));
        }
        self.evaluation.evaluate(&self.problem, &[Candidates::new(values, width)], costs)
    }

    /// What evaluates: cpu or gpu, its name, its numbers.
    #[must_use]
    pub fn device(&self) -> (&'static str, String, &'static str) {
        (self.evaluation.kind(), self.evaluation.name(), self.evaluation.precision())
    }

    /// What the reader should know.
    #[must_use]
    pub fn warnings(&self) -> &[Warning] {
        &self.evaluation.warnings
    }
}
