//! The runs of a comparison: all methods under each setting, the candidates of a generation as one batch.

use super::engine::Engine;
use super::parameter::ComparedParameter;
use super::result::{Block, Outcome};
use super::spec::CompareSpec;
use motorfit_core::clock::Instant;
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_optimize::{Budget, Observe, Progress, Run, SearchSettings, Stop, minimize};
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// A run: the index of its setting, the index of its method in that setting, and its number.
struct Entry {
    indices: [usize; 2],
    run: u64,
}

/// A comparison in progress.
pub(super) struct ComparisonRun<'a> {
    pub spec: &'a CompareSpec,
    pub engine: &'a mut Engine,
    /// Number of candidates evaluated.
    pub evaluations: u64,
    /// Time of all batches of runs \[s\].
    pub batch_seconds: f64,
    /// The last progress.
    pub last: Progress,
}

impl<'a> ComparisonRun<'a> {
    pub(super) fn new(spec: &'a CompareSpec, engine: &'a mut Engine) -> Self {
        let last = Progress { generation: 0, generations: 0, evaluations: 0, cost: f64::INFINITY };
        Self { spec, engine, evaluations: 0, batch_seconds: 0.0, last }
    }

    /// Executes all runs and measures the time of single ones; returns true if the observer ended them.
    pub(super) fn all(&mut self, blocks: &mut [Block], observe: &mut Observe<'_>) -> Result<bool> {
        let mut batches: BTreeMap<usize, Vec<Entry>> = BTreeMap::new();
        for (s, setting) in self.spec.settings.iter().enumerate() {
            let runs = |m| (0..self.spec.runs as u64).map(move |run| Entry { indices: [s, m], run });
            batches.entry(setting.generations).or_default().extend((0..setting.methods.len()).flat_map(runs));
        }
        for (generations, entries) in batches {
            let begun = Instant::now();
            let before = self.evaluations;
            let mut last = self.last;
            let mut watch = |p: &Progress| {
                last = Progress { evaluations: before + p.evaluations, ..*p };
                observe(&last)
            };
            let (runs, stop) = self.batch(generations, &entries, &mut watch)?;
            self.last = last;
            self.batch_seconds += begun.elapsed().as_secs_f64();
            self.evaluations += runs.iter().map(|run| run.evaluations).sum::<u64>();
            for (entry, run) in entries.iter().zip(runs) {
                let [setting, method] = entry.indices;
                blocks[setting].results[method].runs.push(self.outcome(setting, run));
            }
            if stop == Stop::Interrupted {
                return Ok(true);
            }
        }
        let last = self.last;
        Ok(self.alone(blocks, &mut || observe(&last))?.is_break())
    }

    /// Executes runs with the same number of generations in lockstep.
    fn batch(&mut self, generations: usize, entries: &[Entry], observe: &mut Observe<'_>) -> Result<(Vec<Run>, Stop)> {
        let bounds = self.engine.bounds();
        let run = |entry: &Entry| {
            let [s, m] = entry.indices;
            let setting = &self.spec.settings[s];
            let (bounds, population, coordinates) = (bounds.clone(), setting.population, setting.coordinates);
            let (seed, run) = (self.spec.seed, entry.run);
            let setup = SearchSettings { bounds, population, generations, seed, run, coordinates };
            Ok((setting.methods[m].name(), Run::new(setting.methods[m].optimizer(setup)?)))
        };
        let (names, mut runs): (Vec<&str>, Vec<Run>) =
            entries.iter().map(run).collect::<Result<Vec<_>>>()?.into_iter().unzip();
        self.engine.searches.set_runs(&entries.iter().map(|entry| entry.indices[0]).collect::<Vec<_>>());
        let budget = Budget { generations, slice: self.engine.searches.slice() };
        let evaluator = self.engine.searches.as_mut();
        if evaluator.local_search().is_none()
            && let Some(at) = runs.iter().position(|run| run.optimizer.needs_local_search())
        {
            let message =
                text!([Methods](": {} descends by local searches, which only the linear DC motor has here", names[at]));
            let hint = "Choose population searches; the refined estimate of a model comes from a multistart.";
            return Err(Error::usage(message, hint));
        }
        let stop = minimize(&mut runs, budget, evaluator, observe)?;
        Ok((runs, stop))
    }

    /// Measures the time of a single run of each method \[s\]: the median of three.
    fn alone(&mut self, blocks: &mut [Block], observe: &mut dyn FnMut() -> ControlFlow<()>) -> Result<ControlFlow<()>> {
        for (s, block) in blocks.iter_mut().enumerate() {
            for (m, result) in block.results.iter_mut().enumerate() {
                let mut seconds = Vec::new();
                for run in 0..3 {
                    let entry = [Entry { indices: [s, m], run }];
                    let begun = Instant::now();
                    let (_, stop) = self.batch(block.setting.generations, &entry, &mut |_| observe())?;
                    if stop == Stop::Interrupted {
                        return Ok(ControlFlow::Break(()));
                    }
                    seconds.push(begun.elapsed().as_secs_f64());
                }
                seconds.sort_by(f64::total_cmp);
                result.seconds = seconds.get(1).copied();
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    /// Returns the best candidate of a run with its cost on the CPU.
    fn outcome(&self, setting: usize, run: Run) -> Outcome {
        let parameters = &self.engine.parameters;
        let best = run.optimizer.best().map(|best| best.values);
        let best = best
            .map(|candidate| (ComparedParameter::values(parameters, candidate), self.engine.cost(setting, candidate)));
        let best = best.filter(|(_, cost)| cost.is_finite());
        let (parameters, cost) = best.map_or((None, f64::INFINITY), |(values, cost)| (Some(values), cost));
        Outcome { parameters, cost, history: run.history, evaluations: run.evaluations }
    }
}
