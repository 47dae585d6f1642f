//! The cost function of [`minimize`](motorfit_optimize::minimize): evaluates the populations of many searches as one batch.

use super::problem::{DeviceProblem, Problems};
use super::select::{OnLoss, SLICE_STEPS, SelectedDevice, taken_over};
use super::settings::DeviceSettings;
use super::used::DeviceUsed;
use motorfit_core::candidates::Candidates;
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_evaluate::{Batch, Evaluator, Group, Pending, Problem};
use motorfit_optimize::{Evaluate, LocalSearch};
use motorfit_record::warning::Warning;
use std::collections::VecDeque;
use std::sync::Arc;

/// Smallest number of candidates of lowest cost in f32, the leaders of a search, that are evaluated again in f64.
const LEADERS: usize = 3;

/// The best candidate of each run with its cost: the reference of deviations.
type References = Vec<Option<Arc<(f64, Vec<f64>)>>>;

/// Evaluates the populations of any number of runs as one batch, each run on its own problem.
///
/// If the evaluator is not exact, the reference of each run is its best candidate, and the leaders of each run are evaluated
/// again in f64 until the lowest cost is one in f64. A run therefore does not depend on the others.
pub struct BatchSearchEvaluator<P: DeviceProblem = Problem> {
    opened: SelectedDevice<P>,
    /// The problems that it was opened for.
    given: Vec<Arc<P>>,
    problems: Problems<P>,
    /// Lowest cost of each run, and its candidate.
    references: References,
    /// Batches that were begun, each with the number of evaluators replaced before it and its references.
    pending: VecDeque<((Pending, usize), References)>,
}

impl<P: DeviceProblem> BatchSearchEvaluator<P> {
    /// Creates an instance with an evaluator of the caller. `problems` has one problem for each run, or one for all.
    #[must_use]
    pub fn new(evaluator: Box<dyn Evaluator<P>>, problems: Vec<Arc<P>>) -> Self {
        Self::on(SelectedDevice::given(evaluator), problems)
    }

    /// Opens the device that the settings select. `problems` has one problem for each run, or one for all.
    ///
    /// # Errors
    /// Returns a device error if the requested device is not available, and a usage error without problems.
    pub fn open(settings: impl Into<DeviceSettings>, problems: Vec<Arc<P>>) -> Result<Self> {
        Ok(Self::on(SelectedDevice::for_search(&settings.into(), &problems)?, problems))
    }

    /// Opens the requested device, or the CPU for `auto`: for a computation without a population.
    ///
    /// # Errors
    /// Returns a device error if the requested device is not available.
    pub(crate) fn for_check(settings: impl Into<DeviceSettings>, problem: Arc<P>) -> Result<Self> {
        Ok(Self::on(SelectedDevice::for_check(&settings.into(), &problem)?, vec![problem]))
    }

    /// Sets the treatment of a device that fails.
    #[must_use]
    pub fn on_loss(mut self, on_loss: OnLoss) -> Self {
        self.opened.on_loss = on_loss;
        self
    }

    /// Replaces the problems: later populations are those of other runs on the same device.
    pub fn set_problems(&mut self, problems: Vec<Arc<P>>) {
        self.problems = Problems(problems);
        self.references.clear();
        self.pending.clear();
    }

    /// Returns the number of candidates between two calls of the observer.
    #[must_use]
    pub fn slice(&self) -> usize {
        let longest = self.problems.0.iter().map(|problem| self.opened.steps(problem)).max().unwrap_or(1);
        (SLICE_STEPS / longest.max(1)).max(1).next_multiple_of(P::BLOCK)
    }

    /// Returns the description of the device.
    #[must_use]
    pub fn device(&self) -> DeviceUsed {
        self.opened.used(&self.problems.0)
    }

    /// Returns the work of a candidate of a problem by which batches are sized, in steps of the kernel on the CPU.
    pub(crate) fn steps(&self, problem: &P) -> usize {
        self.opened.steps(problem).max(1)
    }

    /// Returns the problems that it was opened for.
    pub(super) fn given(&self) -> &[Arc<P>] {
        &self.given
    }

    /// Returns the evaluator of the device.
    pub(crate) fn evaluator(&mut self) -> &mut dyn Evaluator<P> {
        self.opened.evaluator.as_mut()
    }

    /// Returns warnings about the device.
    #[must_use]
    pub fn warnings(&self) -> &[Warning] {
        &self.opened.warnings
    }

    /// Adds a warning that this device replaces one that failed with `error`.
    #[must_use]
    pub fn replacing_failed(mut self, error: &motorfit_core::Error) -> Self {
        self.opened.warnings.push(taken_over(error));
        self
    }

    fn on(opened: SelectedDevice<P>, problems: Vec<Arc<P>>) -> Self {
        Self {
            opened,
            given: problems.clone(),
            problems: Problems(problems),
            references: Vec::new(),
            pending: VecDeque::new(),
        }
    }

    /// Removes and returns the warnings about the device.
    pub fn take_warnings(&mut self) -> Vec<Warning> {
        std::mem::take(&mut self.opened.warnings)
    }

    /// Returns the problem of a run.
    fn problem(&self, run: usize) -> &Arc<P> {
        self.problems.of(run)
    }

