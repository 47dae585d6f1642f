//! The loop that drives searches: ask, evaluate, tell, for any number of runs in lock step.
//!
//! If the evaluator runs on a separate device, two batches are in flight: the runs are divided into two groups, and while
//! one is evaluated the other takes its costs and makes its next populations. The result of a run does not depend on this.

use super::run::{Progress, Run, Stop};
use crate::Result;
use crate::candidates::Candidates;
use rayon::prelude::*;
use std::collections::VecDeque;
use std::ops::{ControlFlow, Range};

/// Evaluator of populations, one for each run (empty for a run without candidates in this call). A closure that writes the
/// costs, run after run, implements it.
pub trait Evaluate {
    /// Starts the evaluation of populations. Evaluations finish in the order in which they started.
    ///
    /// # Errors
    /// Returns an error if the evaluation cannot start; it ends the search.
    fn begin(&mut self, _populations: &[Candidates<'_>]) -> Result<()> {
        Ok(())
    }

    /// Writes the costs of the populations that were started first, run after run.
    ///
    /// # Errors
    /// Returns an error if the evaluation fails; it ends the search.
    fn finish(&mut self, populations: &[Candidates<'_>], costs: &mut [f64]) -> Result<()>;

    /// Returns true if starting an evaluation before another finishes saves time.
    fn overlaps(&self) -> bool {
        false
    }
}

impl<F: FnMut(&[Candidates<'_>], &mut [f64]) -> Result<()>> Evaluate for F {
    fn finish(&mut self, populations: &[Candidates<'_>], costs: &mut [f64]) -> Result<()> {
        self(populations, costs)
    }
}

/// Observer called after every evaluated batch; it may end the search.
pub type Observe<'a> = dyn FnMut(&Progress) -> ControlFlow<()> + 'a;

/// Budget of searches and size of their batches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// Number of generations, the first population included.
    pub generations: usize,
    /// Largest number of candidates in one batch. `observe` is called after each batch, so that a search can be ended
    /// within a generation.
    pub slice: usize,
}

/// Number of batches in flight if the evaluator overlaps them.
const FLIGHTS: usize = 2;

/// Runs all searches for the generations of `budget`.
///
/// If `observe` ends the search, the best candidates are kept, including those of an unfinished generation.
///
/// # Errors
/// Propagates the errors of `evaluate`.
pub fn minimize(
    runs: &mut [Run],
    budget: Budget,
    evaluate: &mut dyn Evaluate,
    observe: &mut Observe<'_>,
) -> Result<Stop> {
    if budget.generations == 0 || runs.is_empty() {
        return Ok(Stop::BudgetSpent);
    }
    let flights = if evaluate.overlaps() { FLIGHTS } else { 1 };
    let mut search = Search::new(runs, budget, flights);
    let mut in_flight: VecDeque<Batch> = VecDeque::new();
    let mut stopped = false;
    loop {
        while !stopped
            && in_flight.len() < flights
            && let Some(batch) = search.next()
        {
            search.with_rows(batch, |populations, _| evaluate.begin(populations))?;
            in_flight.push_back(batch);
        }
        let Some(batch) = in_flight.pop_front() else { break };
        search.with_rows(batch, |populations, costs| evaluate.finish(populations, costs))?;
        let progress = search.finished(batch, stopped);
        stopped = stopped || observe(&progress).is_break();
    }
    if !stopped {
        return Ok(Stop::BudgetSpent);
    }
    for group in 0..search.groups.len() {
        if search.groups[group].done > 0 {
            search.tell(group, false);
        }
    }
    Ok(Stop::Interrupted)
}

/// A batch: rows of the populations of a group of runs, taken as one table.
#[derive(Clone, Copy)]
struct Batch {
    group: usize,
    from: usize,
    to: usize,
}

/// Returns the end of a batch that starts at row `from`: as many complete runs as fit in `slice`. A run that does not fit
/// is cut at its own multiples of `slice`, so that its batches do not depend on the runs beside it.
fn end_of_batch(counts: &[usize], from: usize, slice: usize) -> usize {
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
struct Group {
    runs: Range<usize>,
    /// Current generation, counted from 1.
    generation: usize,
    /// Number of candidates of each run.
    counts: Vec<usize>,
    costs: Vec<f64>,
    /// Number of rows whose evaluation has started.
    begun: usize,
    /// Number of rows whose evaluation has finished.
    done: usize,
    /// True if the generation has a batch to start; a generation without candidates has one empty batch.
    open: bool,
}

/// State of the loop over all runs.
struct Search<'r> {
    runs: &'r mut [Run],
    /// Number of values of a candidate of each run.
    widths: Vec<usize>,
    budget: Budget,
    groups: Vec<Group>,
    evaluations: u64,
}

impl<'r> Search<'r> {
    fn new(runs: &'r mut [Run], budget: Budget, groups: usize) -> Self {
        let groups = groups.min(runs.len());
        let widths = runs.iter_mut().map(|run| run.optimizer.ask().width()).collect();
        let mut search = Self { runs, widths, budget, groups: Vec::new(), evaluations: 0 };
        for group in 0..groups {
            let [first, end] = [group, group + 1].map(|n| n * search.runs.len() / groups);
            search.groups.push(Group { runs: first..end, ..Group::default() });
            search.open(group);
        }
        search
    }

    fn open(&mut self, group: usize) {
        let group = &mut self.groups[group];
        let runs = &mut self.runs[group.runs.clone()];
        group.counts.clear();
        group.counts.extend(runs.iter_mut().map(|run| run.optimizer.ask().count()));
        group.costs.clear();
        group.costs.resize(group.counts.iter().sum(), f64::INFINITY);
        (group.begun, group.done, group.open) = (0, 0, true);
        group.generation += 1;
    }

    /// Returns the next batch, of the group in the earliest generation; `None` while all groups wait for costs or have
    /// finished.
    fn next(&mut self) -> Option<Batch> {
        let waiting = |(_, group): &(usize, &mut Group)| group.open;
        let (n, group) =
            self.groups.iter_mut().enumerate().filter(waiting).min_by_key(|(_, group)| group.generation)?;
        let from = group.begun;
        group.begun = end_of_batch(&group.counts, from, self.budget.slice.max(1));
        group.open = group.begun < group.costs.len();
        Some(Batch { group: n, from, to: group.begun })
    }

    /// Calls `work` with the rows of a batch, one table for every run, and with their costs.
    fn with_rows<T>(&mut self, batch: Batch, work: impl FnOnce(&[Candidates<'_>], &mut [f64]) -> T) -> T {
        let Batch { group, from, to } = batch;
        let Group { runs, costs, .. } = &mut self.groups[group];
        let mut first = 0;
        let mut tables = Vec::with_capacity(self.runs.len());
        for (n, run) in self.runs.iter_mut().enumerate() {
            if !runs.contains(&n) {
                tables.push(Candidates::new(&[], self.widths[n]));
                continue;
            }
            let population = run.optimizer.ask();
            let (start, end) = (from.max(first), to.min(first + population.count()));
            tables.push(if start < end { population.rows(start - first, end - first) } else { population.rows(0, 0) });
            first += population.count();
        }
        work(&tables, &mut costs[from..to])
    }

    /// Records the costs of a batch; once a generation is complete, its runs take their costs.
    fn finished(&mut self, batch: Batch, stopped: bool) -> Progress {
        let group = &mut self.groups[batch.group];
        let lowest = group.costs[batch.from..batch.to].iter().copied().fold(f64::INFINITY, f64::min);
        group.done += batch.to - batch.from;
        self.evaluations += (batch.to - batch.from) as u64;
        if group.done == group.costs.len() {
            let more = group.generation < self.budget.generations && !stopped;
            self.tell(batch.group, more);
            if more {
                self.open(batch.group);
            } else {
                let group = &mut self.groups[batch.group];
                group.generation += 1;
                (group.done, group.open) = (0, false);
            }
        }
        // The number of generations that all groups have completed.
        let generation = self.groups.iter().map(|group| group.generation).min().unwrap_or(1) - 1;
        let best = self.runs.iter().map(Run::cost).fold(f64::INFINITY, f64::min);
        let cost = best.min(lowest);
        Progress { generation, generations: self.budget.generations, evaluations: self.evaluations, cost }
    }

    /// Passes the costs to the runs of a group in parallel.
    fn tell(&mut self, group: usize, more: bool) {
        let group = &self.groups[group];
        let (mut rest, mut left) = (group.costs.as_slice(), group.done);
        let mut told = Vec::with_capacity(group.runs.len());
        for (run, &count) in self.runs[group.runs.clone()].iter_mut().zip(&group.counts) {
            let (own, others) = rest.split_at(count);
            told.push((run, own, count.min(left) as u64));
            left -= count.min(left);
            rest = others;
        }
        let tell = |(run, costs, evaluated): (&mut Run, &[f64], u64)| {
            run.optimizer.tell(costs);
            if more {
                // The next population is made here, where runs proceed in parallel.
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimize::{ConfiguredSearch, JayaOptions, SearchSettings};

    fn runs() -> Vec<Run> {
        let run = |run: u64| {
            let population = 5 + usize::try_from(run).unwrap();
            let setup = SearchSettings { bounds: vec![(-1.0, 2.0); 3], population, generations: 12, seed: 1, run };
            Run::new(ConfiguredSearch::from(JayaOptions::default()).begin(setup).unwrap())
        };
        (0..7).map(run).collect()
    }

    fn sphere(populations: &[Candidates<'_>], costs: &mut [f64]) {
        let rows = populations.iter().flat_map(|p| (0..p.count()).map(|row| p.row(row)));
        for (cost, row) in costs.iter_mut().zip(rows) {
            *cost = row.iter().map(|v| v * v).sum();
        }
    }

    /// A device that evaluates batches in the order of their start and counts those in flight.
    #[derive(Default)]
    struct Device {
        begun: VecDeque<Vec<Vec<f64>>>,
        most: usize,
    }

    impl Evaluate for Device {
        fn begin(&mut self, populations: &[Candidates<'_>]) -> Result<()> {
            assert_eq!(populations.len(), 7, "one for each run");
            self.begun.push_back(populations.iter().map(|p| p.values().to_vec()).collect());
            self.most = self.most.max(self.begun.len());
            Ok(())
        }

        fn finish(&mut self, populations: &[Candidates<'_>], costs: &mut [f64]) -> Result<()> {
            let begun = self.begun.pop_front().unwrap();
            assert!(begun.iter().zip(populations).all(|(begun, now)| begun == now.values()), "in their order");
            sphere(populations, costs);
            Ok(())
        }

        fn overlaps(&self) -> bool {
            true
        }
    }

    fn results(runs: &[Run]) -> Vec<(Vec<f64>, u64, Vec<f64>)> {
        let values = |run: &Run| run.optimizer.best().map_or(Vec::new(), |best| best.values.to_vec());
        runs.iter().map(|run| (run.history.clone(), run.evaluations, values(run))).collect()
    }

    #[test]
    fn runs_do_not_depend_on_batches_in_flight() {
        let mut plain = runs();
        let mut closure = |populations: &[Candidates<'_>], costs: &mut [f64]| {
            sphere(populations, costs);
            Ok(())
        };
        let budget = Budget { generations: 12, slice: usize::MAX };
        minimize(&mut plain, budget, &mut closure, &mut |_| ControlFlow::Continue(())).unwrap();
        assert_eq!(plain[3].evaluations, 12 * 8);
        for slice in [usize::MAX, 11, 1] {
            let (mut device, mut overlapped, mut seen) = (Device::default(), runs(), Vec::new());
            let budget = Budget { slice, ..budget };
            let stop = minimize(&mut overlapped, budget, &mut device, &mut |progress| {
                seen.push((progress.generation, progress.evaluations));
                ControlFlow::Continue(())
            });
            assert_eq!(stop.unwrap(), Stop::BudgetSpent);
            assert_eq!(results(&overlapped), results(&plain), "slices of {slice}");
            assert_eq!((device.most, device.begun.len()), (2, 0));
            assert_eq!(seen.last(), Some(&(12, 12 * 56)));
            assert!(seen.is_sorted());
        }
    }

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

    #[test]
    fn an_interruption_keeps_the_batches_in_flight() {
        for after in [1, 2, 7, 20] {
            let (mut device, mut some, mut asked, mut by_then) = (Device::default(), runs(), 0, 0);
            let budget = Budget { generations: 12, slice: 9 };
            let stop = minimize(&mut some, budget, &mut device, &mut |progress| {
                (asked, by_then) = (asked + 1, progress.evaluations);
                if asked == after { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            });
            assert_eq!(stop.unwrap(), Stop::Interrupted);
            assert_eq!((asked, device.begun.len()), (after, 0), "nothing is left in flight, and nobody is asked again");
            let evaluated: u64 = some.iter().map(|run| run.evaluations).sum();
            assert!((by_then + 1..=by_then + 9).contains(&evaluated), "{evaluated}, {by_then} when asked");
            assert!(some[0].cost().is_finite());
        }
    }
}
