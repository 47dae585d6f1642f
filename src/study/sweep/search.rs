//! Population searches: many runs in lock step, all agents of a generation as one batch, piece by piece.

use super::Sweep;
use super::direct::{RUNS, Scene, Unit, Units};
use super::line::{Device, Outcome, Precision, Stop};
use super::manifest::Job;
use super::run::{End, Finished, Running};
use super::scene::{Read, outcome, problem};
use crate::evaluate::{Problem, Scalar};
use crate::identify::{IdentifySpec, Lockstep, polished};
use crate::numeric;
use crate::optimize::{Budget, Run, Setup, Stop as SearchStop, minimize};
use crate::record::Record;
use crate::{Error, ErrorKind, Result};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

/// Candidate-steps of a piece on the CPU: some tenths of a second, which is what a crash may cost…
const STEPS: u64 = 1_000_000_000;
/// …but candidates of a generation for each thread at least, so that threads seldom wait.
const CANDIDATES: usize = 3072;
/// A GPU needs more candidates to be full.
const CANDIDATES_GPU: usize = 1 << 17;
/// Samples of all its problems together, and values of its populations: what bounds memory.
const SAMPLES: u64 = 2_000_000;
const VALUES: usize = 1 << 23;

/// A search with all its runs: they differ in their polish alone.
struct Search {
    jobs: Vec<Job>,
    /// Place of its scene in the piece.
    scene: usize,
}

/// A search that can begin.
struct Ready {
    jobs: Vec<Job>,
    records: Arc<Vec<Record>>,
    problem: Arc<Problem>,
}

/// A problem by its scene, criterion and scale.
type Problems = BTreeMap<(usize, &'static str, &'static str), Result<(Arc<Vec<Record>>, Arc<Problem>)>>;

