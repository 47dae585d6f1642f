//! The summary of a sweep: quantiles by factor, the worst runs, the motors with their parameters.

use super::Sweep;
use super::line::Outcome;
use super::run::Failures;
use super::runs::Job;
use super::study::Factors;
use super::trust::TrustCounts;
use crate::identify::ParameterEstimate;
use crate::motor::{Parameter, Scope};
use crate::numeric::{quantile, sorted};
use crate::setting::text;
use crate::text::excerpt;
use crate::{Error, Result};
use std::collections::BTreeMap;

/// Runs whose values are kept for quantiles; of more, every Nth.
const SAMPLE: u64 = 1 << 20;
/// Worst runs of a block that are named.
const NAMED: usize = 10;

/// Quantiles of some values.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Quantiles {
    /// The smallest.
    pub min: f64,
    /// Below it is a twentieth.
    pub q05: f64,
    /// Below it is a quarter.
    pub q25: f64,
    /// Below it is half.
    pub median: f64,
    /// Above it is a quarter.
    pub q75: f64,
    /// Above it is a twentieth.
    pub q95: f64,
    /// The largest.
    pub max: f64,
}

impl Quantiles {
    /// Of values, NaN of none.
    #[must_use]
    pub fn of(values: &[f64]) -> Self {
        let sorted = sorted(values);
        let [min, q05, q25, median, q75, q95, max] =
            [0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0].map(|p| quantile(&sorted, p));
        Self { min, q05, q25, median, q75, q95, max }
    }
}

/// Runs under the same levels of all factors but motor and seed.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// The levels; the seed is that of the first run.
    pub factors: Factors,
    /// The name of the noise.
    pub noise: String,
    /// The name of the extensions, where the study names them.
    pub with: Option<String>,
    /// Finished runs.
    pub runs: u64,
    /// Of these, runs without a result.
    pub failed: u64,
    /// The others by their level of trust.
    pub trust: TrustCounts,
    /// Costs, in the order of the runs.
    pub costs: Vec<f64>,
    /// Values of each parameter that runs identified, in the order of the runs: those of R, L, K, B, J, then others.
    pub parameters: Vec<(Named, Vec<f64>)>,
    /// Seconds of the runs, added up.
    pub seconds: f64,
}

/// A parameter, of all recordings or of one.
pub type Named = (Parameter, Scope);

/// Those that every result has.
pub const MOTOR: [Named; 5] = {
    let [r, l, k, b, j] = Parameter::ALL;
    [(r, Scope::Shared), (l, Scope::Shared), (k, Scope::Shared), (b, Scope::Shared), (j, Scope::Shared)]
};

impl Cell {
    /// Values of a parameter; none where no run has it.
    #[must_use]
    pub fn values(&self, parameter: Named) -> &[f64] {
        self.parameters.iter().find(|(of, _)| *of == parameter).map_or(&[], |(_, values)| values)
    }
}

/// A run with its outcome.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedRun {
    /// The run.
    pub job: Job,
    /// Its motor.
    pub motor: String,
    /// Its result.
    pub outcome: Outcome,
}

/// Cells that share criterion and scale, so that their costs compare.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepBlock {
    /// The cells, in the order of the study.
    pub cells: Vec<Cell>,
    /// The runs with the highest costs, the highest first.
    pub worst: Vec<NamedRun>,
}

/// The summary of a sweep.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SweepSummary {
    /// The study's name.
    pub name: String,
    /// Runs of the study.
    pub runs: u64,
    /// Runs that are not finished.
    pub missing: u64,
    /// Runs without a result.
    pub failed: u64,
    /// Their reasons.
    pub failures: Failures,
    /// Runs with a result by their level of trust.
    pub trust: TrustCounts,
    /// Runs that the CPU did in place of the device.
    pub taken_over: u64,
    /// Every Nth run of a cell is in the quantiles.
    pub stride: u64,
    /// One for each criterion and scale.
    pub blocks: Vec<SweepBlock>,
    /// The number of motors of the study.
    pub motors: usize,
    /// The best run of each motor that has a result, one with standard errors before one without, in the order of the study.
    pub results: Vec<NamedRun>,
    /// The parameters that results have: R, L, K, B, J, then those of extensions and of recordings.
    pub parameters: Vec<Named>,
    /// True if the study names extensions.
    pub names_with: bool,
    /// True if recordings were held out.
    pub holds_out: bool,
    /// Names of the factors with more than one level.
    pub varied: Vec<&'static str>,
    /// cpu or gpu, and its numbers.
    pub device: [String; 2],
    /// Block and cell of each combination of levels.
    pub(crate) places: BTreeMap<u64, (usize, usize)>,
}

