//! Population searches: many runs in lockstep, the candidates of a generation as one batch, in pieces of bounded size.

use super::dataset::{Dataset, Kept, Read, Recordings, Sets};
use super::line::Outcome;
use super::machine::OF_MOTOR;
use super::planned::Sweep;
use super::run::{End, Finished, Running, Step};
use super::runs::Job;
use super::study::{Factors, Study};
use super::units::{RUNS, Unit, Units};
use motorfit_core::clock::Instant;
use motorfit_core::{Error, ErrorKind, Result, numeric};
use motorfit_evaluate::{Problem, Scalar};
use motorfit_identify::device::{BatchSearchEvaluator, DeviceSpec, DeviceUsed, OnLoss, PrecisionSpec};
use motorfit_identify::{IdentifySpec, PreparedSearch, SearchRun, has_all_channels};
use motorfit_motor::{Parameter, With};
use motorfit_optimize::{Budget, Run, SearchSettings, Stop, minimize};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::sync::Arc;

/// Target number of candidate-steps of a piece on the CPU, some tenths of a second; a killed process loses the current piece.
const STEPS: u64 = 1_000_000_000;
/// Fewest candidates of a generation per thread, regardless of [`STEPS`], so that threads are seldom idle.
pub(super) const CANDIDATES: usize = 3072;
/// Fewest candidates of a generation on a GPU, which needs more to be fully used.
const CANDIDATES_GPU: usize = 1 << 17;
/// Samples of all problems of a piece, which bounds memory.
const SAMPLES: u64 = 2_000_000;
/// Parameter values of all populations of a piece, which bounds memory.
const VALUES: usize = 1 << 23;
/// Work to prepare and polish a search with extensions, relative to one of the linear motor.
const EXTENDED: usize = 32;

/// Runs that share a search and differ only in their polish.
type Search = Vec<Job>;

/// A search that is prepared.
struct Ready {
    jobs: Search,
    recordings: Recordings,
    prepared: Arc<PreparedSearch>,
}

