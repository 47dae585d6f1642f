//! Runs of searches on the problems of a suite.

use super::definition::{Suite, SuiteProblem};
use super::entrant::{Entrant, POPULATION};
use crate::compare::RUNS_MAX;
use motorfit_core::clock::Instant;
use motorfit_core::numeric::index;
use motorfit_core::setting::{Setting, text};
use motorfit_core::{Error, Result};
use motorfit_identify::IdentifySpec;
use motorfit_identify::device::{
    BatchSearchEvaluator, DeviceSpec, DeviceUsed, EvaluatorSpec, PrecisionSpec, ThroughputProfile,
};
use motorfit_optimize::{Budget, Coordinates, Progress, Run, SearchSettings, Stop, minimize};
use motorfit_record::warning::Warning;
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// Largest budget of a run \[evaluations\].
pub(crate) const BUDGET_MAX: u64 = 1_000_000_000;

/// Settings of a suite.
#[derive(Debug, Clone)]
pub struct SuiteSpec {
    /// The suite.
    pub suite: Suite,
    /// Searches that take part.
    pub entrants: Vec<Entrant>,
    /// Budgets of a run \[evaluations\].
    pub budgets: Vec<u64>,
    /// Number of runs of each search on each problem.
    pub runs: usize,
    /// Seed of the random numbers; those of a run depend on the seed and the number of the run.
    pub seed: u64,
    /// Device that evaluates.
    pub device: DeviceSpec,
    /// Floating-point precision of the evaluation.
    pub precision: PrecisionSpec,
    /// Evaluator of costs on the CPU.
    pub evaluator: EvaluatorSpec,
    /// Throughput measured on this machine, by which `auto` chooses the device.
    pub throughput_profile: Option<ThroughputProfile>,
}

impl Default for SuiteSpec {
    /// Returns the suite `motors` with budgets of 100 to 100,000 evaluations and 15 runs, without searches.
    fn default() -> Self {
        Self {
            suite: Suite::default(),
            entrants: Vec::new(),
            budgets: vec![100, 1000, 10_000, 100_000],
            runs: 15,
            seed: 1,
            device: DeviceSpec::default(),
            precision: PrecisionSpec::default(),
            evaluator: EvaluatorSpec::default(),
            throughput_profile: None,
        }
    }
}

impl SuiteSpec {
    fn check(&self) -> Result<()> {
        if self.entrants.is_empty() || self.budgets.is_empty() || self.runs == 0 {
            return Err(Error::usage("there is nothing to compare", "Give at least one method, budget and run."));
        }
        if self.runs > RUNS_MAX {
            return Err(Error::usage(text!([Runs](" is {}", self.runs)), format!("Give at most {RUNS_MAX}.")));
        }
        if let Some(budget) = self.budgets.iter().find(|budget| !(1..=BUDGET_MAX).contains(*budget)) {
            let message = format!("a budget of {budget} evaluations is out of range");
            return Err(Error::usage(message, format!("Give 1 to {BUDGET_MAX}.")));
        }
        let repeated = |n: usize| self.budgets[..n].contains(&self.budgets[n]);
        if (1..self.budgets.len()).any(repeated) {
            return Err(Error::usage(text!([Budgets] " has a value twice"), "Give each once."));
        }
        if self.entrants.iter().any(|entrant| entrant.population == Some(0)) {
            return Err(Error::usage(text!([Population] " is 0"), text!("Give " {Setting::Population} " at least 1.")));
        }
        Ok(())
    }
}

/// A run of a search on a problem of a suite.
#[derive(Debug, Clone, PartialEq)]
pub struct SuiteRun {
    /// Lowest cost after each generation that lowered it, with the evaluations until then.
    pub improvements: Vec<(u64, f64)>,
    /// Number of evaluations.
    pub evaluations: u64,
}

impl SuiteRun {
    /// Returns the final cost; +∞ if every candidate diverged.
    #[must_use]
    pub fn cost(&self) -> f64 {
        self.improvements.last().map_or(f64::INFINITY, |(_, cost)| *cost)
    }

    /// Returns the evaluations until the cost is at most `cost`; `None` if it never is.
    #[must_use]
    pub fn evaluations_to(&self, cost: f64) -> Option<u64> {
        let first = self.improvements.partition_point(|(_, best)| *best > cost);
        self.improvements.get(first).map(|(evaluations, _)| *evaluations)
    }

