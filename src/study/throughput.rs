//! How many candidate-steps a second each evaluator of this machine does, end to end, over population sizes.
//!
//! All contenders of a case are measured in turn, in an order drawn anew for every second round and then taken backwards,
//! so that a machine that slows down or speeds up does so for all, and nobody always follows the same neighbour. Short
//! evaluations are repeated until a round takes some milliseconds: what is measured is a stream of batches, as a search
//! makes them, not the waking of sleeping threads.

use super::contender::Contenders;
use super::measurement::{Measurement, Throughput, baseline};
use crate::candidates::Candidates;
use crate::criterion::Criterion;
use crate::evaluate::{Group, Level, Model, Problem, fma_loop};
use crate::experiment::{Excitation, simulated};
use crate::motor::{Discretization, Parameters, Space};
use crate::optimize::{Sample, Sampling};
use crate::{Error, Result};
use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
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
}

/// Rounds of a case at most, and below which number one must do.
const ROUNDS: (usize, usize) = (3, 25);
/// Seconds of a round at least, and evaluations in it at most.
const ROUND_S: f64 = 0.003;
const REPEATS: f64 = 3000.0;
/// Evaluations whose kernel time is taken.
const TIMED: usize = 5;

/// Measures contenders over all cases. `observe` sees cases done and cases in all, and may end it.
///
/// # Errors
/// `Usage` for a spec that cannot be; `Device` when a device fails on the way.
pub fn throughput(
    spec: &ThroughputSpec,
    (contenders, refused): Contenders,
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
    // The last place is the baseline's, once more.
    let count = result.contenders.len();
    let baseline = baseline(&result.contenders);
    let (mut rounds, mut repeats) = (vec![0; count], vec![1; count]);
    for n in 0..count {
        if expected(result, n, [population, samples]) > 3.0 * share {
            continue;
        }
        // The first run makes buffers and compiles shaders.
        let first = result.contenders[n].seconds(&groups, &mut costs, 1)?;
        let seconds = if first < ROUND_S { result.contenders[n].seconds(&groups, &mut costs, 3)? } else { first };
        let whole = (ROUND_S / seconds.max(1e-9)).ceil().clamp(1.0, REPEATS);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let (repeat, affordable) = (whole as usize, (share / (seconds * whole)).clamp(1.0, 1e6) as usize);
        rounds[n] = if affordable < ROUNDS.0 { 1 } else { affordable.min(ROUNDS.1) };
        repeats[n] = repeat;
    }
    if let Some(baseline) = baseline {
        rounds.push(rounds[baseline]);
        repeats.push(repeats[baseline]);
    }
    let mut order: Vec<usize> = (0..rounds.len()).collect();
    let mut random = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(1);
    let mut times = vec![Vec::new(); rounds.len()];
    for round in 0..rounds.iter().copied().max().unwrap_or(0) {
        if round % 2 == 0 {
            order.shuffle(&mut random);
        } else {
            order.reverse();
        }
        for &n in order.iter().filter(|n| round < rounds[**n]) {
            let who = if n == count { baseline.unwrap_or(0) } else { n };
            times[n].push(result.contenders[who].seconds(&groups, &mut costs, repeats[n])?);
        }
    }
    let again = times.split_off(count).pop().filter(|times| !times.is_empty());
    let mut again = again.map(|times| Measurement::of([count, population, samples], times));
    for (n, times) in times.into_iter().enumerate() {
        let mut measurement = Measurement::of([n, population, samples], times);
        let mut kernel = Vec::new();
        for _ in 0..TIMED.min(rounds[n]) {
            kernel.extend(result.contenders[n].kernel_seconds(&groups, &mut costs)?);
        }
        kernel.sort_by(|a: &[f64; 2], b| a[0].total_cmp(&b[0]));
        if baseline == Some(n) {
            measurement.again = again.take().and_then(|again| Some((again.seconds?, again.interval)));
        }
        measurement.kernel = kernel.get(kernel.len() / 2).copied();
        result.measurements.push(measurement);
    }
    Ok(())
}

/// What the last population took tells whether this one can be afforded at all.
fn expected(result: &Throughput, contender: usize, [population, samples]: [usize; 2]) -> f64 {
    match result.of(contender).filter(|m| m.samples == samples).last() {
        None => 0.0,
        #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
        Some(m) => m.seconds.map_or(f64::INFINITY, |s| s * population as f64 / m.population as f64),
    }
}

/// The paper's motor under a step at once: every sample is simulated.
fn problem(samples: usize) -> Result<Arc<Problem>> {
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
    let excitation = Excitation::step(10.5, 0.0, (samples - 1) as f64 * 0.001, 0.001)?;
    let record = simulated(&Parameters::M2, &excitation, Discretization::Zoh)?;
    Ok(Arc::new(Problem::new(&[record], Model::default(), Space::table2(), Criterion::default())?))
}
