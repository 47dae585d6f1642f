//! Costs of given candidates on the device of a spec.

use super::current_driven::needs_voltage;
use super::model::ModelSpec;
use super::model_selection::named_space;
use super::normalized::is_usual;
use super::pipeline::identify;
use super::spec::IdentifySpec;
use super::start::{around, on_any_clock};
use crate::device::{BatchSearchEvaluator, DeviceProblem, DeviceSettings, DeviceUsed, SearchEvaluator};
use motorfit_core::candidates::Candidates;
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_estimate::fit_problem;
use motorfit_evaluate::model::ModelRecording;
use motorfit_evaluate::{Problem, SearchProblem};
use motorfit_model::Model;
use motorfit_motor::Space;
use motorfit_record::Record;
use motorfit_record::warning::Warning;
use std::sync::Arc;

/// Evaluates tables of candidates one after another, for the DC motor or a user's model.
pub struct BatchCosts {
    problem: Arc<dyn SearchProblem>,
    evaluation: Box<dyn SearchEvaluator>,
}

impl BatchCosts {
    /// Prepares recordings of a DC motor. Automatic bounds are set around the Steiglitz–McBride estimate if there is one. The device is
    /// selected for as many candidates as the spec's population times its generations.
    ///
    /// # Errors
    /// Propagates the errors of [`search_problem`]; returns `Device` if the requested device is not available.
    pub fn new(records: &[Record], spec: &IdentifySpec) -> Result<Self> {
        Self::on(search_problem(records, spec)?, spec.into())
    }

    /// Prepares recordings of a model and opens the device of the spec.
    ///
    /// # Errors
    /// Returns `Usage` if no parameter is free, the errors of [`ModelSpec::problem`], and `Device` if the requested
    /// device is not available.
    pub fn of_model(model: &Model, recordings: Vec<ModelRecording>, spec: &ModelSpec) -> Result<Self> {
        let problem = spec.problem(model, recordings)?;
        if problem.space().free.is_empty() {
            return Err(Error::usage("every parameter is fixed", text!("Leave one out of " [Fix] ".")));
        }
        Self::on(problem, spec.into())
    }

    fn on<P: DeviceProblem>(problem: P, device: DeviceSettings) -> Result<Self> {
        let problem = Arc::new(problem);
        let device = DeviceSettings { needs_all_costs: true, ..device };
        let evaluation = Box::new(BatchSearchEvaluator::open(device, vec![problem.clone()])?);
        Ok(Self { problem, evaluation })
    }

    /// Returns the problem, whose free parameters define the order of a candidate's values.
    #[must_use]
    pub fn problem(&self) -> &dyn SearchProblem {
        self.problem.as_ref()
    }

    /// Computes the cost of each candidate of the row-major table `values`, shape `[candidates, parameters]`; +∞ for one that diverges.
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
        let width = self.problem.width();
        if !values.len().is_multiple_of(width) {
            let message = format!("{} values are not complete rows of {width}", values.len());
            return Err(Error::usage(message, "Give one value per free parameter."));
        }
        Ok(Candidates::new(values, width))
    }

    /// Returns the work of a candidate by which batches are sized, in steps of the kernel of the linear motor on the CPU.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.evaluation.steps()
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

/// Returns the problem of searches on recordings of a DC motor, with automatic bounds around the Steiglitz–McBride estimate if there is
/// one.
///
/// # Errors
/// Propagates the errors of [`Problem::new`], and returns `Data` for a recording without a voltage.
pub fn search_problem(records: &[Record], spec: &IdentifySpec) -> Result<Problem> {
    Problem::new(records, spec.model, search_space(records, spec)?, spec.criterion)
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