    fn of(run: &Run, population: usize) -> Self {
        let mut improvements: Vec<(u64, f64)> = Vec::new();
        for (generation, &cost) in (1..).zip(&run.history) {
            if cost < improvements.last().map_or(f64::INFINITY, |(_, best)| *best) {
                improvements.push((run.evaluations.min(generation * population as u64), cost));
            }
        }
        Self { improvements, evaluations: run.evaluations }
    }
}

/// Runs of all searches on one problem at one budget.
#[derive(Debug, Clone, PartialEq)]
pub struct SuiteBlock {
    /// Index of the budget.
    pub budget: usize,
    /// Index of the problem.
    pub problem: usize,
    /// Runs of each entrant, in the order of the settings.
    pub runs: Vec<Vec<SuiteRun>>,
}

impl SuiteBlock {
    /// Returns the runs of an entrant.
    pub(super) fn of(&self, entrant: usize) -> &[SuiteRun] {
        self.runs.get(entrant).map_or(&[], Vec::as_slice)
    }
}

/// Result of a suite.
#[derive(Debug, Clone)]
pub struct SuiteResult {
    /// Settings.
    pub spec: SuiteSpec,
    /// Version of the suite.
    pub version: u32,
    /// Problems.
    pub problems: Vec<SuiteProblem>,
    /// Results, budget by budget and problem by problem; incomplete ones are left out.
    pub blocks: Vec<SuiteBlock>,
    /// Device that evaluated.
    pub device: DeviceUsed,
    /// Warnings about the device and the suite.
    pub warnings: Vec<Warning>,
    /// True if the observer ended the suite early.
    pub interrupted: bool,
    /// Number of evaluations.
    pub evaluations: u64,
    /// Time of all runs \[s\].
    pub seconds: f64,
}

/// Runs a suite. `observe` receives the progress, in problems, after every generation and may end the suite; the problems completed
/// until then are kept.
///
/// # Errors
/// Returns a `Usage` error for invalid settings, and a `Device` error if the requested device is missing or fails.
pub fn run_suite(spec: &SuiteSpec, observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>) -> Result<SuiteResult> {
    spec.check()?;
    let problems = spec.suite.problems()?;
    let agents = spec.entrants.len() * spec.runs * index(POPULATION);
    let device = IdentifySpec {
        population: agents,
        device: spec.device.clone(),
        precision: spec.precision,
        evaluator: spec.evaluator,
        throughput_profile: spec.throughput_profile.clone(),
        ..IdentifySpec::default()
    };
    let mut searches = BatchSearchEvaluator::open(&device, problems.iter().map(|p| p.problem.clone()).collect())?;
    let begun = Instant::now();
    let (mut blocks, mut evaluations, mut interrupted) = (Vec::new(), 0, false);
    let of = spec.budgets.len() * problems.len();
    let order = (0..spec.budgets.len()).flat_map(|budget| (0..problems.len()).map(move |problem| (budget, problem)));
    for (done, (budget, problem)) in order.enumerate() {
        let mut watch = |progress: &Progress| {
            observe(&Progress {
                generation: done,
                generations: of,
                evaluations: evaluations + progress.evaluations,
                cost: problems[problem].gap(progress.cost),
            })
        };
        let ran = block(spec, &mut searches, (budget, problem, &problems[problem]), &mut watch)?;
        let Some(block) = ran else {
            interrupted = true;
            break;
        };
        evaluations += block.runs.iter().flatten().map(|run| run.evaluations).sum::<u64>();
        blocks.push(block);
    }
    let warnings = searches.take_warnings();
    let (version, device, seconds) = (spec.suite.version()?, searches.device(), begun.elapsed().as_secs_f64());
    let spec = spec.clone();
    let mut result =
        SuiteResult { spec, version, problems, blocks, device, warnings, interrupted, evaluations, seconds };
    result.check_optima();
    Ok(result)
}

