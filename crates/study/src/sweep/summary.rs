//! Summary of a sweep: quantiles by factor, the worst runs, and the motors with their parameters.

use super::estimates::RunEstimate;
use super::line::Outcome;
use super::machine::Level;
use super::parameter::SweepParameter;
use super::planned::Sweep;
use super::run::Failures;
use super::runs::Job;
use super::study::{Factors, Study};
use super::trust::TrustCounts;
use motorfit_core::numeric::{quantile, sorted};
use std::collections::BTreeMap;

/// Largest number of runs whose values are kept for quantiles; of more, every Nth is kept.
const SAMPLE: u64 = 1 << 20;
/// Number of worst runs listed per block.
const NAMED: usize = 10;

/// Quantiles of a set of values.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Quantiles {
    /// Smallest value.
    pub min: f64,
    /// 5 % quantile.
    pub q05: f64,
    /// 25 % quantile.
    pub q25: f64,
    /// Median.
    pub median: f64,
    /// 75 % quantile.
    pub q75: f64,
    /// 95 % quantile.
    pub q95: f64,
    /// Largest value.
    pub max: f64,
}

impl Quantiles {
    /// Computes the quantiles of values; NaN without values.
    #[must_use]
    pub fn of(values: &[f64]) -> Self {
        let sorted = sorted(values);
        let [min, q05, q25, median, q75, q95, max] =
            [0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0].map(|p| quantile(&sorted, p));
        Self { min, q05, q25, median, q75, q95, max }
    }
}

/// Runs with the same levels of all factors except motor and seed.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Levels of the factors; the seed is that of the first run.
    pub factors: Factors,
    /// Name of the noise level.
    pub noise: String,
    /// Extensions of the DC motor; `None` if the study names none.
    pub with: Option<String>,
    /// Name of the model; `None` if the study names no models.
    pub model: Option<String>,
    /// Number of finished runs.
    pub runs: u64,
    /// Number of finished runs without a result.
    pub failed: u64,
    /// Number of results by level of trust.
    pub trust: TrustCounts,
    /// Costs of the results, in the order of the runs, of every Nth run (see [`SweepSummary::stride`]).
    pub costs: Vec<f64>,
    /// Estimates of each parameter by name, of the same runs.
    pub parameters: Vec<(String, Vec<f64>)>,
    /// Total time of the runs \[s\].
    pub seconds: f64,
}

impl Cell {
    /// Returns the estimates of a parameter; none if no run has it.
    #[must_use]
    pub fn values(&self, parameter: &str) -> &[f64] {
        self.parameters.iter().find(|(of, _)| of == parameter).map_or(&[], |(_, values)| values)
    }
}

/// A run with its motor and outcome.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedRun {
    /// The run.
    pub job: Job,
    /// Name of the motor.
    pub motor: String,
    /// Outcome of the run.
    pub outcome: Outcome,
}

/// Cells with the same criterion and scale, whose costs are comparable.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepBlock {
    /// Cells in the order of the study.
    pub cells: Vec<Cell>,
    /// Runs with the highest costs, the highest first.
    pub worst: Vec<NamedRun>,
}

/// Summary of a sweep.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SweepSummary {
    /// Name of the study.
    pub name: String,
    /// Number of runs of the study.
    pub runs: u64,
    /// Number of unfinished runs.
    pub missing: u64,
    /// Number of finished runs without a result.
    pub failed: u64,
    /// Reasons why runs have no result.
    pub failures: Failures,
    /// Number of results by level of trust.
    pub trust: TrustCounts,
    /// Number of searches that the CPU ran in place of the planned device.
    pub taken_over: u64,
    /// Stride N of the quantiles: every Nth run of a cell is kept.
    pub stride: u64,
    /// Cells by criterion and scale.
    pub blocks: Vec<SweepBlock>,
    /// Number of motors of the study.
    pub motors: usize,
    /// Best run of each motor with a result, in the order of the study, among the runs with the first criterion, scale and
    /// noise. Runs with standard errors are preferred.
    pub results: Vec<NamedRun>,
    /// Parameters of the results: those that every result of a machine has, and those of extensions and of single recordings.
    pub parameters: Vec<SweepParameter>,
    /// Names of the outputs.
    pub outputs: Vec<String>,
    /// True if the study names extensions of the DC motor.
    pub names_with: bool,
    /// True if the study names models.
    pub names_models: bool,
    /// True if the study has held-out recordings.
    pub holds_out: bool,
    /// Names of the factors with more than one level, except criterion and scale.
    pub varied: Vec<&'static str>,
    /// Kind (`cpu` or `gpu`) and precision of the planned device.
    pub device: [String; 2],
    /// Indices of the block and the cell of each combination of levels.
    pub(crate) places: BTreeMap<u64, (usize, usize)>,
}

impl SweepSummary {
    /// Creates the summary of a sweep without any runs.
    #[must_use]
    pub fn new(sweep: &Sweep) -> Self {
        let study = sweep.study();
        // Each criterion and scale has a block of its own, because its costs are not comparable with others.
        let is_varied = |(name, levels): &(&str, usize)| *levels > 1 && !["criterion", "scale"].contains(name);
        let device = &sweep.manifest.device;
        Self {
            name: sweep.manifest.name.clone(),
            runs: sweep.manifest.runs,
            stride: sweep.manifest.runs.div_ceil(SAMPLE).max(1),
            motors: sweep.manifest.motors.len(),
            parameters: distinct(study.machines.iter().flat_map(Level::parameters)),
            outputs: outputs(study),
            names_with: study.names_with,
            names_models: !study.models.is_empty(),
            holds_out: study.split.is_some() || sweep.manifest.motors.iter().any(|motor| !motor.validate.is_empty()),
            varied: study.levels().into_iter().filter(is_varied).map(|(name, _)| name).collect(),
            device: [device.kind.clone(), device.precision.clone()],
            ..Self::default()
        }
    }

