//! Multistart of a local search: the baseline that population searches must beat.
//!
//! The points of a Latin hypercube are evaluated as one batch and divided into as many blocks as there are starts; the best point of each
//! block is the start of a local search along the residuals, Levenberg–Marquardt. Then further points follow, until the evaluations
//! are spent. An iteration of the local search counts as one evaluation and one more for each derivative.

use super::population::Population;
use super::rule::Rule;
use super::run::LocalOptimum;
use super::sample::{Sample, Sampling};
use super::table::{Range, search};
use motorfit_core::numeric::index;

search! {
    Multistart = "multistart", "Multistart of Levenberg–Marquardt";
    /// Settings of the multistart.
    pub struct MultistartOptions {
        /// Number of local searches from each population of points.
        starts: usize = 1, "starts" in Range::Count(u32::MAX);
        /// Largest number of iterations of a local search, after which it is given up.
        iterations: usize = 100, "iterations" in Range::Count(u32::MAX);
    }
}

/// Part of the evaluations that the first points may take.
const PART: u64 = 4;

#[derive(Default)]
struct Multistart {
    options: MultistartOptions,
    /// Starts of the next local searches, row-major.
    starts: Vec<f64>,
}

impl Multistart {
    /// Replaces the population by a Latin hypercube.
    fn sample(&mut self, population: &mut Population) {
        let Population { setup, numbers, values, .. } = population;
        let size = (setup.population as u64).min(setup.evaluations() / PART).max(1);
        values.resize(index(size) * setup.bounds.len(), 0.0);
        // The box and the size have been checked.
        if let Ok(sample) = Sample::new(Sampling::LatinHypercube, size, setup.bounds.clone(), numbers[0].bits()) {
            sample.fill(0, values);
        }
    }
}

impl Rule for Multistart {
    fn begin(&mut self, population: &mut Population) {
        self.sample(population);
    }

    fn learn(&mut self, population: &Population, costs: Vec<f64>) {
        self.starts.clear();
        let part = costs.len().div_ceil(self.options.starts.max(1)).max(1);
        for (block, costs) in costs.chunks(part).enumerate() {
            let best = (0..costs.len()).min_by(|a, b| costs[*a].total_cmp(&costs[*b])).unwrap_or(0);
            if costs[best].is_finite() {
                self.starts.extend_from_slice(population.row(block * part + best));
            }
        }
    }

    fn changes_size(&self) -> bool {
        true
    }

    fn needs_local_search(&self) -> bool {
        true
    }

    fn advance(&mut self, population: &mut Population) {
        self.sample(population);
    }

    fn starts(&self) -> &[f64] {
        &self.starts
    }

    fn longest(&self, axes: usize) -> u64 {
        // An iteration is a simulation with derivatives; the cost of the end is one more evaluation.
        (self.options.iterations as u64).saturating_mul(1 + axes as u64).saturating_add(1)
    }

    fn arrive(&mut self, _: &[LocalOptimum]) {
        self.starts.clear();
    }
}

