//! Costs of given candidates on the device of a spec.

use super::current_driven::needs_voltage;
use super::model_selection::named_space;
use super::normalized::is_usual;
use super::pipeline::identify;
use super::spec::IdentifySpec;
use super::start::{around, on_any_clock};
use crate::device::{BatchSearchEvaluator, DeviceSettings, DeviceUsed};
use motorfit_core::Result;
use motorfit_core::candidates::Candidates;
use motorfit_estimate::fit_problem;
use motorfit_evaluate::Problem;
use motorfit_motor::Space;
use motorfit_optimize::Evaluate as _;
use motorfit_record::Record;
use motorfit_record::warning::Warning;
use std::sync::Arc;

/// Evaluates tables of candidates one after another.
pub struct BatchCosts {
    problem: Arc<Problem>,
    evaluation: BatchSearchEvaluator,
}

impl BatchCosts {
    /// Prepares recordings. Automatic bounds are set around the Steiglitz–McBride estimate if there is one. The device is
    /// selected for as many candidates as the spec's population times its generations.
    ///
    /// # Errors
    /// Propagates the errors of [`Problem::new`]; returns `Data` for a recording without a voltage and `Device` if the
    /// requested device is not available.
    pub fn new(records: &[Record], spec: &IdentifySpec) -> Result<Self> {
        let space = search_space(records, spec)?;
        let problem = Arc::new(Problem::new(records, spec.model, space, spec.criterion)?);
        let device = DeviceSettings { needs_all_costs: true, ..spec.into() };
        let evaluation = BatchSearchEvaluator::open(device, vec![problem.clone()])?;
        Ok(Self { problem, evaluation })
    }

    /// Returns the problem, whose space defines the order of a candidate's values.
    #[must_use]
    pub fn problem(&self) -> &Arc<Problem> {
        &self.problem
    }

    /// Computes the cost of each candidate of the row-major table `values`, shape `[candidates, parameters]`.
    ///
    /// # Errors
    /// Returns `Usage` if the lengths do not match and `Device` if the device fails.
    pub fn evaluate(&mut self, values: &[f64], costs: &mut [f64]) -> Result<()> {
        self.begin(values)?;
        self.finish(values, costs)
    }

    /// Submits candidates to the device and returns, so that the caller can continue while a GPU computes. Batches are finished
    /// in the order in which they begin; two at a time keep the device busy.
    ///
    /// # Errors
    /// Returns the same errors as [`BatchCosts::evaluate`].
    pub fn begin(&mut self, values: &[f64]) -> Result<()> {
        let candidates = self.candidates(values)?;
        self.evaluation.begin(&[candidates])
    }

    /// Waits for the costs of the oldest batch that [`BatchCosts::begin`] submitted.
    ///
    /// # Errors
    /// Returns the same errors as [`BatchCosts::evaluate`].
    pub fn finish(&mut self, values: &[f64], costs: &mut [f64]) -> Result<()> {
        let candidates = self.candidates(values)?;
        self.evaluation.finish(&[candidates], costs)
    }

    fn candidates<'a>(&self, values: &'a [f64]) -> Result<Candidates<'a>> {
        let width = self.problem.space().free().len();
        if !values.len().is_multiple_of(width) {
            let message = format!("{} values are not complete rows of {width}", values.len());
            return Err(motorfit_core::Error::usage(message, "Give one value per free parameter."));
        }
        Ok(Candidates::new(values, width))
    }

    /// Returns the work of a candidate by which batches are sized, in steps of the kernel on the CPU.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.evaluation.steps(&self.problem)
    }

    /// Returns the device.
    #[must_use]
    pub fn device(&self) -> DeviceUsed {
        self.evaluation.device()
    }

    /// Returns the warnings of the device.
    #[must_use]
    pub fn warnings(&self) -> &[Warning] {
        self.evaluation.warnings()
    }
}

/// Returns the search space of the spec, with automatic bounds around the Steiglitz–McBride estimate if there is one.
fn search_space(records: &[Record], spec: &IdentifySpec) -> Result<Space> {
    needs_voltage(records)?;
    if spec.is_extended() {
        return named_space(records, spec);
    }
    Ok(around_estimate(records, spec)?.unwrap_or_else(|| spec.space.clone()))
}

/// Returns the space of the spec with automatic bounds around the Steiglitz–McBride estimate; `None` if there is no estimate,
/// or if all bounds are given.
fn around_estimate(records: &[Record], spec: &IdentifySpec) -> Result<Option<Space>> {
    if spec.auto_bounds.is_empty() {
        return Ok(None);
    }
    let estimate = on_any_clock(records, spec, &fit_problem(records, &spec.space, spec.model)?)?;
    estimate.ok().map(|estimate| around(spec, &[estimate.parameters.to_array()])).transpose()
}

/// Returns the search space of the linear motor, with automatic bounds around the Steiglitz–McBride estimate, or around the
/// refined estimate where that fails. Without any estimate the bounds are those of the spec.
///
/// # Errors
/// Returns `Data` for recordings without a voltage, and propagates the errors of the Steiglitz–McBride estimates.
pub fn estimated_space(records: &[Record], spec: &IdentifySpec) -> Result<Space> {
    needs_voltage(records)?;
    let is_known = |motor: &[f64; 5]| motor.iter().all(is_usual);
    let refined = || {
        let motor = identify(records, spec).ok()?.parameters.to_array();
        Some(motor).filter(is_known).and_then(|motor| around(spec, &[motor]).ok())
    };
    if spec.auto_bounds.is_empty() {
        return Ok(spec.space.clone());
    }
    Ok(around_estimate(records, spec)?.or_else(refined).unwrap_or_else(|| spec.space.clone()))
}
