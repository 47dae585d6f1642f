//! A population search that the page watches: generation by generation, on the CPU or with sums that the page brings.

use crate::Workbench;
use crate::answer::{answered, described};
use crate::evaluation::{ByPage, Shared, with};
use crate::given::Settings;
use crate::job::Job;
use motorfit::Result;
use motorfit::candidates::Candidates;
use motorfit::device::BatchSearchEvaluator;
use motorfit::evaluate::{Problem, Simd};
use motorfit::identify::search_problem;
use motorfit::motor::Axis;
use motorfit::optimize::{Evaluate, LocalOptimum, Optimizer, SearchSettings};
use serde_json::json;
use std::sync::Arc;
use wasm_bindgen::prelude::wasm_bindgen;

/// A population search on the recordings of a workbench.
#[wasm_bindgen]
pub struct Search {
    problem: Arc<Problem>,
    optimizer: Box<dyn Optimizer>,
    evaluator: BatchSearchEvaluator,
    shared: Shared,
    generations: usize,
    generation: usize,
    evaluations: usize,
}

#[wasm_bindgen]
impl Search {
    /// Begins a search with the method, the population and the generations of the settings, on the CPU or on a device of the page.
    ///
    /// # Errors
    /// Returns an error as JSON if the recordings cannot be read, or the settings do not fit.
    #[wasm_bindgen(constructor)]
    pub fn new(bench: &mut Workbench, settings: &str, on_gpu: bool) -> std::result::Result<Self, String> {
        Self::begin(bench, settings, on_gpu).map_err(|error| described(&error))
    }

    /// Returns the axes with their bounds, the population and the number of samples that are simulated, as JSON.
    #[must_use]
    pub fn facts(&mut self) -> String {
        answered(|| {
            let axis = |axis: &Axis| {
                let (name, unit) = (axis.scope.name(axis.parameter), axis.parameter.unit());
                json!({ "name": name, "text": axis.parameter.name(), "unit": unit, "min": axis.min, "max": axis.max })
            };
            let axes: Vec<_> = self.problem.space().free().iter().map(axis).collect();
            let population = self.optimizer.ask().count();
            Ok(json!({ "axes": axes, "population": population, "samples": self.problem.active() }))
        })
    }

    /// Returns the candidates of this generation, shape `[candidates][axes]`; none if the search has ended.
    #[must_use]
    pub fn candidates(&mut self) -> Vec<f64> {
        if self.generation >= self.generations { Vec::new() } else { self.optimizer.ask().values().to_vec() }
    }

    /// Begins the evaluation of this generation. Returns its job for a device of the page.
    ///
    /// # Errors
    /// Returns an error as JSON if the device cannot serve the problem.
    pub fn begin_generation(&mut self) -> std::result::Result<Option<Job>, String> {
        let candidates = self.optimizer.ask();
        self.evaluator.begin(&[candidates]).map_err(|error| described(&error))?;
        Ok(with(&self.shared, |exchange| exchange.job.take()))
    }

    /// Finishes this generation with the sums of its job, which are empty on the CPU.
    ///
    /// # Errors
    /// Returns an error as JSON if the sums are not those of the job.
    pub fn finish_generation(&mut self, sums: Vec<u8>) -> std::result::Result<(), String> {
        with(&self.shared, |exchange| exchange.sums = Some(sums));
        self.finish().map_err(|error| described(&error))
    }

    /// Returns the lowest cost and its candidate; empty before there is one.
    #[must_use]
    pub fn best(&self) -> Vec<f64> {
        let best = self.optimizer.best();
        best.map(|best| std::iter::once(best.cost).chain(best.values.iter().copied()).collect()).unwrap_or_default()
    }

    /// Returns the number of evaluations.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
    pub fn evaluations(&self) -> f64 {
        self.evaluations as f64
    }
}

impl Search {
    fn begin(bench: &mut Workbench, settings: &str, on_gpu: bool) -> Result<Self> {
        let settings = Settings::of(settings)?;
        let (records, spec) = bench.problem(&settings)?;
        let problem = Arc::new(search_problem(records, &spec)?);
        let (bounds, coordinates) = (problem.space().bounds(), spec.method.coordinates());
        let (population, generations, seed) = (spec.population, spec.generations, spec.seed);
        let setup = SearchSettings { bounds, population, generations, seed, coordinates, ..SearchSettings::default() };
        let shared = Shared::default();
        let evaluator: Box<dyn motorfit::evaluate::Evaluator> =
            if on_gpu { Box::new(ByPage(shared.clone())) } else { Box::new(Simd::alone()) };
        Ok(Self {
            optimizer: spec.method.optimizer(setup)?,
            evaluator: BatchSearchEvaluator::new(evaluator, vec![problem.clone()]),
            problem,
            shared,
            generations,
            generation: 0,
            evaluations: 0,
        })
    }

    fn finish(&mut self) -> Result<()> {
        let candidates: Candidates<'_> = self.optimizer.ask();
        let mut costs = vec![0.0; candidates.count()];
        self.evaluator.finish(&[candidates], &mut costs)?;
        self.optimizer.tell(&costs);
        self.generation += 1;
        self.evaluations += costs.len();
        let ends: Option<Vec<LocalOptimum>> = self.optimizer.local_searches().map(|local| {
            let from = |row| {
                let start = local.starts.row(row);
                let own = || {
                    self.evaluator.local_search().map(|local_search| local_search.descend(0, start, local.evaluations))
                };
                own().unwrap_or_else(|| LocalOptimum { values: start.to_vec(), cost: f64::INFINITY, evaluations: 0 })
            };
            (0..local.starts.count()).map(from).collect()
        });
        if let Some(ends) = ends {
            self.optimizer.arrive(&ends);
        }
        Ok(())
    }
}