impl Running<'_> {
    /// Runs of population searches, those of as many generations together.
    pub(super) fn search(&mut self) -> Result<Option<End>> {
        let mut device: Option<Lockstep> = None;
        let mut generations = self.sweep.study().generations.clone();
        generations.sort_unstable();
        for generations in generations {
            let mut units =
                Units::new(self, RUNS, |job| job.factors.method.is_search() && job.factors.generations == generations);
            let mut rest: Option<(Scene, Vec<Search>)> = None;
            let mut kept: Option<(usize, Read)> = None;
            loop {
                let (scenes, searches) = self.piece(&mut units, &mut rest, generations);
                if searches.is_empty() {
                    break;
                }
                let (ready, finished) = self.sweep.ready(&scenes, searches, &mut kept);
                if let Some(end) = self.together(generations, ready, finished, &mut device)? {
                    return Ok(Some(end));
                }
            }
        }
        Ok(None)
    }

    /// The searches of the next piece, with their scenes. What does not fit any more is the `rest`.
    fn piece(
        &self,
        units: &mut Units,
        rest: &mut Option<(Scene, Vec<Search>)>,
        generations: usize,
    ) -> (Vec<Scene>, Vec<Search>) {
        let (mut scenes, mut searches) = (Vec::new(), Vec::new());
        let (mut agents, mut room, mut samples) = (0, 0, 0);
        while searches.is_empty() || (agents < room && samples < SAMPLES && rest.is_none()) {
            let next = || units.next(self).map(|unit| (unit.scene, self.searches(&unit)));
            let Some((scene, own)) = rest.take().or_else(next) else { break };
            if searches.is_empty() {
                room = self.room(generations, scene.motor);
            }
            let mut left = Vec::new();
            let mut criteria: Vec<(&str, &str)> = Vec::new();
            for search in own {
                let f = search.jobs[0].factors;
                if !searches.is_empty() && (agents + f.population > room || searches.len() >= RUNS) {
                    left.push(search);
                    continue;
                }
                agents += f.population;
                criteria.push((f.criterion.name(), f.scale.name()));
                searches.push(Search { scene: scenes.len(), ..search });
            }
            criteria.sort_unstable();
            criteria.dedup();
            samples += criteria.len() as u64 * self.samples(scene.motor);
            scenes.push(scene);
            *rest = (!left.is_empty()).then_some((scene, left));
        }
        (scenes, searches)
    }

    /// The searches of a unit: runs that differ in their polish alone are one.
    fn searches(&self, unit: &Unit) -> Vec<Search> {
        let mut all: BTreeMap<(u64, &str, usize, &str, &str), Vec<Job>> = BTreeMap::new();
        for id in &unit.ids {
            let job = self.sweep.runs.job(*id);
            let f = &job.factors;
            let key = (f.seed, f.method.name(), f.population, f.criterion.name(), f.scale.name());
            all.entry(key).or_default().push(job);
        }
        all.into_values().map(|jobs| Search { jobs, scene: 0 }).collect()
    }

    /// Candidates of a generation that a piece has room for.
    fn room(&self, generations: usize, motor: usize) -> usize {
        let by_time = STEPS / (self.samples(motor) * generations as u64).max(1);
        let least = if self.sweep.pinned().0 == Device::Gpu {
            CANDIDATES_GPU
        } else {
            CANDIDATES * rayon::current_num_threads()
        };
        numeric::index(by_time).clamp(least, VALUES / 5)
    }

    /// About how many samples a motor's recordings have: one takes some 40 bytes of a file.
    pub(super) fn samples(&self, motor: usize) -> u64 {
        let files = &self.sweep.manifest.motors[motor].files;
        (files.iter().map(|file| file.bytes).sum::<u64>() / 40).max(100)
    }

    /// Runs some searches in lock step.
    fn together(
        &mut self,
        generations: usize,
        ready: Vec<Ready>,
        mut finished: Vec<Finished>,
        device: &mut Option<Lockstep>,
    ) -> Result<Option<End>> {
        let begun = Instant::now();
        let sweep = self.sweep;
        let count = ready.len();
        let mut ended = None;
        if count > 0 {
            let mut runs = set_up(&ready, generations)?;
            let problems: Vec<Arc<Problem>> = ready.iter().map(|one| one.problem.clone()).collect();
            let lockstep = match device.as_mut() {
                Some(lockstep) => {
                    lockstep.turn_to(problems);
                    lockstep
                }
                None => device.insert(sweep.open_device(problems)?),
            };
            let budget = Budget { generations, slice: lockstep.slice() };
            let stop = minimize(&mut runs, budget, lockstep, &mut |progress| {
                let share = numeric::count(progress.generation) / numeric::count(generations) * numeric::count(count);
                ended = self.progress(share);
                if ended.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            });
            let device = lockstep.device();
            self.tally.warnings.extend(lockstep.take_warnings());
            self.tally.device = Some((device.1, device.2));
            if stop? == SearchStop::Interrupted {
                return Ok(Some(ended.unwrap_or(End::Interrupted)));
            }
            let seconds = begun.elapsed().as_secs_f64() / numeric::count(count);
            let evaluated = Evaluated {
                device: if device.0 == "gpu" { Device::Gpu } else { Device::Cpu },
                precision: if device.2 == "f32" { Precision::F32 } else { Precision::F64 },
                seconds,
            };
            let done: Vec<Vec<Finished>> =
                ready.into_par_iter().zip(runs).map(|(one, run)| sweep.results(&one, &run, &evaluated)).collect();
            finished.extend(done.into_iter().flatten());
        }
        Ok(self.keep(finished))
    }
}

