//! A run of a search and its progress.

use crate::candidates::Candidates;
use crate::named::named;

/// The best candidate evaluated.
#[derive(Debug, Clone, Copy)]
pub struct Best<'a> {
    /// Values of the candidate, one for each axis.
    pub values: &'a [f64],
    /// Cost of the candidate.
    pub cost: f64,
}

/// A population search with the ask/tell interface.
pub trait Optimizer: Send {
    /// Returns the candidates to be evaluated next; the same ones until `tell`. They may have cutoffs.
    fn ask(&mut self) -> Candidates<'_>;

    /// Takes the costs of the candidates of the last `ask`, in their order; +∞ for one whose evaluation failed. NaN and −∞
    /// count as +∞.
    fn tell(&mut self, costs: &[f64]);

    /// Returns the best candidate evaluated; `None` before the first `tell` and while every cost was +∞.
    fn best(&self) -> Option<Best<'_>>;
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

    /// Returns the lowest cost found; +∞ before there is one.
    #[must_use]
    pub fn cost(&self) -> f64 {
        self.optimizer.best().map_or(f64::INFINITY, |best| best.cost)
    }
}
