//! Empirical distributions of the evaluations and times until runs reach target costs.
//!
//! As in the COCO platform (Hansen, Auger, Ros, Mersmann, Tušar and Brockhoff 2021), a curve is the fraction of all
//! pairs of a run and a target that have been reached. Targets are equally spaced in the logarithm of the cost.

use super::result::{Block, MethodResult};
use motorfit_core::numeric::{count, quantile, sorted};

/// Number of targets between the first generations and the lowest cost.
const TARGETS: usize = 51;

/// Fraction of targets that a method has reached, over evaluations and time.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Reached {
    /// Evaluations of a run after each generation.
    pub evaluations: Vec<f64>,
    /// Time of a single run until the end of each generation \[s\]; empty if it was not measured.
    pub seconds: Vec<f64>,
    /// Fraction of all pairs of a run and a target reached after each generation, from 0 to 1.
    pub share: Vec<f64>,
}

/// Returns the targets and, for each method, the fraction reached. `target` is a single cost; `None` takes a range of
/// targets.
#[must_use]
pub fn reached(block: &Block, target: Option<f64>) -> (Vec<f64>, Vec<Reached>) {
    let targets = target.map_or_else(|| range(block), |target| vec![target]);
    let share = |result: &MethodResult| {
        let generations = result.runs.iter().map(|run| run.history.len()).max().unwrap_or(0);
        let (pairs, agents, all) = (
            count((result.runs.len() * targets.len()).max(1)),
            count(block.setting.population),
            count(block.setting.generations),
        );
        let by = |generation: usize| {
            let cost = |run: &super::result::Outcome| run.history.get(generation).or(run.history.last()).copied();
            let met = |cost: f64| targets.iter().filter(|target| cost <= **target).count();
            count(result.runs.iter().filter_map(cost).map(met).sum()) / pairs
        };
        let evaluations: Vec<f64> = (1..=generations).map(|g| count(g) * agents).collect();
        let seconds = result
            .seconds
            .map_or(Vec::new(), |total| evaluations.iter().map(|count| total * count / (agents * all)).collect());
        Reached { evaluations, seconds, share: (0..generations).map(by).collect() }
    };
    let reached = block.results.iter().map(share).collect();
    (targets, reached)
}

/// Returns the targets from the median cost after the first generation down to the lowest cost of all runs, the easiest
/// first.
fn range(block: &Block) -> Vec<f64> {
    let runs = || block.results.iter().flat_map(|result| &result.runs);
    let firsts = runs().filter_map(|run| run.history.first().copied()).filter(|cost| cost.is_finite());
    let firsts = sorted(&firsts.collect::<Vec<_>>());
    let easiest = quantile(&firsts, 0.5);
    let hardest = runs().filter_map(|run| run.history.last().copied()).fold(f64::INFINITY, f64::min);
    if !(easiest.is_finite() && hardest.is_finite()) {
        return Vec::new();
    }
    let (top, bottom) = (easiest.max(1e-300).ln(), hardest.max(1e-12 * easiest).max(1e-300).ln());
    let target = |n: usize| (top + (bottom - top) * count(n) / count(TARGETS - 1)).exp() * (1.0 + 1e-12);
    (0..TARGETS).map(target).collect()
}
