//! The one loop that drives searches: ask, evaluate, tell, any number of runs in lock step.

use super::Optimizer;
use crate::Result;
use crate::candidates::Candidates;
use rayon::prelude::*;
use std::ops::ControlFlow;

/// Why a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stop {
    /// All generations were evaluated.
    BudgetSpent,
    /// The observer ended it.
    Interrupted,
    /// An iteration came to its end.
    Converged,
}

impl Stop {
    /// Its name in results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::BudgetSpent => "budget_spent",
            Self::Interrupted => "interrupted",
            Self::Converged => "converged",
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

/// Evaluates populations, one for each run (empty where a run has none in this call), and writes their costs, run
/// after run.
pub type Evaluate<'a> = dyn FnMut(&[Candidates<'_>], &mut [f64]) -> Result<()> + 'a;

/// Sees every finished generation and may end the search.
pub type Observe<'a> = dyn FnMut(&Progress) -> ControlFlow<()> + 'a;

/// How far and in what pieces searches go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// Generations, the first population included.
    pub generations: usize,
    /// Most candidates in one call of `evaluate`; `observe` is asked after each, so that a search can be ended
    /// within a generation.
    pub slice: usize,
}

/// Takes all runs through the generations of `budget`.
///
/// Where `observe` ends the search, the best so far is kept, that of an unfinished generation included.
///
/// # Errors
/// What `evaluate` returns.
pub fn minimize(
    runs: &mut [Run],
    budget: Budget,
    evaluate: &mut Evaluate<'_>,
    observe: &mut Observe<'_>,
) -> Result<Stop> {
    let generations = budget.generations;
    let (mut costs, mut before) = (Vec::new(), 0);
    for generation in 1..=generations {
        let populations: Vec<Candidates<'_>> = runs.iter_mut().map(|run| run.optimizer.ask()).collect();
        let counts: Vec<usize> = populations.iter().map(Candidates::count).collect();
        let total: usize = counts.iter().sum();
        costs.clear();
        costs.resize(total, f64::INFINITY);
        let (mut done, mut stopped, mut best) = (0, false, f64::INFINITY);
        while done < total && !stopped {
            let end = total.min(done + budget.slice.max(1));
            evaluate(&rows(&populations, done, end), &mut costs[done..end])?;
            best = costs[done..end].iter().copied().fold(best, f64::min);
            done = end;
            let evaluations = before + done as u64;
            // The last slice is reported with the generation that it ends.
            stopped = done < total
                && observe(&Progress { generation: generation - 1, generations, evaluations, cost: best }).is_break();
        }
        before += done as u64;
        tell(runs, &counts, &costs, Told { done, more: generation < generations && !stopped });
        let cost = runs.iter().map(Run::cost).fold(f64::INFINITY, f64::min);
        if stopped || observe(&Progress { generation, generations, evaluations: before, cost }).is_break() {
            return Ok(Stop::Interrupted);
        }
    }
    Ok(Stop::BudgetSpent)
}

/// Where a generation stands.
#[derive(Clone, Copy)]
struct Told {
    /// How many of all candidates were evaluated: the first.
    done: usize,
    /// Whether another generation follows.
    more: bool,
}

/// Tells every run its costs; runs in parallel.
fn tell(runs: &mut [Run], counts: &[usize], costs: &[f64], state: Told) {
    let (mut rest, mut left) = (costs, state.done);
    let mut told = Vec::with_capacity(runs.len());
    for (run, &count) in runs.iter_mut().zip(counts) {
        let (own, others) = rest.split_at(count);
        told.push((run, own, count.min(left) as u64));
        left -= count.min(left);
        rest = others;
    }
    let tell = |(run, costs, evaluated): (&mut Run, &[f64], u64)| {
        run.optimizer.tell(costs);
        if state.more {
            // The next population is made here, where the runs go side by side.
            run.optimizer.ask();
        }
        run.evaluations += evaluated;
        run.history.push(run.cost());
    };
    if told.len() == 1 {
        told.into_iter().for_each(tell);
    } else {
        told.into_par_iter().for_each(tell);
    }
}

/// Rows `from..to` of all populations taken as one table, as parts of each.
fn rows<'a>(populations: &[Candidates<'a>], from: usize, to: usize) -> Vec<Candidates<'a>> {
    let mut first = 0;
    let mut parts = Vec::with_capacity(populations.len());
    for population in populations {
        let (start, end) = (from.max(first), to.min(first + population.count()));
        parts.push(if start < end { population.rows(start - first, end - first) } else { population.rows(0, 0) });
        first += population.count();
    }
    parts
}
