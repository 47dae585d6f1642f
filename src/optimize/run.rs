//! A run of a search, and what is said of it on the way.

use crate::candidates::Candidates;
use crate::named::named;

/// The best candidate so far.
#[derive(Debug, Clone, Copy)]
pub struct Best<'a> {
    /// Its values, one per axis.
    pub values: &'a [f64],
    /// Its cost.
    pub cost: f64,
}

/// A population search, driven from outside.
pub trait Optimizer: Send {
    /// The candidates to be evaluated next; the same ones until `tell`.
    fn ask(&mut self) -> Candidates<'_>;

    /// Takes the costs of the candidates of the last `ask`, in their order; +∞ for one that failed. A NaN counts
    /// as +∞.
    fn tell(&mut self, costs: &[f64]);

    /// The best so far; `None` before the first `tell` and while every cost was +∞.
    fn best(&self) -> Option<Best<'_>>;
}

named! {
    /// Why a search ended.
    #[non_exhaustive]
    pub enum Stop {
        /// All generations were evaluated.
        BudgetSpent = "budget_spent",
        /// The observer ended it.
        Interrupted = "interrupted",
        /// An iteration came to its end.
        Converged = "converged",
    }
}

/// The state of a search after a generation, for observers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Generations done.
    pub generation: usize,
    /// Generations in all.
    pub generations: usize,
    /// Evaluations so far, over all runs.
    pub evaluations: u64,
    /// Lowest cost so far over all runs; +∞ before there is one.
    pub cost: f64,
}

/// One run of a search.
pub struct Run {
    /// The search.
    pub optimizer: Box<dyn Optimizer>,
    /// Lowest cost after each generation.
    pub history: Vec<f64>,
    /// Candidates evaluated.
    pub evaluations: u64,
}

impl Run {
    /// A run that has not begun.
    #[must_use]
    pub fn new(optimizer: Box<dyn Optimizer>) -> Self {
        Self { optimizer, history: Vec::new(), evaluations: 0 }
    }

    /// Lowest cost so far; +∞ before there is one.
    #[must_use]
    pub fn cost(&self) -> f64 {
        self.optimizer.best().map_or(f64::INFINITY, |best| best.cost)
    }
}
