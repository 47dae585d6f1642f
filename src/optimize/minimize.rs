//! The one loop that drives searches: ask, evaluate, tell, any number of runs in lock step.

use super::Optimizer;
use crate::Result;
use crate::candidates::Candidates;
use std::ops::ControlFlow;

/// Why a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stop {
    /// All generations were evaluated.
    BudgetSpent,
    /// The observer ended it.
    Interrupted,
}

impl Stop {
    /// Its name in results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::BudgetSpent => "budget_spent",
            Self::Interrupted => "interrupted",
        }
    }
}

/// What an observer sees after each generation.
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

/// Evaluates the populations of all runs and writes their costs, run after run.
pub type Evaluate<'a> = dyn FnMut(&[Candidates<'_>], &mut [f64]) -> Result<()> + 'a;

/// Sees every finished generation and may end the search.
pub type Observe<'a> = dyn FnMut(&Progress) -> ControlFlow<()> + 'a;

/// Takes all runs through `generations` generations.
///
/// Where `observe` ends the search, the best so far is kept.
///
/// # Errors
/// What `evaluate` returns.
pub fn minimize(
    runs: &mut [Run],
    generations: usize,
    evaluate: &mut Evaluate<'_>,
    observe: &mut Observe<'_>,
) -> Result<Stop> {
    let mut costs = Vec::new();
    for generation in 1..=generations {
        let populations: Vec<Candidates<'_>> = runs.iter_mut().map(|run| run.optimizer.ask()).collect();
        let counts: Vec<usize> = populations.iter().map(Candidates::count).collect();
        costs.resize(counts.iter().sum(), f64::INFINITY);
        evaluate(&populations, &mut costs)?;
        let mut rest = costs.as_slice();
        for (run, count) in runs.iter_mut().zip(counts) {
            let (own, others) = rest.split_at(count);
            run.optimizer.tell(own);
            run.evaluations += count as u64;
            run.history.push(run.cost());
            rest = others;
        }
        let evaluations = runs.iter().map(|run| run.evaluations).sum();
        let cost = runs.iter().map(Run::cost).fold(f64::INFINITY, f64::min);
        if observe(&Progress { generation, generations, evaluations, cost }).is_break() {
            return Ok(Stop::Interrupted);
        }
    }
    Ok(Stop::BudgetSpent)
}
