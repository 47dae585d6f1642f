//! Costs of candidates from anywhere, on the device that a spec asks for.

use super::current_driven::needs_voltage;
use super::model_selection::named_space;
use super::spec::IdentifySpec;
use super::start::{around, on_any_clock};
use crate::Result;
use crate::candidates::Candidates;
use crate::device::BatchSearchEvaluator;
use crate::estimate::fit_problem;
use crate::evaluate::Problem;
use crate::motor::Space;
use crate::optimize::Evaluate as _;
use crate::record::Record;
use crate::warning::Warning;
use std::sync::Arc;

/// Evaluates tables of candidates, one after the other.
pub struct BatchCosts {
    problem: Arc<Problem>,
    evaluation: BatchSearchEvaluator,
}

impl BatchCosts {
    /// Prepares recordings. Bounds that follow the Steiglitz–McBride estimate do so where there is one. The spec's
    /// population and generations say how many candidates will come, for the choice of a device.
    ///
    /// # Errors
    /// As for a problem; `Device` when the device that is asked for is not there.
    pub fn new(records: &[Record], spec: &IdentifySpec) -> Result<Self> {
        let space = search_space(records, spec)?;
        let problem = Arc::new(Problem::new(records, spec.model, space, spec.criterion)?);
        let evaluation = BatchSearchEvaluator::open(spec, vec![problem.clone()])?;
        Ok(Self { problem, evaluation })
    }

    /// Returns the problem, whose space lists the values of a candidate.
    #[must_use]
    pub fn problem(&self) -> &Arc<Problem> {
        &self.problem
    }

    /// Costs of row-major `values`, one per candidate.
    ///
    /// # Errors
    /// `Usage` when lengths do not fit; `Device` when the device fails.
    pub fn evaluate(&mut self, values: &[f64], costs: &mut [f64]) -> Result<()> {
        self.begin(values)?;
        self.finish(values, costs)
    }

    /// Begins the same: a device of its own computes while the caller goes on. What is begun first is finished first; two
    /// at a time are enough.
    ///
    /// # Errors
    /// As for [`BatchCosts::evaluate`].
    pub fn begin(&mut self, values: &[f64]) -> Result<()> {
        let candidates = self.candidates(values)?;
        self.evaluation.begin(&[candidates])
    }

    /// Waits for the costs of what was begun first.
    ///
    /// # Errors
    /// As for [`BatchCosts::evaluate`].
    pub fn finish(&mut self, values: &[f64], costs: &mut [f64]) -> Result<()> {
        let candidates = self.candidates(values)?;
        self.evaluation.finish(&[candidates], costs)
    }

    fn candidates<'a>(&self, values: &'a [f64]) -> Result<Candidates<'a>> {
        let width = self.problem.space().free().len();
        if !values.len().is_multiple_of(width) {
            let message = format!("{} values are not whole rows of {width}", values.len());
            return Err(crate::Error::usage(message, "Give one value per free parameter."));
        }
        Ok(Candidates::new(values, width))
    }

    /// Returns the device that evaluates: its kind (cpu or gpu), its name, its precision.
    #[must_use]
    pub fn device(&self) -> (&'static str, String, &'static str) {
        self.evaluation.device()
    }

    /// Returns warnings for the reader.
    #[must_use]
    pub fn warnings(&self) -> &[Warning] {
        self.evaluation.warnings()
    }
}

/// Bounds that follow the Steiglitz–McBride estimate do so where there is one.
fn search_space(records: &[Record], spec: &IdentifySpec) -> Result<Space> {
    needs_voltage(records)?;
    if spec.is_extended() {
        return named_space(records, spec);
    }
    if spec.auto_bounds.is_empty() {
        return Ok(spec.space.clone());
    }
    match on_any_clock(records, spec, &fit_problem(records, &spec.space, spec.model)?)? {
        Ok(estimate) => around(spec, &[estimate.parameters.to_array()]),
        Err(_) => Ok(spec.space.clone()),
    }
}
