//! Evaluation of a sample of candidates, to compare the rates of CPU and device in a page.

use crate::Workbench;
use crate::answer::described;
use crate::evaluation::{ByPage, Shared, with};
use crate::given::Settings;
use crate::job::Job;
use motorfit::Result;
use motorfit::candidates::Candidates;
use motorfit::evaluate::gpu::Submission;
use motorfit::evaluate::{Batch, Evaluator, Group, Pending, Problem, Simd};
use motorfit::identify::search_problem;
use motorfit::optimize::{Sample, Sampling};
use std::sync::Arc;
use wasm_bindgen::prelude::wasm_bindgen;

/// A Latin hypercube of candidates within the bounds, part by part.
#[wasm_bindgen]
pub struct Rates {
    problem: Arc<Problem>,
    sample: Sample,
    /// The candidates of this part, and how its evaluation was begun.
    values: Vec<f64>,
    pending: Option<Pending>,
    evaluator: ByPage,
    shared: Shared,
}

#[wasm_bindgen]
impl Rates {
    /// Draws a sample of `count` candidates.
    ///
    /// # Errors
    /// Returns an error as JSON if the recordings cannot be read, or the settings do not fit.
    #[wasm_bindgen(constructor)]
    pub fn new(bench: &mut Workbench, settings: &str, count: u32) -> std::result::Result<Self, String> {
        Self::of(bench, settings, count).map_err(|error| described(&error))
    }

    /// Takes the candidates `first..first + count` as the next part.
    pub fn take(&mut self, first: u32, count: u32) {
        let free = self.problem.space().free().len();
        self.values = vec![0.0; free * count as usize];
        self.sample.fill(first.into(), &mut self.values);
    }

    /// Returns the largest number of candidates of a part that a device takes.
    #[must_use]
    pub fn most_on_device(&self) -> u32 {
        u32::try_from(Submission::candidates_max(&self.problem)).unwrap_or(u32::MAX)
    }

    /// Returns the number of candidate-steps of a candidate.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
    pub fn steps(&self) -> f64 {
        self.problem.active() as f64
    }

    /// Returns the costs of this part, evaluated on the CPU by one thread.
    ///
    /// # Errors
    /// Returns an error as JSON if the problem cannot be evaluated.
    pub fn on_cpu(&mut self) -> std::result::Result<Vec<f64>, String> {
        let mut costs = vec![0.0; self.candidates().count()];
        let done = Simd::alone().evaluate(&Batch { groups: &[self.group()] }, &mut costs);
        done.map(|()| costs).map_err(|error| described(&error))
    }

    /// Returns the job of this part for a device of the page.
    ///
    /// # Errors
    /// Returns an error as JSON if a device cannot serve the problem.
    pub fn job(&mut self) -> std::result::Result<Option<Job>, String> {
        let (problem, values) = (self.problem.clone(), std::mem::take(&mut self.values));
        let candidates = Candidates::new(&values, problem.space().free().len());
        let begun =
            self.evaluator.begin(&Batch { groups: &[Group { problem: &problem, candidates, reference: None }] });
        self.values = values;
        self.pending = Some(begun.map_err(|error| described(&error))?);
        Ok(with(&self.shared, |exchange| exchange.job.take()))
    }

    /// Returns the costs of this part from the sums of its job.
    ///
    /// # Errors
    /// Returns an error as JSON if the sums are not those of the job.
    pub fn costs(&mut self, sums: Vec<u8>) -> std::result::Result<Vec<f64>, String> {
        with(&self.shared, |exchange| exchange.sums = Some(sums));
        let (problem, values) = (self.problem.clone(), std::mem::take(&mut self.values));
        let candidates = Candidates::new(&values, problem.space().free().len());
        let mut costs = vec![0.0; candidates.count()];
        let pending = self.pending.take().unwrap_or_default();
        let batch = [Group { problem: &problem, candidates, reference: None }];
        let done = self.evaluator.finish(&Batch { groups: &batch }, pending, &mut costs);
        self.values = values;
        done.map(|()| costs).map_err(|error| described(&error))
    }
}

impl Rates {
    fn of(bench: &mut Workbench, settings: &str, count: u32) -> Result<Self> {
        let settings = Settings::of(settings)?;
        let (records, spec) = bench.problem(&settings)?;
        let problem = Arc::new(search_problem(records, &spec)?);
        let sample = Sample::new(Sampling::LatinHypercube, count.into(), problem.space().bounds(), spec.seed)?;
        let shared = Shared::default();
        let evaluator = ByPage(shared.clone());
        Ok(Self { problem, sample, values: Vec::new(), pending: None, evaluator, shared })
    }

    fn candidates(&self) -> Candidates<'_> {
        Candidates::new(&self.values, self.problem.space().free().len())
    }

    fn group(&self) -> Group<'_> {
        Group { problem: &self.problem, candidates: self.candidates(), reference: None }
    }
}
