//! How many candidate-steps a second each evaluator of this machine does, end to end, over population sizes.
//!
//! All contenders of a case are measured in turn, every other round in the reverse order, so that a machine that slows
//! down or speeds up does so for all. A figure is the median over rounds; its spread half the range of the middle half.

use crate::candidates::Candidates;
use crate::criterion::Criterion;
use crate::evaluate::{Batch, Evaluator, Group, Level, Model, Problem, Scalar, Simd, cpu_name, fma_loop};
use crate::experiment::{Excitation, simulated};
use crate::motor::{Discretization, Parameters, Space};
use crate::optimize::{Sample, Sampling};
use crate::{Error, Result};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

/// What is measured.
#[derive(Debug, Clone, PartialEq)]
pub struct ThroughputSpec {
    /// Candidates in a batch.
    pub populations: Vec<usize>,
    /// Samples of the recordings, all of them simulated.
    pub samples: Vec<usize>,
    /// Seconds that measuring may take, about.
    pub budget_s: f64,
    /// Threads of the contender that uses several.
    pub threads: usize,
    /// Whether GPU adapters are measured too.
    pub gpus: bool,
}

/// An evaluator under its full name.
pub struct Contender {
    /// Device, numbers, and for a CPU level and threads.
    pub name: String,
    /// cpu, or the kind of adapter: discrete, integrated, virtual, software, other.
    pub kind: &'static str,
    /// f32 or f64.
    pub precision: &'static str,
    /// Threads; 0 for a GPU.
    pub threads: usize,
    evaluator: Box<dyn Evaluator>,
    pool: Option<rayon::ThreadPool>,
}

impl Contender {
    /// An evaluator that runs on so many threads of the CPU, under a name.
    ///
    /// # Errors
    /// `Usage` when threads cannot be started.
    pub fn on_cpu(name: String, evaluator: Box<dyn Evaluator>, threads: usize) -> Result<Self> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool =
            pool.map_err(|e| Error::usage(format!("threads cannot be started: {e}"), "Give fewer --threads."))?;
        Ok(Self { name, kind: "cpu", precision: "f64", threads, evaluator, pool: Some(pool) })
    }

    /// Seconds of one evaluation.
    fn seconds(&mut self, groups: &[Group<'_>], costs: &mut [f64]) -> Result<f64> {
        let Self { evaluator, pool, .. } = self;
        let mut run = || {
            let begun = Instant::now();
            evaluator.evaluate(&Batch { groups }, costs)?;
            Ok(begun.elapsed().as_secs_f64())
        };
        match pool {
            Some(pool) => pool.install(run),
            None => run(),
        }
    }
}

/// A contender at one population and recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// Which contender.
    pub contender: usize,
    /// Candidates.
    pub population: usize,
    /// Samples.
    pub samples: usize,
    /// Median seconds of a batch; `None` where the budget does not allow one.
    pub seconds: Option<f64>,
    /// Half the range of the middle half of all rounds, relative to the median.
    pub spread: f64,
    /// Rounds.
    pub rounds: usize,
}

impl Measurement {
    /// Candidate-steps a second.
    #[must_use]
    pub fn rate(&self) -> Option<f64> {
        #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
        let steps = (self.population * self.samples) as f64;
        self.seconds.map(|seconds| steps / seconds)
    }
}

/// The result of a bench.
pub struct Throughput {
    /// Who took part.
    pub contenders: Vec<Contender>,
    /// Adapters that could not take part, and why.
    pub refused: Vec<String>,
    /// Every case of every contender.
    pub measurements: Vec<Measurement>,
    /// Multiply–adds a second of one core, measured in the same run; `None` without FMA.
    pub fma_peak: Option<f64>,
    /// Whether the observer ended it early.
    pub interrupted: bool,
}

impl Throughput {
    /// From which population on a contender is faster than another on recordings of so many samples; `None` if never.
    #[must_use]
    pub fn crossover(&self, contender: usize, baseline: usize, samples: usize) -> Option<usize> {
        let rate = |who: usize, population: usize| {
            let of = |m: &&Measurement| m.contender == who && m.population == population && m.samples == samples;
            self.measurements.iter().find(of).and_then(Measurement::rate)
        };
        let mut populations: Vec<usize> = self.measurements.iter().map(|m| m.population).collect();
        populations.sort_unstable();
        populations.dedup();
        let wins = |p: &usize| rate(contender, *p).zip(rate(baseline, *p)).is_some_and(|(a, b)| a > b);
        // From there on: not a lucky case among losses.
        let last_loss = populations.iter().rposition(|p| rate(contender, *p).is_some() && !wins(p));
        let first = last_loss.map_or(0, |n| n + 1);
        populations[first..].iter().find(|p| wins(p)).copied()
    }
}

