//! Comparison of search methods: all runs of all methods under each setting, with the candidates of a generation
//! evaluated as one batch, for the DC motor or a user's model.
//!
//! Runs with the same number start from the same random numbers, and so from the same population for every method that begins with a
//! uniform one. Comparisons between methods are therefore paired.

mod at_bound;
mod engine;
mod estimates;
mod invariance;
mod invariance_test;
mod parameter;
mod precision;
mod ranking;
mod reference;
mod result;
mod run;
mod settings;
mod subject;

pub mod paper;
mod spec;
mod steiglitz;
mod targets;

pub use estimates::MethodEstimates;
pub use invariance_test::{Invariance, InvarianceTest};
pub use parameter::{ComparedParameter, Domain};
pub use precision::FEW;
pub use ranking::{PairwiseTest, Ranking, Summary};
pub use reference::Reference;
pub use result::{Block, Comparison, MethodResult, Outcome};
pub use settings::CompareSettings;
pub use spec::{CompareSpec, ComparisonSetting, Preset};
pub use steiglitz::Steiglitz;
pub use subject::{ComparedMachine, ComparedModel, ComparisonSubject};
pub use targets::{Reached, reached};

use engine::Engine;
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_identify::Method;
use motorfit_identify::analysis::warnings_of_records;
use motorfit_optimize::Progress;
use motorfit_record::Record;
use run::ComparisonRun;
use std::ops::ControlFlow;

/// Largest work of the estimates that an interrupted comparison still computes \[samples\].
const INTERRUPTED_MAX: usize = 4_000_000;
/// Work of the refined estimate of a DC motor, relative to Steiglitz–McBride on one record with new noise.
const REFERENCE: usize = 20;

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
    let mut engine = Engine::open(&subject, spec)?;
    let mut blocks: Vec<Block> = spec.settings.iter().map(empty).collect();
    let mut run = ComparisonRun::new(spec, &mut engine);
    let mut interrupted = run.all(&mut blocks, observe)?;
    let ComparisonRun { evaluations, batch_seconds, last, .. } = run;
    // An interrupted comparison still computes the estimates that take no more than some tenths of a second.
    let samples: usize = subject.records.iter().map(Record::len).sum();
    let has = |work: usize| !interrupted || work <= INTERRUPTED_MAX;
    // The multistart of a model evaluates thousands of candidates.
    let has_reference = has(subject.model().map_or(samples.saturating_mul(REFERENCE), |_| usize::MAX));
    let steiglitz_work = samples.saturating_mul(spec.noise_records.saturating_add(REFERENCE));
    let has_steiglitz = spec.steiglitz_mcbride && has(steiglitz_work);
    let mut look = || {
        let flow = observe(&last);
        interrupted |= flow.is_break();
        flow
    };
    let reference = if has_reference {
        Reference::of(&subject, spec, &mut look)
    } else {
        Err("interrupted before it was run".into())
    };
    let motor = reference.as_ref().ok().and_then(Reference::motor);
    let steiglitz = has_steiglitz.then(|| Steiglitz::of(&subject, spec, motor)).transpose()?;
    for (setting, block) in blocks.iter_mut().enumerate() {
        block.reference_cost =
            reference.as_ref().ok().and_then(|found| engine.reference_cost((&subject, spec), setting, found));
        block.steiglitz_cost = steiglitz.as_ref().and_then(|sm| sm.cost(&subject, spec, &block.setting));
    }
    let Engine { searches, parameters, initial, .. } = engine;
    let (mut warnings, device) = (searches.warnings().to_vec(), searches.device());
    if matches!(subject.machine, ComparedMachine::Motor { truth: None }) && has_reference {
        warnings.extend(warnings_of_records(&subject.records));
    }
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
