//! The result of a comparison.

use super::invariance_test::InvarianceTest;
use super::parameter::ComparedParameter;
use super::reference::Reference;
use super::spec::{CompareSpec, ComparisonSetting};
use super::steiglitz::Steiglitz;
use super::subject::ComparisonSubject;
use motorfit_core::setting::Text;
use motorfit_identify::Method;
use motorfit_identify::device::DeviceUsed;
use motorfit_record::warning::Warning;

/// Result of one run.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Best values of the parameters in the order of [`Comparison::parameters`]; `None` if every candidate diverged.
    pub parameters: Option<Vec<f64>>,
    /// Cost of the best parameters, evaluated on the CPU in f64; +∞ if every candidate diverged.
    pub cost: f64,
    /// Lowest cost after each generation.
    pub history: Vec<f64>,
    /// Number of candidates evaluated.
    pub evaluations: u64,
}

/// Results of one method under one setting.
#[derive(Debug, Clone, PartialEq)]
pub struct MethodResult {
    /// The method.
    pub method: Method,
    /// Runs in the order of their numbers.
    pub runs: Vec<Outcome>,
    /// Time of a single run \[s\]; `None` if the comparison was interrupted before it was measured.
    pub seconds: Option<f64>,
}

/// Results of all methods under one setting.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// The setting.
    pub setting: ComparisonSetting,
    /// Results by method, in the order of the setting.
    pub results: Vec<MethodResult>,
    /// Cost of the refined estimate in this criterion; `None` without one, or if its initial states of a DC motor differ
    /// from those of the searches.
    pub reference_cost: Option<f64>,
    /// Cost of the Steiglitz–McBride estimate in this criterion; `None` without one.
    pub steiglitz_cost: Option<f64>,
}

/// Result of a comparison.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// The machine that methods are compared on.
    pub subject: ComparisonSubject,
    /// Parameters of the machine: names, units, bounds and fixed values.
    pub parameters: Vec<ComparedParameter>,
    /// Settings of the comparison.
    pub spec: CompareSpec,
    /// Results, one block per setting.
    pub blocks: Vec<Block>,
    /// Results of Steiglitz–McBride; `None` if not requested or interrupted before.
    pub steiglitz: Option<Steiglitz>,
    /// Refined estimate of the recordings, or the reason why there is none.
    pub reference: std::result::Result<Reference, Text>,
    /// Initial state `[i, ω]` of a DC motor in each recording in the searches \[A, rad/s\]; empty for a model.
    pub initial: Vec<[f64; 2]>,
    /// Device that evaluated.
    pub device: DeviceUsed,
    /// Warnings about the recordings, the device and the box.
    pub warnings: Vec<Warning>,
    /// Tests of each method in other coordinates; empty without any.
    pub invariance: Vec<InvarianceTest>,
    /// True if the observer ended the comparison early.
    pub interrupted: bool,
    /// Number of candidates evaluated.
    pub evaluations: u64,
    /// Time of all batches of runs \[s\].
    pub batch_seconds: f64,
}

impl Comparison {
    /// Returns the values of the parameters to which errors are relative, in the order of [`Self::parameters`]: the true ones if
    /// known, otherwise the refined estimate.
    #[must_use]
    pub fn expected(&self) -> Option<Vec<f64>> {
        let truth = self.subject.truth().map(|truth| truth.to_array().to_vec());
        truth.or_else(|| self.reference.as_ref().ok().map(|found| found.values(&self.parameters)))
    }
}

impl Block {
    /// Returns true if any run found a candidate that does not diverge.
    #[must_use]
    pub fn has_results(&self) -> bool {
        self.results.iter().flat_map(|result| &result.runs).any(|run| run.parameters.is_some())
    }
}
