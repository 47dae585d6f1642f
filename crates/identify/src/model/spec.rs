//! Settings of an identification with a user's model.

use super::terms::{ModelTerms, with_generic};
use crate::device::{DeviceSettings, DeviceSpec, PrecisionSpec};
use crate::method::Method;
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_evaluate::criterion::Criterion;
use motorfit_evaluate::model::{ModelProblem, ModelRecording, ModelSettings, ModelSpace};
use motorfit_model::{IntegrationMethod, Model};

/// Settings of an identification with a user's model.
#[derive(Debug, Clone)]
pub struct ModelSpec {
    /// Method that finds the first optimum; [`Method::Auto`] is a multistart.
    pub method: Method,
    /// True if the first optimum is refined, which gives the standard errors.
    pub is_polished: bool,
    /// Number of candidates in a population.
    pub population: usize,
    /// Number of generations.
    pub generations: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Criterion that a population search minimizes.
    pub criterion: Criterion,
    /// Bounds of parameters that replace those of the model.
    pub bounds: Vec<(String, [f64; 2])>,
    /// Values of parameters that are fixed.
    pub fixed: Vec<(String, f64)>,
    /// Starts of further descents, beside those of the search: values of parameters. Others begin at their usual value, or in the middle
    /// of their bounds.
    pub starts: Vec<Vec<(String, f64)>>,
    /// Optional terms of the model.
    pub with: ModelTerms,
    /// Parameters with a value for each recording.
    pub per_recording: Vec<String>,
    /// True if the initial values of states that are measured or free are estimated.
    pub estimates_initial: bool,
    /// True if inputs are linear between samples.
    pub is_first_order_hold: bool,
    /// Integration method and number of substeps; `None` chooses them.
    pub integration: Option<(IntegrationMethod, usize)>,
    /// Device that evaluates populations; `auto` is the CPU.
    pub device: DeviceSpec,
    /// Precision of the evaluation of populations.
    pub precision: PrecisionSpec,
}

impl Default for ModelSpec {
    fn default() -> Self {
        Self {
            method: Method::Auto,
            is_polished: true,
            population: 100,
            generations: 100,
            seed: 1,
            criterion: Criterion::default(),
            bounds: Vec::new(),
            fixed: Vec::new(),
            starts: Vec::new(),
            with: ModelTerms::default(),
            per_recording: Vec::new(),
            estimates_initial: true,
            is_first_order_hold: false,
            integration: None,
            device: DeviceSpec::Auto,
            precision: PrecisionSpec::Auto,
        }
    }
}

impl ModelSpec {
    /// Returns the search space of a model with its terms.
    ///
    /// # Errors
    /// Returns `Usage` if a name is not a parameter or a term, a value does not suit it, or the terms are selected by fits.
    pub fn space(&self, model: &Model, recordings: usize) -> Result<ModelSpace> {
        self.space_with(model, recordings, &self.taken(model)?)
    }

    /// Returns the problem of a model with the terms of the spec.
    ///
    /// # Errors
    /// Returns the errors of [`ModelSpec::space`], of which the names of generic terms cause none, and of [`ModelProblem::new`].
    pub fn problem(&self, model: &Model, recordings: Vec<ModelRecording>) -> Result<ModelProblem> {
        self.problem_with(model, recordings, &self.taken(model)?)
    }

    /// Returns the problem of a model with some of its terms and generic ones.
    pub(super) fn problem_with(
        &self,
        model: &Model,
        recordings: Vec<ModelRecording>,
        with: &[String],
    ) -> Result<ModelProblem> {
        let model = with_generic(model, with)?;
        let space = self.space_with(&model, recordings.len(), with)?;
        ModelProblem::new(&model, space, recordings, self.settings())
    }

    /// Returns the names of the terms.
    ///
    /// # Errors
    /// Returns `Usage` if they are selected by fits.
    pub(super) fn taken(&self, model: &Model) -> Result<Vec<String>> {
        self.with.taken(model).ok_or_else(|| {
            let message = text!([With = "auto"] " selects terms by fits, and nothing is fitted here");
            Error::usage(message, text!("Name the terms, or leave out " [With] " to take all."))
        })
    }

    /// Returns the search space of a model with some of its terms.
    pub(super) fn space_with(&self, model: &Model, recordings: usize, with: &[String]) -> Result<ModelSpace> {
        let mut space = ModelSpace::new(model, recordings).per_recording(model, &self.per_recording, recordings)?;
        for (name, bounds) in &self.bounds {
            space = space.with_bounds(model, name, *bounds)?;
        }
        let taken: Vec<&str> = with.iter().map(String::as_str).collect();
        for (parameter, value) in model.parameters().iter().zip(model.fixed_without(&taken)?) {
            if let Some(value) = value {
                space = space.with_fixed(model, &parameter.name, value)?;
            }
        }
        for (name, value) in &self.fixed {
            space = space.with_fixed(model, name, *value)?;
        }
        Ok(space)
    }

    /// Returns the settings of a problem.
    #[must_use]
    pub fn settings(&self) -> ModelSettings {
        ModelSettings {
            criterion: self.criterion,
            is_first_order_hold: self.is_first_order_hold,
            method: self.integration,
            has_known_initial: !self.estimates_initial,
        }
    }
}

impl From<&ModelSpec> for DeviceSettings {
    fn from(spec: &ModelSpec) -> Self {
        let &ModelSpec { precision, population, generations, .. } = spec;
        Self { device: spec.device.clone(), precision, population, generations, ..Self::default() }
    }
}
