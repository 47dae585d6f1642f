//! A run of a search and its progress.

use motorfit_core::candidates::Candidates;
use motorfit_core::named::named;
use rayon::prelude::*;

/// The best candidate evaluated.
#[derive(Debug, Clone, Copy)]
pub struct Best<'a> {
    /// Values of the candidate, one for each axis.
    pub values: &'a [f64],
    /// Cost of the candidate.
    pub cost: f64,
}

/// Local searches that a search requests.
#[derive(Debug, Clone, Copy)]
pub struct LocalSearches<'a> {
    /// Their starts.
    pub starts: Candidates<'a>,
    /// Largest number of evaluations of each.
    pub evaluations: u64,
}

/// End of a local search.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalOptimum {
    /// Values of the candidate, one for each axis.
    pub values: Vec<f64>,
    /// Cost of the candidate; +∞ if the local search failed.
    pub cost: f64,
    /// Number of evaluations that the search took.
    pub evaluations: u64,
}

/// A local search on the cost function of each run, such as Levenberg–Marquardt on its residuals.
pub trait LocalSearch: Sync {
    /// Descends from `start` on the cost function of the run of index `run` with at most `evaluations` evaluations. An evaluation
    /// with derivatives counts as one more for each of them.
    fn descend(&self, run: usize, start: &[f64], evaluations: u64) -> LocalOptimum;
}

/// A population search with the ask/tell interface.
pub trait Optimizer: Send {
    /// Returns the candidates to be evaluated next; the same ones until `tell`. They may have cutoffs. There are none once the
    /// evaluations of [`Self::evaluations_max`] are spent, and while local searches are to be run.
    fn ask(&mut self) -> Candidates<'_>;

    /// Takes the costs of the candidates of the last `ask`, in their order; +∞ for one whose evaluation failed. NaN and −∞
    /// count as +∞. Costs that were told before are ignored.
    fn tell(&mut self, costs: &[f64]);

    /// Returns the best candidate evaluated; `None` before the first `tell` and while every cost was +∞.
    fn best(&self) -> Option<Best<'_>>;

    /// Returns the number of evaluations after which a search has ended whose populations differ in size; `None` if they do not, so
    /// that any number of generations may follow.
    fn evaluations_max(&self) -> Option<u64> {
        None
    }

    /// Returns true if the search requests local searches, which need a cost function with residuals.
    fn needs_local_search(&self) -> bool {
        false
    }

    /// Returns the local searches to run before the next `ask`, the same until [`Self::arrive`]; `None` without any.
    fn local_searches(&mut self) -> Option<LocalSearches<'_>> {
        None
    }

    /// Takes the ends of the local searches, in the order of their starts.
    fn arrive(&mut self, _ends: &[LocalOptimum]) {}
}

named! {
    /// Reason for which a search ended.
    #[non_exhaustive]
    pub enum Stop {
        /// All generations were evaluated.
        BudgetSpent = "budget_spent",
        /// The observer ended it.
        Interrupted = "interrupted",
        /// The iteration converged.
        Converged = "converged",
    }
}

/// Progress of a search after a batch, for observers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Number of completed generations.
    pub generation: usize,
    /// Total number of generations.
    pub generations: usize,
    /// Number of evaluations done, over all runs.
    pub evaluations: u64,
    /// Lowest cost found, over all runs; +∞ before there is one.
    pub cost: f64,
}

/// One run of a search.
pub struct Run {
    /// The search.
    pub optimizer: Box<dyn Optimizer>,
    /// Lowest cost found up to each generation.
    pub history: Vec<f64>,
    /// Number of candidates evaluated.
    pub evaluations: u64,
}

impl Run {
    /// Makes a run that has not started.
    #[must_use]
    pub fn new(optimizer: Box<dyn Optimizer>) -> Self {
        Self { optimizer, history: Vec::new(), evaluations: 0 }
    }

    /// Runs the local searches that the search requests and returns the number of their evaluations.
    pub(super) fn search_locally(&mut self, index: usize, local: &dyn LocalSearch) -> u64 {
        let Some(LocalSearches { starts, evaluations }) = self.optimizer.local_searches() else { return 0 };
        let descend = |row: usize| local.descend(index, starts.row(row), evaluations);
        let ends: Vec<LocalOptimum> = (0..starts.count()).into_par_iter().map(descend).collect();
        self.optimizer.arrive(&ends);
        let evaluations = ends.iter().map(|end| end.evaluations).sum();
        self.evaluations += evaluations;
        evaluations
    }

    /// Returns the number of generations completed, after `before`, and adds them to the history. A search whose populations differ in
    /// size has completed one whenever it has spent the evaluations of one; one that is idle, since it asked for nothing, has ended.
    /// Generations that ended before the last evaluations have the cost that was known then.
    pub(super) fn completed(&mut self, before: usize, known: f64, is_idle: bool, generations: usize) -> usize {
        let completed = match self.optimizer.evaluations_max() {
            None => before + 1,
            Some(_) if is_idle => generations,
            Some(max) => {
                let share = u128::from(self.evaluations) * generations as u128 / u128::from(max.max(1));
                usize::try_from(share).unwrap_or(usize::MAX)
            }
        };
        let completed = completed.clamp(before, generations);
        if completed > before {
            self.history.resize(self.history.len() + completed - before - 1, known);
            self.history.push(self.cost());
        }
        completed
    }

    /// Returns the lowest cost found; +∞ before there is one.
    #[must_use]
    pub fn cost(&self) -> f64 {
        self.optimizer.best().map_or(f64::INFINITY, |best| best.cost)
    }
}
