//! Comparison of search methods: all runs of all methods under each setting, with the candidates of a generation
//! evaluated as one batch.
//!
//! Runs with the same number start from the same random numbers, and so from the same population for every method that begins with a
//! uniform one. Comparisons between methods are therefore paired.

mod at_bound;
mod estimates;
mod invariance;
mod ranking;
mod settings;

pub mod paper;
mod spec;
mod steiglitz;
mod targets;

pub use estimates::MethodEstimates;
pub use invariance::{Invariance, InvarianceTest};
pub use ranking::{FEW, PairwiseTest, Ranking, Summary};
pub use settings::CompareSettings;
pub use spec::{CompareSpec, ComparisonSetting, ComparisonSubject, Preset};
pub use steiglitz::Steiglitz;
pub use targets::{Reached, reached};

use crate::analysis::warnings_of_records;
use crate::device::BatchSearchEvaluator;
use crate::evaluate::{Problem, Scalar};
use crate::identify::{Identification, IdentifySpec, Method, identify, needs_voltage};
use crate::motor::{Parameter, Parameters, Space};
use crate::optimize::{Budget, Progress, Run, SearchSettings, Stop, minimize};
use crate::setting::{Text, text};
use crate::warning::Warning;
use crate::{Error, Result};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

/// Result of one run.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Best parameters, fixed ones included; `None` if every candidate diverged.
    pub parameters: Option<Parameters>,
    /// Cost of the best parameters, evaluated by the oracle; +∞ if every candidate diverged.
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
    /// Cost of the refined estimate in this criterion; `None` without one, or if its initial states differ from those
    /// of the searches.
    pub reference_cost: Option<f64>,
    /// Cost of the Steiglitz–McBride estimate in this criterion; `None` without one.
    pub steiglitz_cost: Option<f64>,
}

/// Result of a comparison.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// The motor that methods are compared on.
    pub subject: ComparisonSubject,
    /// Settings of the comparison.
    pub spec: CompareSpec,
    /// Results, one block per setting.
    pub blocks: Vec<Block>,
    /// Results of Steiglitz–McBride; `None` if not requested or interrupted before.
    pub steiglitz: Option<Steiglitz>,
    /// Refined estimate of the recordings, or the reason why there is none.
    pub reference: std::result::Result<Box<Identification>, Text>,
    /// Initial state `[i, ω]` of each recording in the searches \[A, rad/s\].
    pub initial: Vec<[f64; 2]>,
    /// Kind (`cpu` or `gpu`), name and precision of the device that evaluated.
    pub device: (&'static str, String, &'static str),
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
    /// Returns the parameters to which errors are relative: the true ones if known, otherwise the refined estimate.
    #[must_use]
    pub fn expected(&self) -> Option<Parameters> {
        self.subject.truth.or_else(|| self.reference.as_ref().ok().map(|found| found.parameters))
    }

    /// Returns true if the searches estimate a parameter; the others are fixed.
    #[must_use]
    pub fn is_free(&self, parameter: Parameter) -> bool {
        self.spec.space.free().iter().any(|axis| axis.parameter == parameter)
    }

    /// Evaluates the refined and the Steiglitz–McBride estimate in the criterion of each block.
    fn add_costs(&mut self) -> Result<()> {
        let steiglitz = self.steiglitz.as_ref().and_then(|sm| sm.estimate.as_ref().ok());
        // Costs compare only under the same initial states, which the refinement may have estimated.
        let same = |found: &&Identification| found.initial.iter().flatten().eq(self.initial.iter().flatten());
        let refined = self.reference.as_deref().ok().filter(same).map(|found| &found.parameters);
        for block in &mut self.blocks {
            // All five parameters are free here: these estimates may differ from the values that the searches fix.
            let (records, criterion) = (&self.subject.records, block.setting.criterion);
            let problem = Problem::new(records, self.spec.model, Space::table2(), criterion)?;
            let cost = |p: &Parameters| Some(Scalar::cost(&problem, &p.to_array())).filter(|cost| cost.is_finite());
            (block.reference_cost, block.steiglitz_cost) = (refined.and_then(cost), steiglitz.and_then(cost));
        }
        Ok(())
    }
}