    fn groups<'a>(&'a self, populations: &[Candidates<'a>], references: &'a References) -> Vec<Group<'a, P>> {
        let group = |(run, &candidates): (usize, &Candidates<'a>)| {
            let reference = references.get(run).and_then(Option::as_ref).map(|best| best.1.as_slice());
            (candidates.count() > 0).then(|| Group { problem: self.problem(run), candidates, reference })
        };
        populations.iter().enumerate().filter_map(group).collect()
    }

    /// Runs `work` with the evaluator. If that fails and the evaluator may be replaced, runs it again with the new one.
    fn with_evaluator<T>(
        &mut self,
        populations: &[Candidates<'_>],
        references: &References,
        mut work: impl FnMut(&mut SelectedDevice<P>, &Batch<'_, P>) -> Result<T>,
    ) -> Result<T> {
        let (runs, problems) = (populations.len(), self.problems.0.len());
        if runs > problems && problems != 1 {
            let message = format!("found populations of {runs} runs, expected at most {problems}");
            return Err(Error::usage(message, "Give a problem for each run, or one for all."));
        }
        // The device is moved out, because the groups borrow the problems of `self`.
        let mut opened = std::mem::replace(&mut self.opened, SelectedDevice::cpu(Vec::new()));
        let groups = self.groups(populations, references);
        let batch = Batch { groups: &groups };
        let mut failures = 0;
        let done = loop {
            match work(&mut opened, &batch) {
                Err(error) if opened.replace(&error, failures) => failures += 1,
                done => break done,
            }
        };
        drop(groups);
        self.opened = opened;
        done
    }

    /// Replaces the lowest costs of a run by those of the scalar evaluator until the lowest cost is one of them.
    fn check_leaders(&mut self, run: usize, population: Candidates<'_>, costs: &mut [f64]) {
        let problem = self.problem(run).clone();
        let mut order: Vec<usize> = (0..costs.len()).collect();
        order.sort_by(|a, b| costs[*a].total_cmp(&costs[*b]));
        let mut lowest = f64::INFINITY;
        for (place, row) in order.into_iter().enumerate() {
            if place >= LEADERS && costs[row] >= lowest {
                break;
            }
            costs[row] = problem.cost_of(population.row(row));
            lowest = lowest.min(costs[row]);
            if costs[row] < self.references[run].as_ref().map_or(f64::INFINITY, |best| best.0) {
                self.references[run] = Some(Arc::new((costs[row], population.row(row).to_vec())));
            }
        }
    }

    /// Returns the device's cost of a candidate minus that of the scalar evaluator, or `None` on the CPU and if the device
    /// fails. The reference of deviations is a candidate 2 % away, since at the candidate itself they are zero.
    pub(crate) fn cost_difference(&mut self, run: usize, values: &[f64]) -> Option<f64> {
        if self.opened.kind == "cpu" {
            return None;
        }
        let reference: Vec<f64> = values.iter().map(|v| 1.02 * v).collect();
        let problem = self.problem(run).clone();
        let candidates = Candidates::new(values, values.len());
        let groups = [Group { problem: &problem, candidates, reference: Some(&reference) }];
        let mut cost = [0.0];
        match self.opened.evaluator.evaluate(&Batch { groups: &groups }, &mut cost) {
            Ok(()) => Some(cost[0] - problem.cost_of(values)),
            Err(error) => {
                let message = text!({error.text()} "; the result is not affected, it was computed on the CPU");
                self.opened.warnings.push(Warning::new("gpu_failed", message));
                None
            }
        }
    }
}

impl<P: DeviceProblem> Evaluate for BatchSearchEvaluator<P> {
    fn begin(&mut self, populations: &[Candidates<'_>]) -> Result<()> {
        let references = self.references.clone();
        let begin = |opened: &mut SelectedDevice<P>, batch: &Batch<'_, P>| {
            Ok((opened.evaluator.begin(batch)?, opened.replaced))
        };
        let pending = self.with_evaluator(populations, &references, begin)?;
        self.pending.push_back((pending, references));
        Ok(())
    }

    fn finish(&mut self, populations: &[Candidates<'_>], costs: &mut [f64]) -> Result<()> {
        let (pending, references) = self.pending.pop_front().unwrap_or_default();
        let mut pending = Some(pending);
        self.with_evaluator(populations, &references, |opened, batch| match pending.take() {
            // A batch that a replaced evaluator began is evaluated anew.
            Some((begun, by)) if by == opened.replaced => opened.evaluator.finish(batch, begun, costs),
            _ => opened.evaluator.evaluate(batch, costs),
        })?;
        if !self.opened.evaluator.is_exact() {
            self.references.resize(self.references.len().max(populations.len()), None);
            let mut rest = costs;
            for (run, population) in populations.iter().enumerate() {
                let (own, others) = rest.split_at_mut(population.count());
                self.check_leaders(run, *population, own);
                rest = others;
            }
        }
        Ok(())
    }

    fn overlaps(&self) -> bool {
        self.opened.evaluator.overlaps()
    }

    fn local_search(&self) -> Option<&dyn LocalSearch> {
        P::local_search(&self.problems)
    }
}

#[cfg(test)]
mod tests;