/// Runs all searches on one problem; `None` if it was interrupted.
fn block(
    spec: &SuiteSpec,
    searches: &mut BatchSearchEvaluator,
    (budget, number, problem): (usize, usize, &SuiteProblem),
    observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Option<SuiteBlock>> {
    let mut runs: Vec<Vec<SuiteRun>> = vec![Vec::new(); spec.entrants.len()];
    let mut batches: BTreeMap<usize, Vec<(usize, usize)>> = BTreeMap::new();
    for (n, entrant) in spec.entrants.iter().enumerate() {
        let [population, generations] = entrant.shape(spec.budgets[budget]);
        batches.entry(generations).or_default().push((n, population));
    }
    let mut before = 0;
    for (generations, entrants) in batches {
        let begin = |(n, population, run): (usize, usize, u64)| {
            let Entrant { method, coordinates, .. } = &spec.entrants[n];
            let (bounds, coordinates) = (problem.problem.space().bounds(), *coordinates);
            let settings = SearchSettings { bounds, population, generations, seed: spec.seed, run, coordinates };
            Ok(Run::new(method.optimizer(settings)?))
        };
        let numbered = |&(n, population): &(usize, usize)| (0..spec.runs as u64).map(move |run| (n, population, run));
        let entries: Vec<(usize, usize, u64)> = entrants.iter().flat_map(numbered).collect();
        let mut states: Vec<Run> = entries.iter().copied().map(begin).collect::<Result<_>>()?;
        searches.set_problems(vec![problem.problem.clone()]);
        let limits = Budget { generations, slice: searches.slice() };
        let mut watch = |p: &Progress| observe(&Progress { evaluations: before + p.evaluations, ..*p });
        if minimize(&mut states, limits, searches, &mut watch)? == Stop::Interrupted {
            return Ok(None);
        }
        for ((n, population, _), state) in entries.into_iter().zip(&states) {
            before += state.evaluations;
            runs[n].push(SuiteRun::of(state, population));
        }
    }
    Ok(Some(SuiteBlock { budget, problem: number, runs }))
}

impl SuiteResult {
    /// Warns of problems on which a run found a lower cost than that of the known optimum.
    fn check_optima(&mut self) {
        let lowest = |number: usize| {
            let runs = self
                .blocks
                .iter()
                .filter(|block| block.problem == number)
                .flat_map(|block| block.runs.iter().flatten());
            runs.map(SuiteRun::cost).fold(f64::INFINITY, f64::min)
        };
        let is_lower = |(n, problem): (usize, &SuiteProblem)| {
            (problem.gap(lowest(n)) < -super::gap::GAP_MIN).then(|| problem.name.clone())
        };
        let lower: Vec<String> = self.problems.iter().enumerate().filter_map(is_lower).collect();
        if !lower.is_empty() {
            let message =
                format!("the known optimum of {} is not the lowest: a run found a lower cost", lower.join(", "));
            self.warnings.push(Warning::new("optimum_not_lowest", message));
        }
    }

    /// Returns the name of an entrant: its method, with its coordinates and its population where they are not the usual ones.
    #[must_use]
    pub fn name(&self, entrant: usize) -> String {
        let Some(Entrant { method, coordinates, population }) = self.spec.entrants.get(entrant) else {
            return String::new();
        };
        let changed = method.search().map(|search| search.changed()).unwrap_or_default();
        let own: String = changed.iter().map(|(key, value)| format!(" {key}:{value}")).collect();
        let of = population.map_or(String::new(), |population| format!(" {population} agents"));
        let moved = if *coordinates == Coordinates::None { String::new() } else { format!(" {coordinates}") };
        format!("{}{own}{moved}{of}", method.name())
    }

    /// Returns the index of the largest budget with a complete problem.
    #[must_use]
    pub fn last_budget(&self) -> Option<usize> {
        let budget = |block: &SuiteBlock| Some((*self.spec.budgets.get(block.budget)?, block.budget));
        self.blocks.iter().filter_map(budget).max().map(|(_, index)| index)
    }

    /// Returns the blocks of a budget with their problems.
    pub(super) fn of_budget(&self, budget: usize) -> impl Iterator<Item = (&SuiteProblem, &SuiteBlock)> {
        let blocks = self.blocks.iter().filter(move |block| block.budget == budget);
        blocks.filter_map(|block| Some((self.problems.get(block.problem)?, block)))
    }
}
