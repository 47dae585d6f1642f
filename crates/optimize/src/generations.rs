//! State of the loop that drives searches: the batches of their generations, and the costs that they take.

use super::run::{LocalSearch, Progress, Run};
use motorfit_core::candidates::Candidates;
use motorfit_core::{Error, Result};
use rayon::prelude::*;
use std::ops::Range;

/// Budget of searches and size of their batches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// Number of generations, the first population included.
    pub generations: usize,
    /// Largest number of candidates in one batch. `observe` is called after each batch, so that a search can be ended
    /// within a generation.
    pub slice: usize,
}

/// A batch: rows of the populations of a group of runs, taken as one table.
#[derive(Clone, Copy)]
pub(super) struct Batch {
    pub group: usize,
    from: usize,
    to: usize,
}

/// Returns the end of a batch that starts at row `from`: as many complete runs as fit in `slice`. A run that does not fit
/// is cut at its own multiples of `slice`, so that its batches do not depend on the runs beside it.
pub(super) fn end_of_batch(counts: &[usize], from: usize, slice: usize) -> usize {
    let (mut first, mut end) = (0, from);
    for count in counts {
        let last = first + count;
        if last > from && end >= first {
            if last - from > slice {
                return if end == from { last.min(from.saturating_add(slice)) } else { end };
            }
            end = last;
        }
        first = last;
    }
    end
}

/// A group of runs that are evaluated, and take their costs, together.
#[derive(Default)]
pub(super) struct Group {
    runs: Range<usize>,
    /// Number of generations begun.
    generation: usize,
    /// Number of candidates of each run; 0 for one that has ended.
    counts: Vec<usize>,
    costs: Vec<f64>,
    /// Number of rows whose evaluation has started.
    begun: usize,
    /// Number of rows whose evaluation has finished.
    pub done: usize,
    /// True if the generation has a batch to start; a generation without candidates has one empty batch.
    open: bool,
}

/// State of the loop over all runs.
pub(super) struct Search<'r> {
    runs: &'r mut [Run],
    /// Number of values of a candidate of each run.
    widths: Vec<usize>,
    /// Number of generations that each run has completed of the budget; all of them for one that has ended.
    completed: Vec<usize>,
    budget: Budget,
    pub groups: Vec<Group>,
    evaluations: u64,
}

impl<'r> Search<'r> {
    pub(super) fn new(runs: &'r mut [Run], budget: Budget, groups: usize) -> Self {
        let groups = groups.min(runs.len());
        let widths = runs.iter_mut().map(|run| run.optimizer.ask().width()).collect();
        let completed = vec![0; runs.len()];
        let mut search = Self { runs, widths, completed, budget, groups: Vec::new(), evaluations: 0 };
        for group in 0..groups {
            let [first, end] = [group, group + 1].map(|n| n * search.runs.len() / groups);
            search.groups.push(Group { runs: first..end, ..Group::default() });
            search.open(group);
        }
        search
    }

    /// Returns true if all runs of a group have ended.
    fn has_ended(&self, group: usize) -> bool {
        self.completed[self.groups[group].runs.clone()].iter().all(|done| *done >= self.budget.generations)
    }

    fn open(&mut self, group: usize) {
        let group = &mut self.groups[group];
        let runs = self.runs[group.runs.clone()].iter_mut().zip(&self.completed[group.runs.clone()]);
        group.counts.clear();
        group.counts.extend(runs.map(|(run, completed)| match *completed < self.budget.generations {
            true => run.optimizer.ask().count(),
            false => 0,
        }));
        group.costs.clear();
        group.costs.resize(group.counts.iter().sum(), f64::INFINITY);
        (group.begun, group.done, group.open) = (0, 0, true);
        group.generation += 1;
    }

    /// Returns the next batch, of the group in the earliest generation; `None` while all groups wait for costs or have
    /// finished.
    pub(super) fn next(&mut self) -> Option<Batch> {
        let waiting = |(_, group): &(usize, &mut Group)| group.open;
        let (n, group) =
            self.groups.iter_mut().enumerate().filter(waiting).min_by_key(|(_, group)| group.generation)?;
        let from = group.begun;
        group.begun = end_of_batch(&group.counts, from, self.budget.slice.max(1));
        group.open = group.begun < group.costs.len();
        Some(Batch { group: n, from, to: group.begun })
    }

