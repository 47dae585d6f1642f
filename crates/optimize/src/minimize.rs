//! The loop that drives searches: ask, evaluate, tell, for any number of runs in lock step.
//!
//! If the evaluator runs on a separate device, two batches are in flight: the runs are divided into two groups, and while
//! one is evaluated the other takes its costs and makes its next populations. The result of a run does not depend on this.

use super::generations::{Batch, Budget, Search, no_local_search};
use super::run::{LocalSearch, Progress, Run, Stop};
use motorfit_core::Result;
use motorfit_core::candidates::Candidates;
use std::collections::VecDeque;
use std::ops::ControlFlow;

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

    /// Returns the local search on the cost functions of the runs; `None` if there is none.
    fn local_search(&self) -> Option<&dyn LocalSearch> {
        None
    }

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

/// Number of batches in flight if the evaluator overlaps them.
const FLIGHTS: usize = 2;

/// Runs all searches for the generations of `budget`; a search whose populations differ in size ends when its own evaluations are
/// spent.
///
/// If `observe` ends the search, the best candidates are kept, including those of an unfinished generation.
///
/// # Errors
/// Propagates the errors of `evaluate`, and returns `Usage` if a search requests local searches and `evaluate` has none.
pub fn minimize(
    runs: &mut [Run],
    budget: Budget,
    evaluate: &mut dyn Evaluate,
    observe: &mut Observe<'_>,
) -> Result<Stop> {
    if budget.generations == 0 || runs.is_empty() {
        return Ok(Stop::BudgetSpent);
    }
    if evaluate.local_search().is_none() && runs.iter().any(|run| run.optimizer.needs_local_search()) {
        return Err(no_local_search());
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
        let progress = search.finished(batch, stopped, evaluate.local_search())?;
        stopped = stopped || observe(&progress).is_break();
    }
    if !stopped {
        return Ok(Stop::BudgetSpent);
    }
    for group in 0..search.groups.len() {
        if search.groups[group].done > 0 {
            search.tell(group, false, None)?;
        }
    }
    Ok(Stop::Interrupted)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CmaEsOptions, ConfiguredSearch, JayaOptions, LshadeOptions, SearchSettings};

    fn runs() -> Vec<Run> {
        let run = |run: u64| {
            let population = 5 + usize::try_from(run).unwrap();
            let setup = SearchSettings {
                bounds: vec![(-1.0, 2.0); 3],
                population,
                generations: 12,
                run,
                ..SearchSettings::default()
            };
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
    fn runs_whose_populations_differ_in_size_spend_the_same_evaluations() {
        // A shrinking population, one of few samples and one of a fixed size, of 6 × 50 evaluations each.
        let searches = [LshadeOptions::default().into(), CmaEsOptions::default().into(), JayaOptions::default().into()];
        let run = |search: &ConfiguredSearch| {
            let bounds = vec![(-1.0, 2.0); 3];
            let setup = SearchSettings { bounds, population: 6, generations: 50, ..SearchSettings::default() };
            Run::new(search.begin(setup).unwrap())
        };
        let mut alone = Vec::new();
        for search in &searches {
            let mut one = [run(search)];
            let mut function = |populations: &[Candidates<'_>], costs: &mut [f64]| {
                sphere(populations, costs);
                Ok(())
            };
            let budget = Budget { generations: 50, slice: usize::MAX };
            minimize(&mut one, budget, &mut function, &mut |_| ControlFlow::Continue(())).unwrap();
            assert_eq!((one[0].evaluations, one[0].history.len()), (300, 50), "{search:?}");
            alone.extend(results(&one));
        }
        for slice in [usize::MAX, 4] {
            let mut together: Vec<Run> = searches.iter().map(run).collect();
            let (mut generations, mut evaluations) = (Vec::new(), 0);
            let mut function = |populations: &[Candidates<'_>], costs: &mut [f64]| {
                sphere(populations, costs);
                Ok(())
            };
            let budget = Budget { generations: 50, slice };
            minimize(&mut together, budget, &mut function, &mut |progress| {
                generations.push(progress.generation);
                evaluations = progress.evaluations;
                ControlFlow::Continue(())
            })
            .unwrap();
            assert_eq!(results(&together), alone, "slices of {slice}");
            assert_eq!((generations.last(), evaluations), (Some(&50), 900));
            assert!(generations.is_sorted());
        }
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
