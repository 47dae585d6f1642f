//! The one loop that drives searches: ask, evaluate, tell, any number of runs in lock step.
//!
//! Where the evaluator has a device of its own, two pieces of work are in flight: the runs are two halves, and while one
//! is evaluated the other is told its costs and makes its next populations. A run's result does not depend on that.

use super::run::{Progress, Run, Stop};
use crate::Result;
use crate::candidates::Candidates;
use rayon::prelude::*;
use std::collections::VecDeque;
use std::ops::{ControlFlow, Range};

/// Evaluation of populations, one for each run (empty where a run has none in this call). A closure that writes the
/// costs, run after run, is one.
pub trait Evaluate {
    /// Begins populations. They are finished in the order in which they were begun.
    ///
    /// # Errors
    /// Ends the search.
    fn begin(&mut self, _populations: &[Candidates<'_>]) -> Result<()> {
        Ok(())
    }

    /// Writes the costs of the populations that were begun first, run after run.
    ///
    /// # Errors
    /// Ends the search.
    fn finish(&mut self, populations: &[Candidates<'_>], costs: &mut [f64]) -> Result<()>;

    /// Returns whether something is gained by beginning populations before others are finished.
    fn overlaps(&self) -> bool {
        false
    }
}

impl<F: FnMut(&[Candidates<'_>], &mut [f64]) -> Result<()>> Evaluate for F {
    fn finish(&mut self, populations: &[Candidates<'_>], costs: &mut [f64]) -> Result<()> {
        self(populations, costs)
    }
}

/// Sees every finished generation and may end the search.
pub type Observe<'a> = dyn FnMut(&Progress) -> ControlFlow<()> + 'a;

/// The budget of searches, and the pieces in which they are run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// Generations, the first population included.
    pub generations: usize,
    /// Most candidates in one piece of work; `observe` is asked after each, so that a search can be ended within a
    /// generation.
    pub slice: usize,
}

/// Pieces of work in flight where that pays.
const FLIGHTS: usize = 2;

/// Takes all runs through the generations of `budget`.
///
/// Where `observe` ends the search, the best so far is kept, that of an unfinished generation included.
///
/// # Errors
/// What `evaluate` returns.
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
    let mut in_flight: VecDeque<Piece> = VecDeque::new();
    let mut stopped = false;
    loop {
        while !stopped
            && in_flight.len() < flights
            && let Some(piece) = search.next()
        {
            search.with_rows(piece, |populations, _| evaluate.begin(populations))?;
            in_flight.push_back(piece);
        }
        let Some(piece) = in_flight.pop_front() else { break };
        search.with_rows(piece, |populations, costs| evaluate.finish(populations, costs))?;
        let progress = search.finished(piece, stopped);
        stopped = stopped || observe(&progress).is_break();
    }
    if !stopped {
        return Ok(Stop::BudgetSpent);
    }
    for part in 0..search.parts.len() {
        if search.parts[part].done > 0 {
            search.tell(part, false);
        }
    }
    Ok(Stop::Interrupted)
}

/// Rows of the populations of a part of the runs, taken as one table.
#[derive(Clone, Copy)]
struct Piece {
    part: usize,
    from: usize,
    to: usize,
}

/// Where a piece from row `from` on ends: as many whole runs as fit in `slice`; a run that does not fit is cut at its own
/// multiples of it, so that its pieces do not depend on the runs beside it.
fn end_of_piece(counts: &[usize], from: usize, slice: usize) -> usize {
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

/// Runs that are evaluated and told together.
#[derive(Default)]
struct Part {
    runs: Range<usize>,
    /// The generation that is under way, from 1 on.
    generation: usize,
    /// Candidates of each run.
    counts: Vec<usize>,
    costs: Vec<f64>,
    /// Rows that have been begun and finished.
    begun: usize,
    done: usize,
    /// True if the generation has any piece begun: one without candidates has a piece too.
    open: bool,
}

struct Search<'r> {
    runs: &'r mut [Run],
    /// Values of a candidate of each run.
    widths: Vec<usize>,
    budget: Budget,
    parts: Vec<Part>,
    evaluations: u64,
}

impl<'r> Search<'r> {
    fn new(runs: &'r mut [Run], budget: Budget, parts: usize) -> Self {
        let parts = parts.min(runs.len());
        let widths = runs.iter_mut().map(|run| run.optimizer.ask().width()).collect();
        let mut search = Self { runs, widths, budget, parts: Vec::new(), evaluations: 0 };
        for part in 0..parts {
            let [first, end] = [part, part + 1].map(|n| n * search.runs.len() / parts);
            search.parts.push(Part { runs: first..end, ..Part::default() });
            search.open(part);
        }
        search
    }

    fn open(&mut self, part: usize) {
        let part = &mut self.parts[part];
        let runs = &mut self.runs[part.runs.clone()];
        part.counts.clear();
        part.counts.extend(runs.iter_mut().map(|run| run.optimizer.ask().count()));
        part.costs.clear();
        part.costs.resize(part.counts.iter().sum(), f64::INFINITY);
        (part.begun, part.done, part.open) = (0, 0, true);
        part.generation += 1;
    }

    /// The next piece, of the part that is behind; `None` while all wait for costs or are at the end.
    fn next(&mut self) -> Option<Piece> {
        let waiting = |(_, part): &(usize, &mut Part)| part.open;
        let (n, part) = self.parts.iter_mut().enumerate().filter(waiting).min_by_key(|(_, part)| part.generation)?;
        let from = part.begun;
        part.begun = end_of_piece(&part.counts, from, self.budget.slice.max(1));
        part.open = part.begun < part.costs.len();
        Some(Piece { part: n, from, to: part.begun })
    }

    /// Does `work` with the rows of a piece, one table for every run, and with their costs.
    fn with_rows<T>(&mut self, piece: Piece, work: impl FnOnce(&[Candidates<'_>], &mut [f64]) -> T) -> T {
        let Piece { part, from, to } = piece;
        let Part { runs, costs, .. } = &mut self.parts[part];
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

    /// Takes the costs of a piece. A generation that is complete is told.
    fn finished(&mut self, piece: Piece, stopped: bool) -> Progress {
        let part = &mut self.parts[piece.part];
        let lowest = part.costs[piece.from..piece.to].iter().copied().fold(f64::INFINITY, f64::min);
        part.done += piece.to - piece.from;
        self.evaluations += (piece.to - piece.from) as u64;
        if part.done == part.costs.len() {
            let more = part.generation < self.budget.generations && !stopped;
            self.tell(piece.part, more);
            if more {
                self.open(piece.part);
            } else {
                let part = &mut self.parts[piece.part];
                part.generation += 1;
                (part.done, part.open) = (0, false);
            }
        }
        // Generations that all parts have done.
        let generation = self.parts.iter().map(|part| part.generation).min().unwrap_or(1) - 1;
        let best = self.runs.iter().map(Run::cost).fold(f64::INFINITY, f64::min);
        let cost = best.min(lowest);
        Progress { generation, generations: self.budget.generations, evaluations: self.evaluations, cost }
    }

    /// Tells the runs of a part their costs, side by side.
    fn tell(&mut self, part: usize, more: bool) {
        let part = &self.parts[part];
        let (mut rest, mut left) = (part.costs.as_slice(), part.done);
        let mut told = Vec::with_capacity(part.runs.len());
        for (run, &count) in self.runs[part.runs.clone()].iter_mut().zip(&part.counts) {
            let (own, others) = rest.split_at(count);
            told.push((run, own, count.min(left) as u64));
            left -= count.min(left);
            rest = others;
        }
        let tell = |(run, costs, evaluated): (&mut Run, &[f64], u64)| {
            run.optimizer.tell(costs);
            if more {
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimize::{JayaOptions, SearchSettings, Tuned};

    fn runs() -> Vec<Run> {
        let run = |run: u64| {
            let population = 5 + usize::try_from(run).unwrap();
            let setup = SearchSettings { bounds: vec![(-1.0, 2.0); 3], population, generations: 12, seed: 1, run };
            Run::new(Tuned::from(JayaOptions::default()).begin(setup).unwrap())
        };
        (0..7).map(run).collect()
    }

    fn sphere(populations: &[Candidates<'_>], costs: &mut [f64]) {
        let rows = populations.iter().flat_map(|p| (0..p.count()).map(|row| p.row(row)));
        for (cost, row) in costs.iter_mut().zip(rows) {
            *cost = row.iter().map(|v| v * v).sum();
        }
    }

    /// A device that computes what was begun, in order, and counts what is in flight.
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
    fn runs_do_not_depend_on_what_is_in_flight() {
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
    fn pieces_are_whole_runs_or_parts_of_one() {
        let counts = [5, 5, 30, 0, 4, 4];
        let mut ends = vec![0];
        while *ends.last().unwrap() < 48 {
            ends.push(end_of_piece(&counts, *ends.last().unwrap(), 12));
        }
        assert_eq!(ends, [0, 10, 22, 34, 44, 48], "30 is cut at its own twelves");
        assert_eq!(end_of_piece(&counts, 0, usize::MAX), 48);
        assert_eq!(end_of_piece(&[0, 0], 0, 3), 0);
    }

    #[test]
    fn an_interruption_waits_for_what_is_in_flight_and_keeps_it() {
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