    /// Calls `work` with the rows of a batch, one table for every run, and with their costs.
    pub(super) fn with_rows<T>(&mut self, batch: Batch, work: impl FnOnce(&[Candidates<'_>], &mut [f64]) -> T) -> T {
        let Batch { group, from, to } = batch;
        let Group { runs, costs, counts, .. } = &mut self.groups[group];
        let mut first = 0;
        let mut tables = Vec::with_capacity(self.runs.len());
        for (n, run) in self.runs.iter_mut().enumerate() {
            let count = if runs.contains(&n) { counts[n - runs.start] } else { 0 };
            let (start, end) = (from.max(first), to.min(first + count));
            tables.push(if start < end {
                run.optimizer.ask().rows(start - first, end - first)
            } else {
                Candidates::new(&[], self.widths[n])
            });
            first += count;
        }
        work(&tables, &mut costs[from..to])
    }

    /// Records the costs of a batch; once a generation is complete, its runs take their costs.
    pub(super) fn finished(
        &mut self,
        batch: Batch,
        stopped: bool,
        local: Option<&dyn LocalSearch>,
    ) -> Result<Progress> {
        let group = &mut self.groups[batch.group];
        let lowest = group.costs[batch.from..batch.to].iter().copied().fold(f64::INFINITY, f64::min);
        group.done += batch.to - batch.from;
        self.evaluations += (batch.to - batch.from) as u64;
        if group.done == group.costs.len() {
            self.evaluations += self.tell(batch.group, !stopped, local)?;
            if stopped || self.has_ended(batch.group) {
                (self.groups[batch.group].done, self.groups[batch.group].open) = (0, false);
            } else {
                self.open(batch.group);
            }
        }
        let generation = self.completed.iter().copied().min().unwrap_or(0);
        let best = self.runs.iter().map(Run::cost).fold(f64::INFINITY, f64::min);
        let cost = best.min(lowest);
        Ok(Progress { generation, generations: self.budget.generations, evaluations: self.evaluations, cost })
    }

    /// Passes the costs to the runs of a group in parallel and, if `more` is to follow, runs the local searches that they request.
    /// Returns the number of evaluations of the local searches.
    pub(super) fn tell(&mut self, group: usize, more: bool, local: Option<&dyn LocalSearch>) -> Result<u64> {
        let generations = self.budget.generations;
        let group = &self.groups[group];
        let (mut rest, mut left) = (group.costs.as_slice(), group.done);
        let mut told = Vec::with_capacity(group.runs.len());
        let runs = self.runs[group.runs.clone()].iter_mut().zip(&mut self.completed[group.runs.clone()]);
        for ((index, (run, completed)), &count) in group.runs.clone().zip(runs).zip(&group.counts) {
            let (own, others) = rest.split_at(count);
            if *completed < generations {
                told.push((index, run, completed, own, count.min(left)));
            }
            left -= count.min(left);
            rest = others;
        }
        let tell = |(index, run, completed, costs, evaluated): (usize, &mut Run, &mut usize, &[f64], usize)| {
            let mut known = run.cost();
            run.optimizer.tell(costs);
            run.evaluations += evaluated as u64;
            let mut searched = 0;
            if more && run.optimizer.local_searches().is_some() {
                // Generations that ended before the local searches have the cost of their candidates.
                if run.optimizer.evaluations_max().is_some() {
                    *completed = run.completed(*completed, known, false, generations);
                }
                known = run.cost();
                searched = run.search_locally(index, local.ok_or_else(no_local_search)?);
            }
            *completed = run.completed(*completed, known, costs.is_empty() && searched == 0, generations);
            if more && *completed < generations {
                // The next population is made here, where runs proceed in parallel.
                run.optimizer.ask();
            }
            Ok(searched)
        };
        if told.len() == 1 { told.into_iter().map(tell).sum() } else { told.into_par_iter().map(tell).sum() }
    }
}

/// Returns the error for a search that requests local searches on a cost function without them.
pub(super) fn no_local_search() -> Error {
    Error::usage(
        "this search descends along the residuals of recordings, and the cost function has none",
        "Choose another method.",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batches_are_whole_runs_or_parts_of_one() {
        let counts = [5, 5, 30, 0, 4, 4];
        let mut ends = vec![0];
        while *ends.last().unwrap() < 48 {
            ends.push(end_of_batch(&counts, *ends.last().unwrap(), 12));
        }
        assert_eq!(ends, [0, 10, 22, 34, 44, 48], "30 is cut at its own twelves");
        assert_eq!(end_of_batch(&counts, 0, usize::MAX), 48);
        assert_eq!(end_of_batch(&[0, 0], 0, 3), 0);
    }
}
