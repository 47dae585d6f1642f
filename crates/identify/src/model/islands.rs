//! Starts from small populations that evolve apart from each other, for models whose cost is not smooth or has many optima.
//!
//! A plain evaluation is some fifty times as fast as one with derivatives, and differential evolution does not need them: friction that
//! sticks, or a backlash, makes descents end early.

use motorfit_core::Result;
use motorfit_core::candidates::Candidates;
use motorfit_evaluate::Evaluator;
use motorfit_evaluate::model::ModelProblem;
use motorfit_optimize::{Budget, ConfiguredSearch, DifferentialEvolutionOptions, Run, SearchSettings, minimize};
use std::ops::ControlFlow;
use std::sync::Arc;

/// Number of populations.
const ISLANDS: u64 = 4;
/// Candidates of a population, as many as the evaluator computes side by side.
const POPULATION: usize = 64;
/// Generations of a population.
const GENERATIONS: usize = 40;
/// Candidates of a batch.
const SLICE: usize = 1 << 14;

/// Returns the best candidate of each population, and the number of evaluated candidates.
pub(super) fn islands(
    problem: &Arc<ModelProblem>,
    evaluator: &mut dyn Evaluator<ModelProblem>,
    seed: u64,
) -> Result<(Vec<Vec<f64>>, u64)> {
    let axes = &problem.space().free;
    if axes.is_empty() {
        return Ok((vec![Vec::new()], 0));
    }
    let values = |fractions: &[f64]| -> Vec<f64> {
        fractions.iter().zip(axes.iter().cycle()).map(|(fraction, axis)| axis.at(*fraction)).collect()
    };
    let search: ConfiguredSearch = DifferentialEvolutionOptions::default().into();
    let begun = |run: u64| {
        let bounds = vec![(0.0, 1.0); axes.len()];
        let (population, generations) = (POPULATION, GENERATIONS);
        Ok(Run::new(search.begin(SearchSettings {
            bounds,
            population,
            generations,
            seed,
            run,
            ..Default::default()
        })?))
    };
    let mut runs = (0..ISLANDS).map(begun).collect::<Result<Vec<Run>>>()?;
    let mut evaluate = |populations: &[Candidates<'_>], costs: &mut [f64]| {
        let fractions: Vec<f64> =
            populations.iter().flat_map(|population| population.values().iter().copied()).collect();
        evaluator.costs(problem, Candidates::new(&values(&fractions), axes.len()), costs)
    };
    let budget = Budget { generations: GENERATIONS, slice: SLICE };
    minimize(&mut runs, budget, &mut evaluate, &mut |_| ControlFlow::Continue(()))?;
    let evaluations = runs.iter().map(|run| run.evaluations).sum();
    let best = |run: &Run| run.optimizer.best().map(|best| values(best.values));
    Ok((runs.iter().filter_map(best).collect(), evaluations))
}