/// Key of a prepared search: indices and names of its dataset, criterion and scale, model, and polish if the model
/// depends on it.
type Key = (usize, [&'static str; 2], usize, Option<&'static str>);

/// Returns true if a run is a population search that shares its batches with others: models search one run at a time.
pub(super) fn is_lockstep(study: &Study, job: &Job) -> bool {
    job.factors.method.is_search() && study.machine(&job.factors).model.is_none()
}

impl Running<'_> {
    /// Runs the population searches, those with the same number of generations together.
    pub(super) fn search(&mut self) -> Step {
        let mut device: Option<BatchSearchEvaluator> = None;
        let mut generations = self.sweep.study().generations.clone();
        generations.sort_unstable();
        for generations in generations {
            let mut units = Units::new(self, RUNS, |job| {
                is_lockstep(self.sweep.study(), job) && job.factors.generations == generations
            });
            let mut rest: Option<(Dataset, Vec<Search>)> = None;
            let mut kept: Kept = None;
            loop {
                let (datasets, searches) = self.piece(&mut units, &mut rest, generations);
                if searches.is_empty() {
                    break;
                }
                let (ready, finished) = self.sweep.ready(&datasets, searches, &mut kept);
                self.together(generations, ready, finished, &mut device)?;
            }
        }
        Ok(())
    }

    /// Returns the datasets of the next piece, and its searches each with the index of its dataset. Searches for which
    /// there is no room become the `rest`.
    fn piece(
        &self,
        units: &mut Units,
        rest: &mut Option<(Dataset, Vec<Search>)>,
        generations: usize,
    ) -> (Vec<Dataset>, Vec<(usize, Search)>) {
        let (mut datasets, mut searches) = (Vec::new(), Vec::new());
        let (mut agents, mut room, mut samples, mut work) = (0, 0, 0, 0);
        while searches.is_empty() || (agents < room && samples < SAMPLES && work < RUNS && rest.is_none()) {
            let next = || units.next(self).map(|unit| (unit.dataset, self.searches(&unit)));
            let Some((dataset, own)) = rest.take().or_else(next) else { break };
            if searches.is_empty() {
                room = self.room(generations, dataset.motor);
            }
            let mut left = Vec::new();
            let mut prepared: BTreeSet<(&str, &str, usize)> = BTreeSet::new();
            for search in own {
                let f = search[0].factors;
                if !searches.is_empty() && (agents + f.population > room || work >= RUNS) {
                    left.push(search);
                    continue;
                }
                agents += f.population;
                work += self.work(&f, prepared.insert((f.criterion.name(), f.scale.name(), f.machine)));
                searches.push((datasets.len(), search));
            }
            samples += prepared.len() as u64 * self.samples(dataset.motor);
            datasets.push(dataset);
            *rest = (!left.is_empty()).then_some((dataset, left));
        }
        (datasets, searches)
    }

    /// Returns the work to prepare and polish a search, relative to one of the linear motor. If extensions are selected
    /// first, a piece has one selection per thread.
    fn work(&self, factors: &Factors, is_new: bool) -> usize {
        let spec = self.sweep.study().spec(factors);
        let choice = if spec.with == With::Auto && is_new { RUNS.div_ceil(rayon::current_num_threads()) } else { 0 };
        choice + if spec.is_extended() { EXTENDED } else { 1 }
    }

    /// Groups the runs of a unit into searches: runs that differ only in their polish share one.
    fn searches(&self, unit: &Unit) -> Vec<Search> {
        let mut all: BTreeMap<_, Search> = BTreeMap::new();
        for id in &unit.ids {
            let job = self.sweep.runs.job(*id);
            let f = &job.factors;
            let key = (f.seed, f.method.name(), f.population, [f.criterion.name(), f.scale.name()], f.machine);
            all.entry(key).or_default().push(job);
        }
        all.into_values().collect()
    }

    /// Returns the number of candidates of a generation that fit in a piece.
    fn room(&self, generations: usize, motor: usize) -> usize {
        let by_time = STEPS / (self.samples(motor) * generations as u64).max(1);
        let least =
            if self.sweep.pinned()[0] == "gpu" { CANDIDATES_GPU } else { CANDIDATES * rayon::current_num_threads() };
        numeric::index(by_time).clamp(least, VALUES / Parameter::COUNT)
    }

    /// Returns the approximate number of samples of a motor's recordings, at 40 bytes of a file per sample.
    pub(super) fn samples(&self, motor: usize) -> u64 {
        let files = &self.sweep.manifest.motors[motor].files;
        (files.iter().map(|file| file.bytes).sum::<u64>() / 40).max(100)
    }

    /// Runs prepared searches in lockstep.
    fn together(
        &mut self,
        generations: usize,
        ready: Vec<Ready>,
        mut finished: Vec<Finished>,
        device: &mut Option<BatchSearchEvaluator>,
    ) -> Step {
        if ready.is_empty() {
            return self.keep(finished);
        }
        let (begun, sweep, count) = (Instant::now(), self.sweep, numeric::count(ready.len()));
        let mut ended = Ok(());
        let mut runs = set_up(&ready, generations)?;
        let problems: Vec<Arc<Problem>> = ready.iter().map(|one| one.prepared.problem().clone()).collect();
        let lockstep = match device.as_mut() {
            Some(lockstep) => {
                lockstep.set_problems(problems);
                lockstep
            }
            None => device.insert(sweep.open_device(problems)?),
        };
        let budget = Budget { generations, slice: lockstep.slice() };
        let stop = minimize(&mut runs, budget, lockstep, &mut |progress| {
            ended = self.progress(numeric::count(progress.generation) / numeric::count(generations) * count);
            if ended.is_err() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        let device = lockstep.device();
        self.tally.warnings.extend(lockstep.take_warnings());
        self.tally.device = Some(device.clone());
        if stop? == Stop::Interrupted {
            return ended.and(Err(End::Interrupted));
        }
        let seconds = begun.elapsed().as_secs_f64() / count;
        let results = |(one, run): (Ready, Run)| sweep.results(&one, &run, &device, seconds);
        let done: Vec<Vec<Finished>> = ready.into_par_iter().zip(runs).map(results).collect();
        finished.extend(done.into_iter().flatten());
        self.keep(finished)
    }
}

impl Sweep {
    /// Reads the recordings and prepares the searches. Searches that cannot be prepared are returned as finished.
    fn ready(
        &self,
        datasets: &[Dataset],
        searches: Vec<(usize, Search)>,
        kept: &mut Kept,
    ) -> (Vec<Ready>, Vec<Finished>) {
        let realized = self.realized(datasets, kept);
        let key = |of: usize, job: &Job| -> Key {
            let f = &job.factors;
            let by_polish = realized[of].as_ref().is_ok_and(|of| !has_all_channels(&of.fitted));
            (of, [f.criterion.name(), f.scale.name()], f.machine, by_polish.then_some(f.polish.name()))
        };
        let mut wanted: BTreeMap<Key, IdentifySpec> = BTreeMap::new();
        let mut runs: Vec<(Key, Search)> = Vec::new();
        for (dataset, jobs) in searches {
            let first = runs.len();
            for job in jobs {
                let key = key(dataset, &job);
                wanted.entry(key).or_insert_with(|| self.study().spec(&job.factors));
                match runs[first..].iter_mut().find(|(of, _)| *of == key) {
                    Some((_, jobs)) => jobs.push(job),
                    None => runs.push((key, vec![job])),
                }
            }
        }
        let prepare = |(key, spec): (Key, IdentifySpec)| {
            let made = realized[key.0].clone().and_then(|of| {
                let prepared = PreparedSearch::with_reference(&of.fitted, &spec)?;
                Ok((of, Arc::new(prepared)))
            });
            (key, made)
        };
        let prepared: BTreeMap<Key, Result<_>> = wanted.into_par_iter().map(prepare).collect();
        let (mut ready, mut finished) = (Vec::new(), Vec::new());
        for (key, jobs) in runs {
            match prepared[&key].clone() {
                Ok((recordings, prepared)) => ready.push(Ready { jobs, recordings, prepared }),
                Err(error) => {
                    let outcome = self.failed(&error);
                    finished.extend(jobs.iter().map(|job| Finished::new(self, job, &outcome, 0.0)));
                }
            }
        }
        (ready, finished)
    }

    /// Returns the recordings of each dataset. Those of the last motor are kept for the next piece.
    fn realized(&self, datasets: &[Dataset], kept: &mut Kept) -> Vec<Read> {
        let mut motors: Vec<usize> = datasets.iter().map(|dataset| dataset.motor).collect();
        motors.dedup();
        let known = kept.take();
        let read = |motor: &usize| (*motor, self.read_or_kept(*motor, [OF_MOTOR], known.as_ref()));
        let read: BTreeMap<usize, Sets> = motors.par_iter().map(read).collect();
        *kept = motors.last().and_then(|motor| Some((*motor, read.get(motor)?.clone())));
        datasets.par_iter().map(|of| self.with_noise(&read[&of.motor], *of)).collect()
    }

    fn open_device(&self, problems: Vec<Arc<Problem>>) -> Result<BatchSearchEvaluator> {
        let on_loss = self.study().on_loss;
        let spec = self.device()?;
        match BatchSearchEvaluator::open(&spec, problems.clone()) {
            Err(error) if error.kind() == ErrorKind::Device && on_loss == OnLoss::ReopenOrCpu => {
                let cpu = IdentifySpec { device: DeviceSpec::Cpu, precision: PrecisionSpec::Auto, ..spec };
                Ok(BatchSearchEvaluator::open(&cpu, problems)?.replacing_failed(&error))
            }
            opened => Ok(opened?.on_loss(on_loss)),
        }
    }

    /// Returns the results of a search, one per polish.
    fn results(&self, one: &Ready, run: &Run, used: &DeviceUsed, seconds: f64) -> Vec<Finished> {
        let Ready { jobs, recordings, prepared } = one;
        let best = run.optimizer.best().filter(|best| Scalar::cost(prepared.problem(), best.values).is_finite());
        let of = |job: &Job| {
            let begun = Instant::now();
            let spec = self.study().spec(&job.factors);
            let found = best.as_ref().ok_or_else(|| diverged(run.evaluations)).and_then(|best| {
                let run = SearchRun { values: best.values, evaluations: run.evaluations, device: used };
                recordings.validated(prepared.finish(recordings.diagnosed(), &spec, run)?, &spec)
            });
            let outcome =
                found.map_or_else(|error| self.failed(&error), |found| Outcome::of(&found, &self.study().limits));
            let &DeviceUsed { kind: device, precision, .. } = used;
            let mut outcome = Outcome { device, precision, ..outcome };
            if device != self.pinned()[0] {
                outcome.warnings.push("gpu_failed".to_owned());
            }
            Finished::new(self, job, &outcome, seconds + begun.elapsed().as_secs_f64())
        };
        jobs.iter().map(of).collect()
    }
}

/// Draws the initial populations; a run is the same as that of `identify` with its seed.
fn set_up(ready: &[Ready], generations: usize) -> Result<Vec<Run>> {
    let run = |one: &Ready| {
        let f = &one.jobs[0].factors;
        let bounds = one.prepared.problem().space().bounds();
        let setup =
            SearchSettings { bounds, population: f.population, generations, seed: f.seed, ..SearchSettings::default() };
        Ok(Run::new(f.method.optimizer(setup)?))
    };
    ready.par_iter().map(run).collect()
}

fn diverged(evaluations: u64) -> Error {
    let remedy = "Check the units of the recording and the bounds. The discretization zoh itself is stable.";
    Error::not_identified(format!("all {evaluations} candidates diverge"), remedy)
}