/// The evaluators of this machine.
///
/// # Errors
/// `Usage` when threads cannot be started.
pub fn contenders(spec: &ThroughputSpec) -> Result<(Vec<Contender>, Vec<String>)> {
    let (cpu, level) = (cpu_name(), Level::best());
    let mut list = vec![
        Contender::on_cpu(format!("{cpu}, scalar f64, 1 thread"), Box::new(Scalar), 1)?,
        Contender::on_cpu(format!("{cpu}, {} f64, 1 thread", level.name()), Box::new(Simd::default()), 1)?,
    ];
    if spec.threads > 1 {
        let name = format!("{cpu}, {} f64, {} threads", level.name(), spec.threads);
        list.push(Contender::on_cpu(name, Box::new(Simd::default()), spec.threads)?);
    }
    let mut refused = Vec::new();
    if spec.gpus {
        gpus(&mut list, &mut refused);
    }
    Ok((list, refused))
}

#[cfg(feature = "gpu")]
fn gpus(list: &mut Vec<Contender>, refused: &mut Vec<String>) {
    use crate::evaluate::gpu::{Gpu, Precision, Selector};
    for adapter in crate::evaluate::gpu::list() {
        let precisions = [Some(Precision::F32), adapter.f64.then_some(Precision::F64)];
        for precision in precisions.into_iter().flatten() {
            match Gpu::open(&Selector::Index(adapter.index), Some(precision)) {
                Ok(gpu) => list.push(Contender {
                    name: format!("{}, {} adapter, {}", adapter.name, adapter.kind, precision.name()),
                    kind: adapter.kind,
                    precision: precision.name(),
                    threads: 0,
                    evaluator: Box::new(gpu),
                    pool: None,
                }),
                Err(error) => refused.push(error.to_string()),
            }
        }
    }
}

#[cfg(not(feature = "gpu"))]
fn gpus(_: &mut Vec<Contender>, refused: &mut Vec<String>) {
    refused.push("this build has no GPU evaluation".to_owned());
}

/// Rounds of a case at least and at most.
const ROUNDS: (usize, usize) = (3, 25);