impl SweepSummary {
    /// Of a sweep of which nothing was taken in yet.
    #[must_use]
    pub fn new(sweep: &Sweep) -> Self {
        let study = sweep.study();
        // Costs under other criteria and scales are blocks of their own.
        let is_varied = |(name, levels): &(&str, usize)| *levels > 1 && !["criterion", "scale"].contains(name);
        let device = &sweep.manifest.device;
        Self {
            name: sweep.manifest.name.clone(),
            runs: sweep.manifest.runs,
            stride: sweep.manifest.runs.div_ceil(SAMPLE).max(1),
            motors: sweep.manifest.motors.len(),
            parameters: MOTOR.to_vec(),
            names_with: study.names_with,
            holds_out: study.split.is_some() || sweep.manifest.motors.iter().any(|motor| !motor.validate.is_empty()),
            varied: study.levels().into_iter().filter(is_varied).map(|(name, _)| name).collect(),
            device: [device.kind.clone(), device.precision.clone()],
            ..Self::default()
        }
    }

    /// Takes a run in; runs come in the order of their numbers.
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
            for e in &estimates.list {
                let named = (e.parameter, e.scope);
                match taken.parameters.iter_mut().find(|(of, _)| *of == named) {
                    Some((_, values)) => values.extend(e.value),
                    None => taken.parameters.push((named, e.value.into_iter().collect())),
                }
            }
        }
        for e in &estimates.list {
            let place =
                self.parameters.partition_point(|(p, s)| ParameterEstimate::new(*p, *s, None).order() < e.order());
            if self.parameters.get(place) != Some(&(e.parameter, e.scope)) {
                self.parameters.insert(place, (e.parameter, e.scope));
            }
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

    /// Keeps the run as its motor's if it is better than the one kept: of the study's first criterion, scale and noise.
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

    /// Where the runs under some levels stand; made where they are the first.
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
        let cells = &mut self.blocks[block].cells;
        cells.push(Cell {
            factors: *factors,
            noise: sweep.study().noise[factors.noise].name.clone(),
            with: sweep.study().with_name(factors).map(str::to_owned),
            runs: 0,
            failed: 0,
            trust: TrustCounts::default(),
            costs: Vec::new(),
            parameters: MOTOR.map(|named| (named, Vec::new())).to_vec(),
            seconds: 0.0,
        });
        let place = (block, cells.len() - 1);
        self.places.insert(combination, place);
        place
    }

    /// Returns whether every run has a result.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.missing == 0 && self.failed == 0
    }
}

impl NamedRun {
    /// The estimate of a parameter; `None` where the run has none.
    #[must_use]
    pub fn estimate(&self, (parameter, scope): Named) -> Option<&ParameterEstimate> {
        self.outcome.estimates.as_ref()?.list.iter().find(|e| e.parameter == parameter && e.scope == scope)
    }
}

/// Limits that parameters of a motor must keep.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Limits(Vec<(Parameter, f64, f64)>);

impl Limits {
    /// From pairs of bounds.
    ///
    /// # Errors
    /// `Usage` where a lower limit is not below the upper one, or either is no number.
    pub fn new(list: Vec<(Parameter, f64, f64)>) -> Result<Self> {
        match list.iter().find(|(_, low, high)| low.is_nan() || high.is_nan() || low >= high) {
            Some((parameter, low, high)) => {
                let message = text!([Limits](": {}={low}:{high} holds nothing", excerpt(parameter.symbol())));
                Err(Error::usage(message, text!("Write " [Limits = "R=0.8:1.0"] ", the lower limit first.")))
            }
            None => Ok(Self(list)),
        }
    }

    /// The limits of a parameter.
    #[must_use]
    pub fn of(&self, parameter: Parameter) -> Option<[f64; 2]> {
        self.0.iter().find(|(of, _, _)| *of == parameter).map(|(_, low, high)| [*low, *high])
    }

    /// Returns whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}