impl Sweep {
    /// Reads and prepares what searches need; those that cannot begin are finished.
    fn ready(
        &self,
        scenes: &[Scene],
        searches: Vec<Search>,
        kept: &mut Option<(usize, Read)>,
    ) -> (Vec<Ready>, Vec<Finished>) {
        let mut motors: Vec<usize> = scenes.iter().map(|scene| scene.motor).collect();
        motors.dedup();
        let known = kept.take();
        let read = |motor: &usize| match &known {
            Some((of, records)) if of == motor => (*motor, records.clone()),
            _ => (*motor, self.read(*motor)),
        };
        let read: BTreeMap<usize, Read> = motors.par_iter().map(read).collect();
        *kept = motors.last().and_then(|motor| Some((*motor, read.get(motor)?.clone())));
        let realized = |scene: &Scene| self.with_noise(&read[&scene.motor], scene.noise, scene.seed);
        let realized: Vec<Read> = scenes.par_iter().map(realized).collect();
        let key = |search: &Search| {
            let f = &search.jobs[0].factors;
            (search.scene, f.criterion.name(), f.scale.name())
        };
        let mut wanted: BTreeMap<_, IdentifySpec> = BTreeMap::new();
        for search in &searches {
            wanted.entry(key(search)).or_insert_with(|| self.study().spec(&search.jobs[0].factors));
        }
        let make = |(key, spec): (_, IdentifySpec)| {
            let (scene, ..): (usize, _, _) = key;
            let made = realized[scene].clone().and_then(|records| {
                let problem = problem(&records, &spec)?;
                Ok((records, Arc::new(problem)))
            });
            (key, made)
        };
        let problems: Problems = wanted.into_par_iter().map(make).collect();
        let (mut ready, mut finished) = (Vec::new(), Vec::new());
        for search in searches {
            match &problems[&key(&search)] {
                Ok((records, problem)) => {
                    ready.push(Ready { jobs: search.jobs, records: records.clone(), problem: problem.clone() });
                }
                Err(error) => {
                    let outcome = self.failed(error);
                    finished.extend(search.jobs.iter().map(|job| Finished::new(self, job, &outcome, 0.0)));
                }
            }
        }
        (ready, finished)
    }

    fn open_device(&self, problems: Vec<Arc<Problem>>) -> Result<Lockstep> {
        let on_loss = self.study().on_loss;
        let spec = self.device()?;
        match Lockstep::open(&spec, problems.clone()) {
            Err(error) if error.kind() == ErrorKind::Device && on_loss == crate::identify::OnLoss::ReopenOrCpu => {
                let cpu = IdentifySpec {
                    device: crate::identify::DeviceSpec::Cpu,
                    precision: crate::identify::PrecisionSpec::Auto,
                    ..spec
                };
                Ok(Lockstep::open(&cpu, problems)?.in_place_of_one_that_failed(&error))
            }
            opened => Ok(opened?.on_loss(on_loss)),
        }
    }

    /// What a search found, for each polish that it is wanted with.
    fn results(&self, one: &Ready, run: &Run, evaluated: &Evaluated) -> Vec<Finished> {
        let best = run.optimizer.best().filter(|best| Scalar::cost(&one.problem, best.values).is_finite());
        let of = |job: &Job| {
            let begun = Instant::now();
            let spec = self.study().spec(&job.factors);
            let found = match &best {
                None => Err(diverged(run.evaluations)),
                Some(best) => polished(&one.records, &spec, one.problem.space(), best.values)
                    .and_then(|fitted| outcome(&one.problem, &fitted)),
            };
            let mut outcome = match found {
                Ok(outcome) => Outcome { evaluations: run.evaluations, stop: Stop::BudgetSpent, ..outcome },
                Err(error) => self.failed(&error),
            };
            (outcome.device, outcome.precision) = (evaluated.device, evaluated.precision);
            if outcome.device != self.pinned().0 {
                outcome.warnings.push("gpu_failed".to_owned());
            }
            Finished::new(self, job, &outcome, evaluated.seconds + begun.elapsed().as_secs_f64())
        };
        one.jobs.iter().map(of).collect()
    }
}

/// The device that evaluated a run, its precision, and the seconds that the run took of the search.
struct Evaluated {
    device: Device,
    precision: Precision,
    seconds: f64,
}

/// The first populations. A run is that of `identify` with its seed.
fn set_up(ready: &[Ready], generations: usize) -> Result<Vec<Run>> {
    let run = |one: &Ready| {
        let f = &one.jobs[0].factors;
        let setup =
            Setup { bounds: one.problem.space().bounds(), population: f.population, generations, seed: f.seed, run: 0 };
        Ok(Run::new(f.method.optimizer(setup)?))
    };
    ready.par_iter().map(run).collect()
}

fn diverged(evaluations: u64) -> Error {
    let remedy = "Check the units of the recording and the bounds; the discretization zoh cannot diverge by itself.";
    Error::new(ErrorKind::NotIdentified, format!("all {evaluations} candidates diverge"), remedy)
}
