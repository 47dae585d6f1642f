//! The command `evaluate`: costs of candidates from a file or a sample, streamed in batches.

use super::args::EvaluateArgs;
use super::candidates::{self, Sampled, Source, sampling};
use super::output::is_read;
use super::prelude::*;
use motorfit::candidates::Candidates;
use motorfit::device::DeviceUsed;
use motorfit::identify::BatchCosts;
use motorfit::numeric::count_u64;
use motorfit::optimize::{Progress, Sample, Sampling};
use motorfit::record::Record;
use motorfit::report::EvaluateDocument;
use motorfit::warning::Warning;
use serde_json::Value;
use std::time::{Duration, Instant};

/// Largest number of candidate-steps in one batch: some hundredths of a second, so that progress and Ctrl-C are prompt.
const BATCH_STEPS: usize = 100_000_000;
/// Largest number of candidates in one batch, which bounds memory.
const BATCH_MAX: usize = 1 << 17;

pub(super) fn run(args: &EvaluateArgs, style: &Style) -> Result<Outcome> {
    if let Some(model) = &args.model.model {
        return super::model::evaluate::run(args, model, style);
    }
    if let Some(slice) = &args.slice {
        return super::slice::run(args, slice, style);
    }
    if args.profile {
        return super::profile::run(args, style);
    }
    let mut spec = inputs::spec(&args.problem, &args.device, style)?;
    let sampled = sample(args)?;
    let records = inputs::records(&args.recordings.records, &args.recordings.reading.0.and(&args.problem.0))?;
    // The choice of a device depends on the numbers of candidates per batch and in total. For a file the total is a guess.
    let axes = u32::try_from(spec.space.free().len()).unwrap_or(u32::MAX);
    let expected = match sampled {
        None => 1 << 20,
        Some((Sampling::Grid, number)) => number.saturating_pow(axes),
        Some((_, number)) => number,
    };
    let expected = usize::try_from(expected).unwrap_or(usize::MAX);
    spec.population = expected.min(BATCH_MAX);
    spec.generations = expected.div_ceil(spec.population);
    // Costs of given candidates do not depend on their number.
    let spec = if sampled.is_none() { spec.by_kernel() } else { spec };
    with_threads(spec.threads, || {
        let costs = BatchCosts::new(&records, &spec)?;
        let bounds = || costs.problem().space().bounds();
        let sampled =
            sampled.map(|(sampling, number)| Sample::new(sampling, number, bounds(), args.seed)).transpose()?;
        let source = sampled.map(|sample| Box::new(Sampled(sample, 0)) as Box<dyn Source>);
        evaluate(args, &records, Box::new(costs), source, style)
    })
}

/// Returns the kind and the number of a sample.
pub(super) fn sample(args: &EvaluateArgs) -> Result<Option<(Sampling, u64)>> {
    if args.top == Some(0) {
        return Err(Error::usage("--top is 0", "Give the number of best candidates to print."));
    }
    args.sample.as_deref().map(sampling).transpose()
}

/// Evaluates the candidates of a sample, or of a file.
pub(super) fn evaluate(
    args: &EvaluateArgs,
    records: &[Record],
    costs: Box<dyn Costs>,
    sampled: Option<Box<dyn Source>>,
    style: &Style,
) -> Result<Outcome> {
    style.warnings(costs.warnings());
    let names = costs.names();
    let source = match sampled {
        Some(sampled) => sampled,
        None => candidates::file(args.candidates.as_deref().unwrap_or(Path::new("-")), &names)?,
    };
    Evaluation { args, style, names, costs, source }.run(records)
}

/// Costs of candidates of a motor, or of a model.
pub(super) trait Costs {
    /// Returns the names of the free parameters.
    fn names(&self) -> Vec<String>;

    /// Returns the work of a candidate by which batches are sized, in steps of the kernel on the CPU.
    fn steps(&self) -> usize;

    /// Submits candidates; a device may compute their costs until they are asked for.
    fn begin(&mut self, values: &[f64]) -> Result<()>;

    /// Returns the costs of the oldest candidates that were submitted.
    fn finish(&mut self, values: &[f64], costs: &mut [f64]) -> Result<()>;

    /// Returns the device.
    fn device(&self) -> DeviceUsed;

    fn warnings(&self) -> &[Warning];

    /// Returns the JSON document with the best candidates.
    fn document(&self, document: &EvaluateDocument, records: &[Record], best: &[(f64, &[f64])]) -> Value;
}

impl Costs for BatchCosts {
    fn names(&self) -> Vec<String> {
        self.problem().space().free().iter().map(|axis| axis.scope.name(axis.parameter)).collect()
    }

    fn steps(&self) -> usize {
        Self::steps(self)
    }

    fn begin(&mut self, values: &[f64]) -> Result<()> {
        Self::begin(self, values)
    }

    fn finish(&mut self, values: &[f64], costs: &mut [f64]) -> Result<()> {
        Self::finish(self, values, costs)
    }

    fn device(&self) -> DeviceUsed {
        Self::device(self)
    }

    fn warnings(&self) -> &[Warning] {
        Self::warnings(self)
    }

    fn document(&self, document: &EvaluateDocument, records: &[Record], best: &[(f64, &[f64])]) -> Value {
        document.of(records, self, best.iter().copied())
    }
}

fn batch(samples: usize) -> usize {
    (BATCH_STEPS / samples.max(1)).clamp(1, BATCH_MAX)
}

