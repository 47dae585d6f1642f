//! Costs of given candidates of a model on the device of a spec.

use super::spec::ModelSpec;
use super::terms::with_generic;
use crate::device::{DeviceUsed, ModelDevice};
use motorfit_core::candidates::Candidates;
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_evaluate::model::{ModelProblem, ModelRecording};
use motorfit_model::Model;
use motorfit_record::warning::Warning;

/// Operations of a step of the linear motor.
const OPERATIONS: usize = 8;

/// Evaluates tables of candidates of a model one after another.
pub struct ModelCosts {
    problem: ModelProblem,
    device: ModelDevice,
}

impl ModelCosts {
    /// Prepares recordings and opens the device of the spec.
    ///
    /// # Errors
    /// Returns `Usage` if no parameter is free, and the errors of [`ModelSpec::space`], [`ModelProblem::new`] and [`ModelDevice::open`].
    pub fn new(model: &Model, recordings: Vec<ModelRecording>, spec: &ModelSpec) -> Result<Self> {
        let with = spec.taken(model)?;
        let model = &*with_generic(model, &with)?;
        let space = spec.space_with(model, recordings.len(), &with)?;
        if space.free.is_empty() {
            return Err(Error::usage("every parameter is fixed", text!("Leave one out of " [Fix] ".")));
        }
        let problem = ModelProblem::new(model, space, recordings, spec.settings())?;
        let device = ModelDevice::open(&spec.device, spec.precision, &problem)?;
        Ok(Self { problem, device })
    }

    /// Returns the problem, whose space defines the order of a candidate's values.
    #[must_use]
    pub fn problem(&self) -> &ModelProblem {
        &self.problem
    }

    /// Returns the names of the free parameters, as `R`, or `R[0]` for that of the first recording.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        self.problem.space().names(self.problem.model())
    }

    /// Computes the cost of each candidate of the row-major table `values`, shape `[candidates, parameters]`; +∞ for one that diverges.
    ///
    /// # Errors
    /// Returns `Usage` if the lengths do not match and `Device` if the device fails.
    pub fn evaluate(&mut self, values: &[f64], costs: &mut [f64]) -> Result<()> {
        let width = self.problem.space().free.len();
        if !values.len().is_multiple_of(width) {
            let message = format!("{} values are not complete rows of {width}", values.len());
            return Err(Error::usage(message, "Give one value per free parameter."));
        }
        self.device.evaluator.costs(&self.problem, Candidates::new(values, width), costs)
    }

    /// Returns the number of steps of the linear motor that take as long as the evaluation of a candidate, for the size of batches.
    #[must_use]
    pub fn steps(&self) -> usize {
        let samples: usize = (0..self.problem.recordings()).map(|n| self.problem.recording(n).len()).sum();
        samples * (self.problem.work() / OPERATIONS).max(1)
    }

    /// Returns the device.
    #[must_use]
    pub fn device(&self) -> DeviceUsed {
        self.device.used()
    }

    /// Returns the warnings of the device.
    #[must_use]
    pub fn warnings(&self) -> &[Warning] {
        &self.device.warnings
    }
}
