//! Throughput of this machine's evaluators in candidate-steps per second, end to end, over population sizes.
//!
//! The evaluators of a case are measured in turn. Their order is drawn at random for every second round and reversed
//! for the next, so that drifts of the machine's speed affect all of them alike and none always follows the same one.
//! Short evaluations are repeated until a round takes some milliseconds. This measures a stream of batches, as in a
//! search, and not the time to wake idle threads or to compute the cells of tables of poles, which batches share.

use super::bench_problem::candidates;
use super::contender::{Contenders, Runner};
use super::measurement::{Measurement, Throughput};
use motorfit_core::candidates::Candidates;
use motorfit_core::clock::Instant;
use motorfit_core::numeric::{count, whole};
use motorfit_core::setting::{Setting, text};
use motorfit_core::{Error, Result};
use motorfit_evaluate::{Level, SearchProblem, fma_loop};
use motorfit_record::SAMPLES_MAX;
use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use std::ops::ControlFlow;
use std::sync::Arc;

/// Settings of a throughput benchmark.
#[derive(Debug, Clone, PartialEq)]
pub struct ThroughputSpec {
    /// Population sizes \[candidates\].
    pub populations: Vec<usize>,
    /// Lengths of the recordings \[samples\]; every sample is simulated.
    pub samples: Vec<usize>,
    /// Approximate time budget \[s\].
    pub budget_s: f64,
}

/// Smallest number of rounds of a case, which a 95 % interval needs, and largest one. A case whose time budget does not allow
/// the smallest number has one round.
const ROUNDS: (usize, usize) = (6, 25);
/// Shortest round \[s\].
const ROUND_S: f64 = 0.003;
/// Largest number of evaluations in a round.
const REPEATS: f64 = 3000.0;
/// Evaluations whose kernel time is measured.
const TIMED: usize = 5;
/// Largest population \[candidates\]: 1 GiB of values.
pub(super) const POPULATION_MAX: usize = (1 << 27) / 5;

impl ThroughputSpec {
    /// Checks the settings and returns them without duplicate sizes.
    ///
    /// # Errors
    /// Returns a `Usage` error if a list is empty, a size is out of range or the budget is not positive.
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
            let message = text!("a benchmark needs " [Populations] " and " [Samples]);
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

/// Measures the evaluators of a machine over all cases. `observe` receives the number of finished cases and of all cases, and may
/// end the benchmark. An evaluator that fails is excluded from then on and listed in [`Throughput::refused`].
///
/// # Errors
/// Returns a `Usage` error for invalid settings.
pub fn throughput<P: SearchProblem>(
    spec: &ThroughputSpec,
    Contenders { list: contenders, refused, mut runners, problem, .. }: Contenders<P>,
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
        let problem = Arc::new(problem(samples)?);
        let values = candidates(problem.as_ref(), population)?;
        let costs = vec![0.0; population];
        let (runners, failed) = (&mut runners[..], &mut failed[..]);
        let mut case = Case { problem, values, costs, samples, population, share, runners, failed };
        if case.measure(&mut result, &mut || observe(done, cases.len())).is_break() {
            result.interrupted = true;
            return Ok(result);
        }
    }
    let _ = observe(cases.len(), cases.len());
    Ok(result)
}

/// Returns the highest rate of multiply–adds of one core over 15 trials \[1/s\]; `None` without FMA instructions.
fn fma_peak() -> Option<f64> {
    let level = Level::best();
    let try_once = || {
        let begun = Instant::now();
        fma_loop(level, 200_000).map(|operations| operations / begun.elapsed().as_secs_f64())
    };
    (0..15).filter_map(|_| try_once()).max_by(f64::total_cmp)
}

/// One population size on one recording, with a budget of `share` seconds for each evaluator.
struct Case<'a, P: SearchProblem> {
    problem: Arc<P>,
    values: Vec<f64>,
    costs: Vec<f64>,
    samples: usize,
    population: usize,
    share: f64,
    runners: &'a mut [Runner<P>],
    /// True for each evaluator that has failed.
    failed: &'a mut [bool],
}

impl<P: SearchProblem> Case<'_, P> {
    /// Measures all evaluators and adds the measurements to the result.
    fn measure(&mut self, result: &mut Throughput, observe: &mut dyn FnMut() -> ControlFlow<()>) -> ControlFlow<()> {
        // The last index is the control, a second measurement of the baseline.
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

    /// Returns the numbers of rounds and of evaluations per round that an evaluator's budget allows; no rounds if it
    /// does not allow one.
    fn plan(&mut self, result: &mut Throughput, contender: usize) -> (usize, usize) {
        // The time of a smaller population decides whether the complete one is affordable. Times below a round are
        // mostly latency and are not extrapolated.
        let mut size = self.population.min(1000);
        let mut seconds = 0.0;
        let skipped = result.of(contender).any(|m| m.samples == self.samples && m.seconds.is_none());
        while !self.failed[contender] && !skipped {
            // The first evaluation allocates buffers, compiles shaders and computes cells.
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

    /// Returns the mean time of an evaluation of the first `size` candidates \[s\]; `None` if the evaluator fails, which
    /// excludes it from then on.
    fn seconds(&mut self, result: &mut Throughput, contender: usize, size: usize, repeats: usize) -> Option<f64> {
        let (problem, width) = (&self.problem, self.problem.width());
        let values = Candidates::new(&self.values[..width * size], width);
        if self.failed[contender] {
            return None;
        }
        let seconds = self.runners[contender].seconds((problem, values), &mut self.costs[..size], repeats);
        if let Err(error) = &seconds {
            self.failed[contender] = true;
            result.refused.push(format!("{}: {error}", result.contenders[contender].name));
        }
        seconds.ok()
    }

    /// Adds the measurements of all evaluators, with the times by the devices' own clocks.
    fn add(&mut self, result: &mut Throughput, mut times: Vec<Vec<f64>>) {
        let (population, samples) = (self.population, self.samples);
        let again = times.pop().filter(|times| !times.is_empty());
        let again = again.map(|times| Measurement::of(0, population, samples, times));
        for (n, times) in times.into_iter().enumerate() {
            let rounds = times.len();
            let mut measurement = Measurement::of(n, population, samples, times);
            if result.baseline() == Some(n) {
                measurement.again = again.as_ref().and_then(|again| Some((again.seconds?, again.interval)));
            }
            let mut kernel = Vec::new();
            for _ in 0..TIMED.min(rounds).min(if result.contenders[n].driver.is_some() { TIMED } else { 0 }) {
                // The measurement of a device that fails here is kept.
                let values = Candidates::new(&self.values, self.problem.width());
                let timed = self.runners[n].kernel_seconds((&self.problem, values), &mut self.costs);
                kernel.extend(timed.ok().flatten().filter(|[kernel, _]| *kernel > 0.0));
            }
            kernel.sort_by(|a: &[f64; 2], b| a[0].total_cmp(&b[0]));
            measurement.kernel = kernel.get(kernel.len() / 2).copied();
            result.measurements.push(measurement);
        }
    }
}