/// Measures contenders over all cases. `observe` sees cases done and cases in all, and may end it.
///
/// # Errors
/// `Usage` for a spec that cannot be; `Device` when a device fails on the way.
pub fn throughput(
    spec: &ThroughputSpec,
    contenders: Vec<Contender>,
    refused: Vec<String>,
    observe: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<Throughput> {
    let sizes = spec.populations.iter().chain(&spec.samples);
    if spec.populations.is_empty() || spec.samples.is_empty() || sizes.clone().any(|n| *n == 0) {
        return Err(Error::usage("a bench needs populations and samples above 0", "Give at least one of each."));
    }
    if spec.samples.iter().any(|n| *n < 2) || !(spec.budget_s.is_finite() && spec.budget_s > 0.0) {
        return Err(Error::usage("a bench needs recordings of 2 samples or more and a time", "Change the flags."));
    }
    let mut result =
        Throughput { contenders, refused, measurements: Vec::new(), fma_peak: fma_peak(), interrupted: false };
    let cases: Vec<(usize, usize)> =
        spec.samples.iter().flat_map(|s| spec.populations.iter().map(|p| (*s, *p))).collect();
    #[expect(clippy::cast_precision_loss, reason = "small")]
    let share = spec.budget_s / (cases.len() * result.contenders.len().max(1)) as f64;
    for (done, &(samples, population)) in cases.iter().enumerate() {
        if observe(done, cases.len()).is_break() {
            result.interrupted = true;
            return Ok(result);
        }
        case(&mut result, samples, population, share)?;
    }
    let _ = observe(cases.len(), cases.len());
    Ok(result)
}

/// One core's multiply–adds a second: the best of some tries.
fn fma_peak() -> Option<f64> {
    let level = Level::best();
    let try_once = || {
        let begun = Instant::now();
        fma_loop(level, 200_000).map(|operations| operations / begun.elapsed().as_secs_f64())
    };
    (0..15).filter_map(|_| try_once()).max_by(f64::total_cmp)
}

/// One case: all contenders in turn, `share` seconds for each.
fn case(result: &mut Throughput, samples: usize, population: usize, share: f64) -> Result<()> {
    let problem = problem(samples)?;
    let bounds = problem.space().bounds();
    let mut values = vec![0.0; population * bounds.len()];
    Sample::new(Sampling::Uniform, population as u64, bounds, 1)?.fill(0, &mut values);
    let groups = [Group { problem: &problem, candidates: Candidates::new(&values, 5), reference: None }];
    let mut costs = vec![0.0; population];
    let mut times: Vec<Vec<f64>> = Vec::new();
    let mut rounds: Vec<usize> = Vec::new();
    for n in 0..result.contenders.len() {
        // What the last population took tells whether this one can be afforded at all.
        let before = result.measurements.iter().rev().find(|m| m.contender == n && m.samples == samples);
        let expected = match before {
            None => 0.0,
            #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
            Some(m) => m.seconds.map_or(f64::INFINITY, |s| s * population as f64 / m.population as f64),
        };
        if expected > 3.0 * share {
            times.push(Vec::new());
            rounds.push(0);
            continue;
        }
        // The first run makes buffers and compiles shaders.
        let first = result.contenders[n].seconds(&groups, &mut costs)?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let affordable = (share / first.max(1e-9)).clamp(1.0, 1e6) as usize;
        rounds.push(if affordable < ROUNDS.0 { 1 } else { affordable.min(ROUNDS.1) });
        times.push(Vec::new());
    }
    for round in 0..rounds.iter().copied().max().unwrap_or(0) {
        let count = result.contenders.len();
        for turn in 0..count {
            let n = if round % 2 == 0 { turn } else { count - 1 - turn };
            if round < rounds[n] {
                times[n].push(result.contenders[n].seconds(&groups, &mut costs)?);
            }
        }
    }
    for (contender, mut times) in times.into_iter().enumerate() {
        times.sort_by(f64::total_cmp);
        let rounds = times.len();
        let at = |share: usize| times[(rounds - 1) * share / 4];
        let seconds = (rounds > 0).then(|| at(2));
        let spread = seconds.map_or(0.0, |median| 0.5 * (at(3) - at(1)) / median);
        result.measurements.push(Measurement { contender, population, samples, seconds, spread, rounds });
    }
    Ok(())
}

/// The paper's motor under a step at once: every sample is simulated.
fn problem(samples: usize) -> Result<Arc<Problem>> {
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
    let excitation = Excitation::step(10.5, 0.0, (samples - 1) as f64 * 0.001, 0.001)?;
    let record = simulated(&Parameters::M2, &excitation, Discretization::Zoh)?;
    Ok(Arc::new(Problem::new(&[record], Model::default(), Space::table2(), Criterion::default())?))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A contender that is never run.
    fn named(name: &str) -> Contender {
        Contender::on_cpu(name.to_owned(), Box::new(Scalar), 1).unwrap()
    }

    #[test]
    fn a_crossover_is_from_where_on_it_wins_and_stays() {
        let seconds = [[1.0, 2.0, 10.0, 40.0], [3.0, 1.5, 12.0, 20.0], [0.5, 1.0, 5.0, 20.0]];
        let mut measurements = Vec::new();
        for (contender, seconds) in seconds.iter().enumerate() {
            for (n, seconds) in seconds.iter().enumerate() {
                let population = [1, 10, 100, 1000][n];
                let seconds = Some(*seconds);
                measurements.push(Measurement { contender, population, samples: 10, seconds, spread: 0.0, rounds: 1 });
            }
        }
        let contenders = ["base", "late", "always"].map(named).into();
        let result = Throughput { contenders, refused: Vec::new(), measurements, fma_peak: None, interrupted: false };
        // It wins at 10, loses at 100, wins at 1000: from 1000 on.
        assert_eq!(result.crossover(1, 0, 10), Some(1000));
        assert_eq!(result.crossover(2, 0, 10), Some(1));
        assert_eq!(result.crossover(0, 2, 10), None);
        assert_eq!(result.crossover(1, 0, 99), None);
        assert_eq!(result.measurements[0].rate(), Some(10.0));
    }
}