#[allow(clippy::float_cmp, reason = "exact equality is meant")]
#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Budget, ConfiguredSearch, Evaluate, LocalSearch, Run, SearchSettings, Stop, minimize};
    use motorfit_core::candidates::Candidates;
    use motorfit_core::{Error, Result};
    use std::ops::ControlFlow;
    use std::sync::Mutex;

    /// Eight basins along one axis, the lowest of which is narrow; a local search goes to the bottom of the basin of its start.
    #[derive(Default)]
    struct Basins(Mutex<Vec<(usize, f64, u64)>>);

    fn cost(x: f64) -> f64 {
        let basin = x.floor();
        (x - basin - 0.5).powi(2) + if basin == 5.0 { 0.0 } else { 1.0 + basin }
    }

    impl LocalSearch for Basins {
        fn descend(&self, run: usize, start: &[f64], evaluations: u64) -> LocalOptimum {
            self.0.lock().unwrap().push((run, start[0], evaluations));
            let x = start[0].floor() + 0.5;
            LocalOptimum { values: vec![x], cost: cost(x), evaluations: evaluations.min(10) }
        }
    }

    impl Evaluate for Basins {
        fn finish(&mut self, populations: &[Candidates<'_>], costs: &mut [f64]) -> Result<()> {
            let rows = populations.iter().flat_map(|p| p.values().iter());
            costs.iter_mut().zip(rows).for_each(|(to, x)| *to = cost(*x));
            Ok(())
        }

        fn local_search(&self) -> Option<&dyn LocalSearch> {
            Some(self)
        }
    }

    fn runs(starts: usize, count: u64) -> Vec<Run> {
        let options = MultistartOptions { starts, ..MultistartOptions::default() };
        let run = |run: u64| {
            let bounds = vec![(0.0, 8.0)];
            let setup = SearchSettings { bounds, population: 8, generations: 10, run, ..SearchSettings::default() };
            Run::new(ConfiguredSearch::from(options).begin(setup).unwrap())
        };
        (0..count).map(run).collect()
    }

    fn search(runs: &mut [Run]) -> (Vec<(usize, f64, u64)>, Vec<usize>) {
        let (mut basins, mut generations) = (Basins::default(), Vec::new());
        let budget = Budget { generations: 10, slice: usize::MAX };
        let stop = minimize(runs, budget, &mut basins, &mut |progress| {
            generations.push(progress.generation);
            ControlFlow::Continue(())
        });
        assert_eq!(stop.unwrap(), Stop::BudgetSpent);
        (basins.0.into_inner().unwrap(), generations)
    }

    #[test]
    fn each_block_of_points_gives_a_start_until_the_evaluations_are_spent() {
        let mut runs = runs(4, 3);
        let (descended, generations) = search(&mut runs);
        assert!(generations.is_sorted() && generations.last() == Some(&10));
        for (n, run) in runs.iter().enumerate() {
            assert!((80..=84).contains(&run.evaluations), "the last descents share what is left: {}", run.evaluations);
            assert_eq!(run.history.len(), 10);
            assert!(run.history.windows(2).all(|pair| pair[1] <= pair[0]));
            assert_eq!(run.cost(), 0.0);
            // A round has 8 points and 4 descents of 10 evaluations each: 8 + 40, 8 and the last 24 in four parts.
            let own: Vec<u64> = descended.iter().filter(|of| of.0 == n).map(|of| of.2).collect();
            assert_eq!(own, [18, 18, 18, 18, 6, 6, 6, 6]);
        }
        let starts: Vec<f64> = descended.iter().map(|of| of.1).collect();
        assert!((1..starts.len()).all(|n| !starts[..n].contains(&starts[n])), "every start is another one");
    }

    #[test]
    fn a_local_search_is_given_up_after_its_iterations() {
        // Two iterations of a simulation and one derivative, and the cost of the end.
        let mut search = ConfiguredSearch::from(MultistartOptions::default());
        assert!(search.set("iterations", "2").unwrap());
        let setup =
            SearchSettings { bounds: vec![(0.0, 8.0)], population: 8, generations: 10, ..SearchSettings::default() };
        let mut basins = Basins::default();
        let budget = Budget { generations: 10, slice: usize::MAX };
        let mut runs = [Run::new(search.begin(setup).unwrap())];
        minimize(&mut runs, budget, &mut basins, &mut |_| ControlFlow::Continue(())).unwrap();
        let descended = basins.0.lock().unwrap();
        assert!(descended.iter().all(|(_, _, evaluations)| *evaluations <= 5));
        assert!(descended.iter().any(|(_, _, evaluations)| *evaluations == 5));
    }

    #[test]
    fn a_cost_function_without_residuals_is_refused() {
        let mut function = |_: &[Candidates<'_>], _: &mut [f64]| -> Result<()> { panic!("nothing is evaluated") };
        let budget = Budget { generations: 10, slice: usize::MAX };
        let error: Error =
            minimize(&mut runs(4, 1), budget, &mut function, &mut |_| ControlFlow::Continue(())).unwrap_err();
        assert!(error.to_string().contains("residuals"), "{error}");
    }
}
