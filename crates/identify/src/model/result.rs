//! The result of an identification with a user's model.

use crate::analysis::ResidualTest;
use crate::device::DeviceUsed;
use crate::trust_level::Trust;
use motorfit_estimate::Uncertainty;
use motorfit_evaluate::model::{ModelMethod, ModelSpace};
use motorfit_model::Model;
use motorfit_optimize::Stop;
use motorfit_record::warning::Warning;
use serde::Serialize;

/// The estimate of a parameter, or its fixed value.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelEstimate {
    /// Name of the parameter in the model.
    #[serde(skip)]
    pub name: String,
    /// Number of the recording whose parameter this is; `None` for all.
    #[serde(rename = "record", skip_serializing_if = "Option::is_none")]
    pub recording: Option<usize>,
    /// Value in the unit of the parameter; `None` if it is not identifiable.
    pub value: Option<f64>,
    /// Unit as written in the model.
    pub unit: String,
    /// Standard error.
    pub std_error: Option<f64>,
    /// 95 % confidence interval.
    pub ci95: Option<[f64; 2]>,
    /// Bound that the parameter ended at.
    pub at_bound: Option<&'static str>,
    /// True if the value was given.
    pub fixed: bool,
}

impl ModelEstimate {
    /// Returns the name with the index of the recording if the parameter is that of one, as `R[0]`.
    #[must_use]
    pub fn label(&self) -> String {
        self.recording.map_or_else(|| self.name.clone(), |n| format!("{}[{n}]", self.name))
    }
}

/// A combination of parameters that recordings identify, while they do not identify each of them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Combination {
    /// Expression of the parameters, as `J/K`.
    pub name: String,
    /// Value in the units of the parameters.
    pub value: f64,
    /// Unit.
    pub unit: String,
    /// Standard error.
    pub std_error: f64,
    /// 95 % confidence interval.
    pub ci95: [f64; 2],
}

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
    pub residuals: Vec<Option<ResidualTest>>,
    /// Initial values of the states that are measured or free, in their units.
    pub initial: Vec<f64>,
    /// Outputs simulated with the first given start, or else the usual values of all parameters, from the first samples; `None` without
    /// these, and where the model diverges.
    pub at_start: Option<Vec<Vec<f64>>>,
}

/// The first optimum, before the refinement.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelSearch {
    /// Name of the method.
    pub method: &'static str,
    /// Values of the free parameters.
    pub values: Vec<f64>,
    /// Cost in the criterion of the spec.
    pub cost: f64,
}

/// Comparison of the result with descents from other starts.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelVerification {
    /// `agrees`, `search_stuck`, `reference_failed` or `not_applicable`.
    pub status: &'static str,
    /// Number of starts over the bounds.
    pub starts: usize,
    /// Number of these starts from which the lowest optimum was reached.
    pub arrivals: usize,
    /// Sum of squares of the result above that of the lowest optimum, relative to it.
    pub cost_gap: Option<f64>,
}

/// A model with some of its optional terms that the selection fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelStep {
    /// Optional terms of the model.
    pub with: Vec<String>,
    /// Number of free parameters.
    pub free: usize,
    /// Fit of each output \[%\].
    pub fit_percent: Vec<Option<f64>>,
    /// BIC (Schwarz, 1978) minus the BIC of its predecessor in the selection: negative if this model is better. `None` for the model
    /// without optional terms.
    pub gain: Option<f64>,
    /// True if the selection continued with this model.
    pub taken: bool,
}

/// A model with other terms whose BIC cannot be distinguished from that of the selected model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelAlternative {
    /// Optional terms of the model.
    pub with: Vec<String>,
    /// Fit of each output \[%\].
    pub fit_percent: Vec<Option<f64>>,
    /// BIC minus the BIC of the selected model.
    pub gain: f64,
    /// Free parameters with their estimates.
    pub parameters: Vec<(String, f64)>,
}

/// Selection of the optional terms of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelSelection {
    /// Terms that were selected.
    pub with: Vec<String>,
    /// Models that were fitted, in their order.
    pub steps: Vec<ModelStep>,
    /// Models that fit the recordings equally well.
    pub alternatives: Vec<ModelAlternative>,
}

/// The result of an identification with a user's model.
#[derive(Debug, Clone)]
pub struct ModelIdentification {
    /// Level of trust with its reasons.
    pub trust: Trust,
    /// Parameters in the order of the model, those of single recordings once for each.
    pub estimates: Vec<ModelEstimate>,
    /// Values of the free parameters in the order of the space.
    pub values: Vec<f64>,
    /// Search space.
    pub space: ModelSpace,
    /// The model, with its generic terms.
    pub model: Model,
    /// Optional terms of the model.
    pub with: Vec<String>,
    /// Selection of the terms; `None` if they were given.
    pub selection: Option<ModelSelection>,
    /// Integration method.
    pub method: ModelMethod,
    /// First optimum.
    pub searched: ModelSearch,
    /// Cost of the result in the criterion of the spec, with its estimated initial values.
    pub cost: f64,
    /// Uncertainty; `None` without a refinement.
    pub uncertainty: Option<Uncertainty>,
    /// Parameters that the recordings cannot distinguish, as sentences.
    pub combinations: Vec<String>,
    /// Combinations of these parameters that the recordings identify.
    pub identified: Vec<Combination>,
    /// True if the refinement converged.
    pub converged: bool,
    /// Fit of each output over all recordings \[%\].
    pub fit_percent: Vec<Option<f64>>,
    /// Root mean square of the residuals of each output over all recordings.
    pub residual_sigma: Vec<Option<f64>>,
    /// Fit of each recording.
    pub fits: Vec<ModelFit>,
    /// Fit of each held-out recording.
    pub held_out: Vec<ModelFit>,
    /// Fit of each output over the held-out recordings \[%\]; empty if there are none.
    pub held_out_percent: Vec<Option<f64>>,
    /// Comparison with other starts.
    pub verification: ModelVerification,
    /// Device that evaluated populations.
    pub device: DeviceUsed,
    /// Warnings and remarks.
    pub warnings: Vec<Warning>,
    /// Reason for which the search ended.
    pub stop: Stop,
    /// Number of evaluated candidates.
    pub evaluations: u64,
    /// Lowest cost after each generation of a population search.
    pub history: Vec<f64>,
    /// Duration of the estimation \[s\].
    pub seconds: f64,
}
