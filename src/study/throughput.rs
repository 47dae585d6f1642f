//! Throughput of this machine's evaluators in candidate-steps per second, end to end, over population sizes.
//!
//! All contenders of a case are measured in turn, in an order drawn anew for every second round and then taken backwards,
//! so that a machine that slows down or speeds up does so for all, and nobody always follows the same neighbour. Short
//! evaluations are repeated until a round takes some milliseconds: what is measured is a stream of batches, as a search
//! makes them, not the waking of sleeping threads.

use super::contender::Contenders;
use super::measurement::{Measurement, Throughput};
use crate::candidates::Candidates;
use crate::criterion::Criterion;
use crate::evaluate::{Group, Level, Model, Problem, fma_loop};
use crate::experiment::{Excitation, simulated};
use crate::motor::{Discretization, Parameters, Space};
use crate::numeric::{count, whole};
use crate::optimize::{Sample, Sampling};
use crate::record::SAMPLES_MAX;
use crate::setting::{Setting, text};
use crate::{Error, Result};
use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

/// Settings of a bench.
#[derive(Debug, Clone, PartialEq)]
pub struct ThroughputSpec {
    /// Candidates in a batch.
    pub populations: Vec<usize>,
    /// Samples of the recordings, all of them simulated.
    pub samples: Vec<usize>,
    /// Seconds that measuring may take, about.
    pub budget_s: f64,
}

/// Rounds of a case at least (fewer have no interval of 95 %) and at most; a case that cannot have so many has one.
const ROUNDS: (usize, usize) = (6, 25);
/// Seconds of a round at least, and evaluations in it at most.
const ROUND_S: f64 = 0.003;
const REPEATS: f64 = 3000.0;
/// Evaluations whose kernel time is taken.
const TIMED: usize = 5;
/// The most candidates: 1 GiB of them.
pub(super) const POPULATION_MAX: usize = (1 << 27) / 5;

impl ThroughputSpec {
    /// Returns whether it can be measured; the same size twice is one.
    ///
    /// # Errors
    /// `Usage` where not.
    pub fn checked(mut self) -> Result<Self> {
        let bad = |name: Setting, n: usize, range: &str| {
            Err(Error::usage(text!({name} ": {n} cannot be measured"), format!("Give {range}.")))
        };
        if let Some(&n) = self.populations.iter().find(|n| !(1..=POPULATION_MAX).contains(*n)) {
            return bad(Setting::Populations, n, &format!("1 to {POPULATION_MAX} candidates"));
        }
        if let Some(&n) = self.samples.iter().find(|n| !(2..=SAMPLES_MAX).contains(*n)) {
            return bad(Setting::Samples, n, &format!("2 to {SAMPLES_MAX} samples"));
        }
        if self.populations.is_empty() || self.samples.is_empty() {
            let message = text!("a bench needs " [Populations] " and " [Samples]);
            return Err(Error::usage(message, "Give at least one of each."));
        }
        if !(self.budget_s.is_finite() && self.budget_s > 0.0) {
            let message = text!([Seconds](" is {}", self.budget_s));
            return Err(Error::usage(message, "Give the seconds that measuring may take, more than 0."));
        }
        for list in [&mut self.populations, &mut self.samples] {
            let mut seen = std::collections::BTreeSet::new();
            list.retain(|n| seen.insert(*n));
        }
        Ok(self)
    }
}

