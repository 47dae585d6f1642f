//! The part of a result that only those with a user's model have.

use crate::analysis::ResidualTests;
use crate::estimates::Combination;
use crate::result::Identification;
use motorfit_evaluate::model::{ModelMethod, ModelSpace};
use motorfit_model::Model;

/// The fit of a model on one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelFit {
    /// Simulated outputs, shape `[outputs][samples]`, in their units.
    pub simulated: Vec<Vec<f64>>,
    /// Fit `100 (1 − ‖y − ŷ‖/‖y − mean y‖)` of each output \[%\]; `None` for one that was not measured or does not vary.
    pub fit_percent: Vec<Option<f64>>,
    /// Root mean square of the residuals of each output.
    pub residual_sigma: Vec<Option<f64>>,
    /// Tests of the residuals of each output.
    pub residuals: ResidualTests,
    /// Initial values of the states that are measured or free, in their units.
    pub initial: Vec<f64>,
    /// Outputs simulated with the first given start, or else the usual values of all parameters, from the first samples; `None` without
    /// these, and where the model diverges.
    pub at_start: Option<Vec<Vec<f64>>>,
}

/// The user's model of a result.
#[derive(Debug, Clone)]
pub struct OwnModel {
    /// The model.
    pub model: Model,
    /// Search space.
    pub space: ModelSpace,
    /// Integration method.
    pub method: ModelMethod,
    /// Parameters that the recordings cannot distinguish, as sentences.
    pub combinations: Vec<String>,
    /// Combinations of these parameters that the recordings identify.
    pub identified: Vec<Combination>,
    /// Fit of each recording.
    pub fits: Vec<ModelFit>,
    /// Fit of each held-out recording.
    pub held_out: Vec<ModelFit>,
    /// Fit of each output over the held-out recordings \[%\]; empty if there are none.
    pub held_out_percent: Vec<Option<f64>>,
}

/// The result of an identification with a user's model.
pub type ModelIdentification = Identification<OwnModel>;