impl Block {
    /// Returns true if any run found a candidate that does not diverge.
    #[must_use]
    pub fn has_results(&self) -> bool {
        self.results.iter().flat_map(|result| &result.runs).any(|run| run.parameters.is_some())
    }
}

/// A run: the index of its setting, the index of its method in that setting, and its number.
struct Entry {
    indices: [usize; 2],
    run: u64,
}

/// Largest work of the estimates that an interrupted comparison still computes \[samples\].
const INTERRUPTED_MAX: usize = 4_000_000;
/// Work of the refined estimate, relative to Steiglitz–McBride on one record with new noise.
const REFERENCE: usize = 20;

/// Compares methods. `observe` receives the progress after every generation and may end the comparison; the results
/// until then are kept.
///
/// # Errors
/// Returns a `Usage` error for invalid settings, a `Data` or `NotIdentified` error for unsuitable recordings, and a
/// `Device` error if the requested device is missing or fails.
pub fn compare(
    subject: ComparisonSubject,
    spec: &CompareSpec,
    observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Comparison> {
    check(spec)?;
    needs_voltage(&subject.records)?;
    let problem = |s: &ComparisonSetting| {
        Problem::new(&subject.records, spec.model, spec.space.clone(), s.criterion).map(Arc::new)
    };
    let problems: Vec<Arc<Problem>> = spec.settings.iter().map(problem).collect::<Result<_>>()?;
    let mut batches: BTreeMap<usize, Vec<Entry>> = BTreeMap::new();
    for (s, setting) in spec.settings.iter().enumerate() {
        let runs = |m| (0..spec.runs as u64).map(move |run| Entry { indices: [s, m], run });
        batches.entry(setting.generations).or_default().extend((0..setting.methods.len()).flat_map(runs));
    }
    let agents: usize = batches.values().flatten().map(|e| spec.settings[e.indices[0]].population).sum();
    let generations = spec.settings.iter().map(|s| s.generations).max().unwrap_or(1);
    let searches = BatchSearchEvaluator::open(&spec.search(agents, generations), problems.clone())?;
    let mut comparison_run = ComparisonRun { spec, problems, searches };
    let mut blocks: Vec<Block> = spec.settings.iter().map(empty).collect();
    let (mut interrupted, mut batch_seconds, mut before) = (false, 0.0, 0);
    let mut last = Progress { generation: 0, generations: 0, evaluations: 0, cost: f64::INFINITY };
    for (generations, entries) in batches {
        let begun = Instant::now();
        let mut watch = |p: &Progress| {
            last = Progress { evaluations: before + p.evaluations, ..*p };
            observe(&last)
        };
        let (runs, stop) = comparison_run.batch(generations, &entries, &mut watch)?;
        batch_seconds += begun.elapsed().as_secs_f64();
        interrupted |= stop == Stop::Interrupted;
        before += runs.iter().map(|run| run.evaluations).sum::<u64>();
        for (entry, run) in entries.iter().zip(runs) {
            let [setting, method] = entry.indices;
            blocks[setting].results[method].runs.push(outcome(&comparison_run.problems[setting], run));
        }
        if interrupted {
            break;
        }
    }
    if !interrupted {
        interrupted = comparison_run.alone(&mut blocks, &mut || observe(&last))?.is_break();
    }
    let ComparisonRun { problems, searches, .. } = comparison_run;
    let samples: usize = subject.records.iter().map(crate::record::Record::len).sum();
    // An interrupted comparison still computes the estimates that take no more than some tenths of a second.
    let has = |more: usize| !interrupted || samples.saturating_mul(more) <= INTERRUPTED_MAX;
    let reference =
        if has(REFERENCE) { reference(&subject, spec) } else { Err("interrupted before it was run".into()) };
    let steiglitz = (spec.steiglitz_mcbride && has(spec.noise_records.saturating_add(REFERENCE)))
        .then(|| Steiglitz::of(&subject, spec, reference.as_deref().ok()));
    let mut warnings = searches.warnings().to_vec();
    if subject.truth.is_none() && has(REFERENCE) {
        warnings.extend(warnings_of_records(&subject.records));
    }
    let mut comparison = Comparison {
        subject,
        spec: spec.clone(),
        blocks,
        steiglitz: steiglitz.transpose()?,
        reference,
        initial: problems[0].signals().iter().map(|signals| signals.initial).collect(),
        device: searches.device(),
        warnings,
        invariance: Vec::new(),
        interrupted,
        evaluations: before,
        batch_seconds,
    };
    comparison.add_costs()?;
    comparison.invariance = comparison.invariance_tests();
    let of_box = at_bound::of_box(&comparison);
    comparison.warnings.extend(of_box);
    Ok(comparison)
}

/// Largest number of runs of each method.
pub(in crate::study) const RUNS_MAX: usize = 100_000;

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

/// A comparison in progress.
struct ComparisonRun<'a> {
    spec: &'a CompareSpec,
    /// Problems by setting.
    problems: Vec<Arc<Problem>>,
    searches: BatchSearchEvaluator,
}

