//! Comparison of search methods: all runs of all methods under each setting, with the candidates of a generation
//! evaluated as one batch, for the DC motor or a user's model.
//!
//! Runs with the same number start from the same random numbers, and so from the same population for every method that begins with a
//! uniform one. Comparisons between methods are therefore paired.

mod at_bound;
mod engine;
mod estimates;
mod invariance;
mod model_engine;
mod motor_engine;
mod parameter;
mod ranking;
mod reference;
mod run;
mod settings;
mod subject;

pub mod paper;
mod spec;
mod steiglitz;
mod targets;

pub use estimates::MethodEstimates;
pub use invariance::{Invariance, InvarianceTest};
pub use parameter::{ComparedParameter, Domain};
pub use ranking::{FEW, PairwiseTest, Ranking, Summary};
pub use reference::Reference;
pub use settings::CompareSettings;
pub use spec::{CompareSpec, ComparisonSetting, Preset};
pub use steiglitz::Steiglitz;
pub use subject::{ComparedMachine, ComparedModel, ComparisonSubject};
pub use targets::{Reached, reached};

use motorfit_core::setting::{Text, text};
use motorfit_core::{Error, Result};
use motorfit_identify::Method;
use motorfit_identify::analysis::warnings_of_records;
use motorfit_identify::device::DeviceUsed;
use motorfit_optimize::Progress;
use motorfit_record::Record;
use motorfit_record::warning::Warning;
use run::ComparisonRun;
use std::ops::ControlFlow;

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

/// Largest work of the estimates that an interrupted comparison still computes \[samples\].
const INTERRUPTED_MAX: usize = 4_000_000;

/// Compares methods. `observe` receives the progress after every generation and may end the comparison; the results
/// until then are kept.
///
/// # Errors
/// Returns a `Usage` error for invalid settings, and for Steiglitz–McBride or local searches on a model; a `Data` or
/// `NotIdentified` error for unsuitable recordings; and a `Device` error if the requested device is missing or fails.
pub fn compare(
    subject: ComparisonSubject,
    spec: &CompareSpec,
    observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Comparison> {
    check(spec)?;
    let mut engine = engine::open(&subject, spec)?;
    let mut blocks: Vec<Block> = spec.settings.iter().map(empty).collect();
    let mut run = ComparisonRun::new(spec, engine.as_mut());
    let mut interrupted = run.all(&mut blocks, observe)?;
    let ComparisonRun { evaluations, batch_seconds, last, .. } = run;
    // An interrupted comparison still computes the estimates that take no more than some tenths of a second.
    let samples: usize = subject.records.iter().map(Record::len).sum();
    let has = |work: usize| !interrupted || work <= INTERRUPTED_MAX;
    let has_reference = has(engine.reference_work());
    let steiglitz_work = samples.saturating_mul(spec.noise_records.saturating_add(motor_engine::REFERENCE));
    let has_steiglitz = spec.steiglitz_mcbride && has(steiglitz_work);
    let mut look = || {
        let flow = observe(&last);
        interrupted |= flow.is_break();
        flow
    };
    let reference =
        if has_reference { engine.reference(&mut look) } else { Err("interrupted before it was run".into()) };
    let motor = reference.as_ref().ok().and_then(Reference::motor);
    let steiglitz = has_steiglitz.then(|| Steiglitz::of(&subject, spec, motor)).transpose()?;
    for (setting, block) in blocks.iter_mut().enumerate() {
        block.reference_cost = reference.as_ref().ok().and_then(|found| engine.reference_cost(setting, found));
        block.steiglitz_cost = steiglitz.as_ref().and_then(|sm| sm.cost(&subject, spec, &block.setting));
    }
    let mut warnings = engine.warnings();
    if matches!(subject.machine, ComparedMachine::Motor { truth: None }) && has_reference {
        warnings.extend(warnings_of_records(&subject.records));
    }
    let (parameters, initial, device) = (engine.parameters(), engine.initial(), engine.device());
    drop(engine);
    let mut comparison = Comparison {
        subject,
        parameters,
        spec: spec.clone(),
        blocks,
        steiglitz,
        reference,
        initial,
        device,
        warnings,
        invariance: Vec::new(),
        interrupted,
        evaluations,
        batch_seconds,
    };
    comparison.invariance = comparison.invariance_tests();
    let of_box = at_bound::of_box(&comparison);
    comparison.warnings.extend(of_box);
    Ok(comparison)
}

/// Largest number of runs of each method.
pub(crate) const RUNS_MAX: usize = 100_000;

fn check(spec: &CompareSpec) -> Result<()> {
    if spec.settings.is_empty() || spec.runs == 0 || spec.settings.iter().any(|s| s.methods.is_empty()) {
        return Err(Error::usage("there is nothing to compare", "Give at least one method, criterion and run."));
    }
    if spec.runs > RUNS_MAX {
        return Err(Error::usage(text!([Runs](" is {}", spec.runs)), format!("Give at most {RUNS_MAX}.")));
    }
    if spec.target.is_some_and(|cost| !(cost.is_finite() && cost > 0.0)) {
        return Err(Error::usage(text!([Target] " is not a cost"), "Give a positive number."));
    }
    Ok(())
}

fn empty(setting: &ComparisonSetting) -> Block {
    let result = |method: &Method| MethodResult { method: *method, runs: Vec::new(), seconds: None };
    let results = setting.methods.iter().map(result).collect();
    Block { setting: setting.clone(), results, reference_cost: None, steiglitz_cost: None }
}