    /// Adds a run. Runs must be added in the order of their numbers.
    pub(super) fn add(&mut self, sweep: &Sweep, job: &Job, outcome: Outcome, seconds: f64) {
        let motor = &sweep.manifest.motors[job.motor].motor;
        let by_another = outcome.device != sweep.pinned()[0] && outcome.device == "cpu";
        self.taken_over += u64::from(job.factors.method.is_search() && by_another);
        let (block, cell) = self.place(sweep, job);
        let taken = &mut self.blocks[block].cells[cell];
        taken.runs += 1;
        taken.seconds += seconds;
        let (Some(estimates), Some(cost)) = (&outcome.estimates, outcome.cost) else {
            taken.failed += 1;
            self.failed += 1;
            let message = outcome.error.as_ref().map_or("no finite cost", |error| &error.message);
            self.failures.add(job.id, motor, message);
            return;
        };
        taken.trust.add(outcome.trust.as_ref());
        self.trust.add(outcome.trust.as_ref());
        if taken.runs.is_multiple_of(self.stride) || self.stride == 1 {
            taken.costs.push(cost);
            for e in estimates.all() {
                match taken.parameters.iter_mut().find(|(of, _)| *of == e.name) {
                    Some((_, values)) => values.extend(e.value),
                    None => taken.parameters.push((e.name.clone(), e.value.into_iter().collect())),
                }
            }
        }
        for e in estimates.all() {
            if self.parameters.iter().any(|known| known.name == e.name) {
                continue;
            }
            let Some(parameter) = sweep.study().machine(&job.factors).parameter(&e.name) else { continue };
            let place = self.parameters.partition_point(|known| known.order < parameter.order);
            self.parameters.insert(place, parameter);
        }
        let named = || NamedRun { job: *job, motor: motor.clone(), outcome: outcome.clone() };
        let worst = &mut self.blocks[block].worst;
        let at = worst.partition_point(|other| other.outcome.cost >= Some(cost));
        if at < NAMED {
            worst.insert(at, named());
            worst.truncate(NAMED);
        }
        self.take_motor(job, &outcome, named);
    }

    /// Makes the run the best of its motor if it is better than the previous one. Only runs with the first criterion,
    /// scale and noise of the study compete.
    fn take_motor(&mut self, job: &Job, outcome: &Outcome, named: impl Fn() -> NamedRun) {
        let is_sure = |outcome: &Outcome| outcome.estimates.as_ref().is_some_and(|estimates| estimates.polished);
        let rank = |outcome: &Outcome| (!is_sure(outcome), outcome.cost.unwrap_or(f64::INFINITY));
        let (f, first) = (&job.factors, &self.blocks[0].cells[0].factors);
        if (f.criterion, f.scale, f.noise) != (first.criterion, first.scale, 0) {
            return;
        }
        match self.results.last_mut().filter(|last| last.job.motor == job.motor) {
            None => self.results.push(named()),
            Some(last) if rank(outcome) < rank(&last.outcome) => *last = named(),
            Some(_) => {}
        }
    }

    /// Returns the indices of the block and the cell of a run, which are created for the first run of a cell.
    fn place(&mut self, sweep: &Sweep, job: &Job) -> (usize, usize) {
        let combination = job.id % sweep.runs.per_motor() / sweep.study().seeds.count();
        if let Some(place) = self.places.get(&combination) {
            return *place;
        }
        let factors = &job.factors;
        let comparable = |f: &Factors| (f.criterion, f.scale) == (factors.criterion, factors.scale);
        let known = self.blocks.iter().position(|block| comparable(&block.cells[0].factors));
        let block = known.unwrap_or(self.blocks.len());
        if known.is_none() {
            self.blocks.push(SweepBlock { cells: Vec::new(), worst: Vec::new() });
        }
        let machine = sweep.study().machine(factors);
        let cells = &mut self.blocks[block].cells;
        cells.push(Cell {
            factors: *factors,
            noise: sweep.study().noise[factors.noise].name.clone(),
            with: sweep.study().with_name(factors).map(str::to_owned),
            model: sweep.study().model_name(factors).map(str::to_owned),
            runs: 0,
            failed: 0,
            trust: TrustCounts::default(),
            costs: Vec::new(),
            parameters: machine.parameters().into_iter().map(|of| (of.name, Vec::new())).collect(),
            seconds: 0.0,
        });
        let place = (block, cells.len() - 1);
        self.places.insert(combination, place);
        place
    }

    /// Returns true if every run has a result.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.missing == 0 && self.failed == 0
    }
}

impl NamedRun {
    /// Returns the estimate of a parameter by its name; `None` if the run has none.
    #[must_use]
    pub fn estimate(&self, parameter: &str) -> Option<&RunEstimate> {
        self.outcome.estimates.as_ref()?.all().find(|e| e.name == parameter)
    }
}

/// Returns the parameters of several machines, each name once, in their order.
fn distinct(all: impl Iterator<Item = SweepParameter>) -> Vec<SweepParameter> {
    let mut found: Vec<SweepParameter> = Vec::new();
    for parameter in all {
        if !found.iter().any(|known| known.name == parameter.name) {
            found.push(parameter);
        }
    }
    found
}

/// Returns the names of the outputs of all machines of a study.
fn outputs(study: &Study) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for name in study.machines.iter().flat_map(Level::outputs) {
        if !found.contains(&name) {
            found.push(name);
        }
    }
    found
}