impl ComparisonRun<'_> {
    /// Executes runs with the same number of generations in lockstep.
    fn batch(
        &mut self,
        generations: usize,
        entries: &[Entry],
        observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<(Vec<Run>, Stop)> {
        let run = |entry: &Entry| {
            let [s, m] = entry.indices;
            let setting = &self.spec.settings[s];
            let (bounds, population, coordinates) =
                (self.problems[s].space().bounds(), setting.population, setting.coordinates);
            let (seed, run) = (self.spec.seed, entry.run);
            let setup = SearchSettings { bounds, population, generations, seed, run, coordinates };
            Ok(Run::new(setting.methods[m].optimizer(setup)?))
        };
        let mut runs: Vec<Run> = entries.iter().map(run).collect::<Result<_>>()?;
        self.searches.set_problems(entries.iter().map(|entry| self.problems[entry.indices[0]].clone()).collect());
        let budget = Budget { generations, slice: self.searches.slice() };
        let stop = minimize(&mut runs, budget, &mut self.searches, observe)?;
        Ok((runs, stop))
    }

    /// Measures the time of a single run of each method \[s\]: the median of three.
    fn alone(&mut self, blocks: &mut [Block], observe: &mut dyn FnMut() -> ControlFlow<()>) -> Result<ControlFlow<()>> {
        for (s, block) in blocks.iter_mut().enumerate() {
            for (m, result) in block.results.iter_mut().enumerate() {
                let mut seconds = Vec::new();
                for run in 0..3 {
                    let entry = [Entry { indices: [s, m], run }];
                    let begun = Instant::now();
                    let (_, stop) = self.batch(block.setting.generations, &entry, &mut |_| observe())?;
                    if stop == Stop::Interrupted {
                        return Ok(ControlFlow::Break(()));
                    }
                    seconds.push(begun.elapsed().as_secs_f64());
                }
                seconds.sort_by(f64::total_cmp);
                result.seconds = seconds.get(1).copied();
            }
        }
        Ok(ControlFlow::Continue(()))
    }
}

fn outcome(problem: &Problem, run: Run) -> Outcome {
    let best =
        run.optimizer.best().map(|best| (problem.parameters(best.values, 0), Scalar::cost(problem, best.values)));
    let best = best.filter(|(_, cost)| cost.is_finite());
    let (parameters, cost) = best.map_or((None, f64::INFINITY), |(p, cost)| (Some(p), cost));
    Outcome { parameters, cost, history: run.history, evaluations: run.evaluations }
}

/// Returns the refined estimate: Steiglitz–McBride and Levenberg–Marquardt with noise weights. Without noise its
/// cost is the lowest that a search can reach.
fn reference(subject: &ComparisonSubject, spec: &CompareSpec) -> std::result::Result<Box<Identification>, Text> {
    let auto = IdentifySpec {
        model: spec.model,
        space: spec.space.clone(),
        auto_bounds: Vec::new(),
        device: crate::device::DeviceSpec::Cpu,
        ..IdentifySpec::default()
    };
    identify(&subject.records, &auto).map(Box::new).map_err(|error| error.text())
}
