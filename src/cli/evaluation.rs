//! Costs of candidates from a file or a sample, streamed in batches, for a motor or a model.

use super::args::EvaluateArgs;
use super::candidates::{self, Sampled, Source, sampling};
use super::output::is_read;
use super::prelude::*;
use motorfit::candidates::Candidates;
use motorfit::identify::BatchCosts;
use motorfit::numeric::count_u64;
use motorfit::optimize::{Progress, Sampling};
use motorfit::record::Record;
use motorfit::report::EvaluateDocument;
use std::time::{Duration, Instant};

/// Largest number of candidate-steps in one batch: some hundredths of a second, so that progress and Ctrl-C are prompt.
const BATCH_STEPS: usize = 100_000_000;
/// Largest number of candidates in one batch, which bounds memory.
pub(super) const BATCH_MAX: usize = 1 << 17;

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
    costs: BatchCosts,
    sampled: Option<(Sampling, u64)>,
    style: &Style,
) -> Result<Outcome> {
    style.warnings(costs.warnings());
    let names = costs.problem().names();
    let source: Box<dyn Source> = match sampled {
        Some((sampling, number)) => Box::new(Sampled::new(sampling, number, costs.problem().axes(), args.seed)?),
        None => candidates::file(args.candidates.as_deref().unwrap_or(Path::new("-")), &names)?,
    };
    let top = args.top.or(args.json.then_some(10));
    Evaluation { args, style, names, costs, source, top }.run(records)
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
    costs: BatchCosts,
    source: Box<dyn Source>,
    /// Number of best candidates that are printed in place of all.
    top: Option<usize>,
}

/// Number, lowest cost and best of the candidates that are evaluated.
struct Evaluated {
    count: u64,
    lowest: f64,
    /// Candidates that may be printed as the best.
    best: Vec<Kept>,
    /// Time of the evaluation itself.
    busy: Duration,
    is_interrupted: bool,
}

impl Evaluation<'_> {
    fn run(mut self, records: &[Record]) -> Result<Outcome> {
        let known = self.costs.warnings().len();
        let started = Instant::now();
        let mut evaluated = self.evaluated()?;
        self.style.warnings(&self.costs.warnings()[known..]);
        if evaluated.is_interrupted {
            self.style.note("interrupted: the output has only the candidates evaluated so far");
        }
        if evaluated.count == 0 {
            return Err(Error::data("there are no candidates", "Give a file with at least one row below its heading."));
        }
        let seconds = started.elapsed().as_secs_f64();
        self.style.note(&self.summary(&evaluated, seconds));
        shorten(&mut evaluated.best, self.top.unwrap_or(0));
        self.show_best(records, &evaluated, seconds)?;
        Ok(if evaluated.is_interrupted { Outcome::Interrupted } else { Outcome::Done })
    }

    /// Evaluates the candidates batch by batch; prints each batch unless only the best are shown.
    fn evaluated(&mut self) -> Result<Evaluated> {
        let width = self.names.len();
        // The next batch is read while a GPU evaluates the current one.
        let (mut values, mut next, mut costs) = (Vec::new(), Vec::new(), Vec::new());
        let mut so_far = Evaluated {
            count: 0,
            lowest: f64::INFINITY,
            best: Vec::new(),
            busy: Duration::ZERO,
            is_interrupted: false,
        };
        let mut observe = progress::reporter(self.style, "batch");
        let count = self.source.count();
        let mut most = batch(self.costs.steps());
        self.source.next(most, width, &mut values)?;
        if self.top.is_none() {
            signals::remark("interrupted: the output has only the candidates evaluated so far");
            data(&self.heading())?;
        }
        self.costs.begin(&values)?;
        while !so_far.is_interrupted && !values.is_empty() && is_read() {
            next.clear();
            // A CPU that replaces a failed GPU gets smaller batches.
            most = batch(self.costs.steps());
            self.source.next(most, width, &mut next)?;
            costs.resize(values.len() / width, 0.0);
            let begun = Instant::now();
            self.costs.begin(&next)?;
            self.costs.finish(&values, &mut costs)?;
            so_far.busy += begun.elapsed();
            so_far.add(self.top, Candidates::new(&values, width), &costs)?;
            if let Some(count) = count {
                let batches = |candidates: u64| usize::try_from(candidates.div_ceil(most as u64)).unwrap_or(usize::MAX);
                let [generation, generations] = [so_far.count, count].map(batches);
                observe(&Progress { generation, generations, evaluations: so_far.count, cost: so_far.lowest });
            }
            // Sampling cannot block, unlike reading stdin, so that the next check for a signal comes soon.
            signals::searching(self.args.sample.is_some());
            so_far.is_interrupted = signals::is_interrupted();
            std::mem::swap(&mut values, &mut next);
        }
        Ok(so_far)
    }

    fn heading(&self) -> String {
        format!("{},cost\n", self.names.join(","))
    }

    /// Returns the number of candidates, their rate, the device and the lowest cost as text.
    fn summary(&self, evaluated: &Evaluated, seconds: f64) -> String {
        let Evaluated { count, lowest, busy, .. } = evaluated;
        let rate = significant(count_u64(*count) / seconds, 3);
        let [whole, busy] = [seconds, busy.as_secs_f64()].map(|seconds| engineering(seconds, "s", 3));
        let (device, lowest) = (self.costs.device(), significant(*lowest, 6));
        format!(
            "{count} candidates in {whole} (evaluation {busy}), {rate} per second, on {device}; lowest cost {lowest}"
        )
    }

    /// Prints the best candidates, if they are asked for.
    fn show_best(&self, records: &[Record], evaluated: &Evaluated, seconds: f64) -> Result<()> {
        let Evaluated { count: candidates, is_interrupted: interrupted, ref best, .. } = *evaluated;
        if self.args.json {
            let best = best.iter().map(|(cost, _, values)| (*cost, values.as_slice()));
            let document = EvaluateDocument { interrupted, candidates, seconds };
            data(&json(&document.of(records, &self.costs, best)))?;
        } else if self.top.is_some() {
            let table: Vec<f64> = best.iter().flat_map(|(_, _, values)| values.iter().copied()).collect();
            let costs: Vec<f64> = best.iter().map(|(cost, ..)| *cost).collect();
            data(&(self.heading() + &rows(Candidates::new(&table, self.names.len()), &costs)))?;
        }
        Ok(())
    }
}

impl Evaluated {
    /// Adds a batch: keeps those that may be among the `top` best, or prints all.
    fn add(&mut self, top: Option<usize>, candidates: Candidates<'_>, costs: &[f64]) -> Result<()> {
        match top {
            Some(top) => keep(&mut self.best, top, self.count, candidates, costs),
            None => data(&rows(candidates, costs))?,
        }
        self.lowest = costs.iter().copied().fold(self.lowest, f64::min);
        self.count += costs.len() as u64;
        Ok(())
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