/// One of the best candidates: its cost, its number, which breaks ties, and its values.
type Kept = (f64, u64, Vec<f64>);

struct Evaluation<'a> {
    args: &'a EvaluateArgs,
    style: &'a Style,
    names: Vec<String>,
    costs: Box<dyn Costs>,
    source: Box<dyn Source>,
}

impl Evaluation<'_> {
    fn run(mut self, records: &[Record]) -> Result<Outcome> {
        let width = self.names.len();
        let known = self.costs.warnings().len();
        let top = self.args.top.or(self.args.json.then_some(10));
        // The next batch is read while a GPU evaluates the current one.
        let (mut values, mut next, mut costs) = (Vec::new(), Vec::new(), Vec::new());
        let mut best = Vec::new();
        let (mut done, mut lowest, mut busy) = (0_u64, f64::INFINITY, Duration::ZERO);
        let started = Instant::now();
        let mut observe = progress::reporter(self.style, "batch");
        let count = self.source.count();
        let mut interrupted = false;
        let mut most = batch(self.costs.steps());
        self.source.next(most, width, &mut values)?;
        if top.is_none() {
            signals::remark("interrupted: the output has only the candidates evaluated so far");
            data(&format!("{},cost\n", self.names.join(",")))?;
        }
        self.costs.begin(&values)?;
        while !interrupted && !values.is_empty() && is_read() {
            next.clear();
            // A CPU that replaces a failed GPU gets smaller batches.
            most = batch(self.costs.steps());
            self.source.next(most, width, &mut next)?;
            costs.resize(values.len() / width, 0.0);
            let begun = Instant::now();
            self.costs.begin(&next)?;
            self.costs.finish(&values, &mut costs)?;
            busy += begun.elapsed();
            match top {
                Some(top) => keep(&mut best, top, done, Candidates::new(&values, width), &costs),
                None => data(&rows(Candidates::new(&values, width), &costs))?,
            }
            lowest = costs.iter().copied().fold(lowest, f64::min);
            done += costs.len() as u64;
            if let Some(count) = count {
                let batches = |candidates: u64| usize::try_from(candidates.div_ceil(most as u64)).unwrap_or(usize::MAX);
                let [generation, generations] = [done, count].map(batches);
                observe(&Progress { generation, generations, evaluations: done, cost: lowest });
            }
            // Sampling cannot block, unlike reading stdin, so that the next check for a signal comes soon.
            signals::searching(self.args.sample.is_some());
            interrupted = signals::is_interrupted();
            std::mem::swap(&mut values, &mut next);
        }
        drop(observe);
        self.style.warnings(&self.costs.warnings()[known..]);
        if interrupted {
            self.style.note("interrupted: the output has only the candidates evaluated so far");
        }
        if done == 0 {
            return Err(Error::data("there are no candidates", "Give a file with at least one row below its heading."));
        }
        let device = self.costs.device();
        let seconds = started.elapsed().as_secs_f64();
        let rate = significant(count_u64(done) / seconds, 3);
        let [whole, busy] = [seconds, busy.as_secs_f64()].map(|seconds| engineering(seconds, "s", 3));
        self.style.note(&format!(
            "{done} candidates in {whole} (evaluation {busy}), {rate} per second, on {device}; lowest cost {}",
            significant(lowest, 6)
        ));
        shorten(&mut best, top.unwrap_or(0));
        if self.args.json {
            let best: Vec<(f64, &[f64])> = best.iter().map(|(cost, _, values)| (*cost, values.as_slice())).collect();
            let document = EvaluateDocument { interrupted, candidates: done, seconds };
            data(&json(&self.costs.document(&document, records, &best)))?;
        } else if top.is_some() {
            let table: Vec<f64> = best.iter().flat_map(|(_, _, values)| values.iter().copied()).collect();
            let costs: Vec<f64> = best.iter().map(|(cost, ..)| *cost).collect();
            let head = format!("{},cost\n", self.names.join(","));
            data(&(head + &rows(Candidates::new(&table, width), &costs)))?;
        }
        Ok(if interrupted { Outcome::Interrupted } else { Outcome::Done })
    }
}

/// Adds candidates that may be among the `top` best. The first `top` entries are sorted, later ones are not.
fn keep(best: &mut Vec<Kept>, top: usize, first: u64, candidates: Candidates<'_>, costs: &[f64]) {
    for (row, &cost) in costs.iter().enumerate() {
        if best.get(top - 1).is_none_or(|worst| cost < worst.0) {
            best.push((cost, first + row as u64, candidates.row(row).to_vec()));
            if best.len() == top || best.len() >= top.saturating_mul(2) {
                shorten(best, top);
            }
        }
    }
}

/// Keeps the `top` entries of lowest cost, sorted.
fn shorten(best: &mut Vec<Kept>, top: usize) {
    best.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    best.truncate(top);
}

/// Returns lines of CSV with the shortest decimals that parse to the same numbers.
fn rows(candidates: Candidates<'_>, costs: &[f64]) -> String {
    let mut text = String::with_capacity(costs.len() * (candidates.width() + 1) * 20);
    for (row, cost) in costs.iter().enumerate() {
        for value in candidates.row(row) {
            let _ = write!(text, "{},", Shortest(*value));
        }
        let _ = writeln!(text, "{}", Shortest(*cost));
    }
    text
}