/// Measures contenders over all cases. `observe` sees cases done and cases in all, and may end it. A contender that fails
/// on the way leaves the field and is named.
///
/// # Errors
/// `Usage` for a spec that cannot be.
pub fn throughput(
    spec: &ThroughputSpec,
    (contenders, refused): Contenders,
    observe: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<Throughput> {
    let spec = spec.clone().checked()?;
    let mut result =
        Throughput { contenders, refused, measurements: Vec::new(), fma_peak: fma_peak(), interrupted: false };
    let cases: Vec<(usize, usize)> =
        spec.samples.iter().flat_map(|s| spec.populations.iter().map(|p| (*s, *p))).collect();
    let share = spec.budget_s / count(cases.len() * (result.contenders.len() + 1));
    let mut failed = vec![false; result.contenders.len()];
    for (done, &(samples, population)) in cases.iter().enumerate() {
        let problem = problem(samples)?;
        let bounds = problem.space().bounds();
        let mut values = vec![0.0; population * bounds.len()];
        Sample::new(Sampling::Uniform, population as u64, bounds, 1)?.fill(0, &mut values);
        let costs = vec![0.0; population];
        let mut case = Case { problem, values, costs, samples, population, share, failed: &mut failed };
        if case.measure(&mut result, &mut || observe(done, cases.len())).is_break() {
            result.interrupted = true;
            return Ok(result);
        }
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

/// One population on one recording: all contenders in turn, `share` seconds for each.
struct Case<'a> {
    problem: Arc<Problem>,
    values: Vec<f64>,
    costs: Vec<f64>,
    samples: usize,
    population: usize,
    share: f64,
    /// Contenders that have failed before.
    failed: &'a mut [bool],
}

impl Case<'_> {
    /// Measures and adds to the result.
    fn measure(&mut self, result: &mut Throughput, observe: &mut dyn FnMut() -> ControlFlow<()>) -> ControlFlow<()> {
        // The last place is the baseline's, once more.
        let count = result.contenders.len();
        let baseline = result.baseline();
        let (mut rounds, mut repeats) = (vec![0; count + 1], vec![1; count + 1]);
        for n in 0..count {
            observe()?;
            (rounds[n], repeats[n]) = self.plan(result, n);
        }
        if let Some(baseline) = baseline {
            (rounds[count], repeats[count]) = (rounds[baseline], repeats[baseline]);
        }
        let mut order: Vec<usize> = (0..=count).collect();
        let mut random = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(1);
        let mut times = vec![Vec::new(); count + 1];
        for round in 0..rounds.iter().copied().max().unwrap_or(0) {
            observe()?;
            if round % 2 == 0 {
                order.shuffle(&mut random);
            } else {
                order.reverse();
            }
            for &n in order.iter().filter(|n| round < rounds[**n]) {
                let who = if n == count { baseline.unwrap_or(0) } else { n };
                times[n].extend(self.seconds(result, who, self.population, repeats[n]));
            }
        }
        self.add(result, times);
        ControlFlow::Continue(())
    }

    /// Rounds, and evaluations in a round, that a contender can have in its share; no rounds where it cannot have one.
    fn plan(&mut self, result: &mut Throughput, contender: usize) -> (usize, usize) {
        // What a part of the population takes tells whether all of it can be afforded: latency is not scaled up.
        let mut size = self.population.min(1000);
        let mut seconds = 0.0;
        let skipped = result.of(contender).any(|m| m.samples == self.samples && m.seconds.is_none());
        while !self.failed[contender] && !skipped {
            // The first run makes buffers and compiles shaders.
            let first = self.seconds(result, contender, size, 1).unwrap_or(f64::INFINITY);
            seconds =
                if first > self.share { first } else { self.seconds(result, contender, size, 1).unwrap_or(first) };
            let all = seconds * count(self.population) / count(size);
            if all > 3.0 * self.share && (size < self.population || first > 3.0 * self.share) && seconds > ROUND_S {
                return (0, 1);
            }
            if size == self.population {
                break;
            }
            size = self.population.min(10 * size);
        }
        if self.failed[contender] || skipped {
            return (0, 1);
        }
        let repeats = (ROUND_S / seconds.max(1e-9)).ceil().clamp(1.0, REPEATS);
        let affordable = whole((self.share / (seconds * repeats)).clamp(1.0, 1e6));
        (if affordable < ROUNDS.0 { 1 } else { affordable.min(ROUNDS.1) }, whole(repeats))
    }

    /// Seconds of an evaluation of the first `size` candidates; `None` where the contender fails, which ends it.
    fn seconds(&mut self, result: &mut Throughput, contender: usize, size: usize, repeats: usize) -> Option<f64> {
        let candidates = Candidates::new(&self.values[..5 * size], 5);
        let groups = [Group { problem: &self.problem, candidates, reference: None }];
        if self.failed[contender] {
            return None;
        }
        let seconds = result.contenders[contender].seconds(&groups, &mut self.costs[..size], repeats);
        if let Err(error) = &seconds {
            self.failed[contender] = true;
            result.refused.push(format!("{}: {error}", result.contenders[contender].name));
        }
        seconds.ok()
    }

    /// Adds the measurements of all contenders, with the times that devices computed.
    fn add(&mut self, result: &mut Throughput, mut times: Vec<Vec<f64>>) {
        let (population, samples) = (self.population, self.samples);
        let again = times.pop().filter(|times| !times.is_empty());
        let again = again.map(|times| Measurement::of(0, population, samples, times));
        let candidates = Candidates::new(&self.values, 5);
        let groups = [Group { problem: &self.problem, candidates, reference: None }];
        for (n, times) in times.into_iter().enumerate() {
            let rounds = times.len();
            let mut measurement = Measurement::of(n, population, samples, times);
            if result.baseline() == Some(n) {
                measurement.again = again.as_ref().and_then(|again| Some((again.seconds?, again.interval)));
            }
            let mut kernel = Vec::new();
            for _ in 0..TIMED.min(rounds).min(if result.contenders[n].driver.is_some() { TIMED } else { 0 }) {
                // A device that fails now has been measured all the same.
                let timed = result.contenders[n].kernel_seconds(&groups, &mut self.costs);
                kernel.extend(timed.ok().flatten().filter(|[kernel, _]| *kernel > 0.0));
            }
            kernel.sort_by(|a: &[f64; 2], b| a[0].total_cmp(&b[0]));
            measurement.kernel = kernel.get(kernel.len() / 2).copied();
            result.measurements.push(measurement);
        }
    }
}

/// The paper's motor under a step at once: every sample is simulated.
fn problem(samples: usize) -> Result<Arc<Problem>> {
    let excitation = Excitation::step(10.5, 0.0, count(samples - 1) * 0.001, 0.001)?;
    let record = simulated(&Parameters::M2, &excitation, Discretization::Zoh)?;
    Ok(Arc::new(Problem::new(&[record], Model::default(), Space::table2(), Criterion::default())?))
}
