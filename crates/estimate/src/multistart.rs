//! Multistart: refinements from starts spread over the box.
//!
//! A lower optimum whose region of attraction is a fraction p of the box is missed by n independent starts with the probability
//! (1 - p)ⁿ. Where a motor has properties that the model lacks, the lowest optima of simulated motors had regions from a tenth of the box
//! on, which 24 starts miss in up to 8 % of cases and six in up to 53 %. All starts are therefore refined, however many end together. A dense
//! sample finds such an optimum less often in more time: the lowest of 262,144 points tends to the largest region.
//!
//! A Latin hypercube is evaluated as one batch and cut into as many blocks as there are starts. The best point of a block is a start; where
//! the lowest optimum of a linear motor is searched, every second block is a single point, because the best points tend to the largest region. With extensions, every other start is first improved by a coordinate search along the extension axes; each of these searches begins with
//! the next of the delay-like axes.

use super::refine::{Effort, refine_problem};
use super::refined::Refined;
use super::rough::{RoughProblem, is_same};
use super::starts::{coordinate_search, orders};
use motorfit_core::Result;
use motorfit_core::candidates::Candidates;
use motorfit_core::numeric::count;
use motorfit_evaluate::{Batch, Evaluator as _, Group, Problem, Simd};
use motorfit_motor::Axis;
use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use std::sync::Arc;

/// Number of refinements that must end in the lowest optimum before it counts as the global one.
pub(super) const ARRIVALS: usize = 3;
/// Largest number of starts.
const STARTS: usize = 24;
/// Smallest number of starts, used for long recordings.
const STARTS_MIN: usize = 6;
/// Largest number of samples simulated per refinement step, summed over all starts; a sample takes some 0.1 µs.
const SAMPLES: usize = 1_000_000;
/// Largest number of candidates of the hypercube for each start.
const CANDIDATES: usize = 32;
/// Largest number of candidate-steps to evaluate the hypercube.
const CANDIDATE_STEPS: usize = 200_000_000;

/// The lowest optimum that a multistart found.
pub(super) struct Ends {
    pub refined: Refined,
    /// Number of starts that were refined.
    pub starts: usize,
    /// Number of refinements that ended in this optimum.
    pub arrivals: usize,
}

/// Refines starts spread over the box of a problem and returns the lowest sum of squares weighted by `sigma` in which they end.
///
/// # Errors
/// Returns a usage error if no parameter is free, and propagates the errors of the batch evaluation and of
/// [`super::refine`].
pub(super) fn multistart(problem: &Problem, sigma: &[Vec<f64>]) -> Result<Ends> {
    let starts = starts(problem, sigma, problem.features().is_linear())?;
    let rough = RoughProblem::new(problem);
    let near: Vec<Refined> = starts.par_iter().filter_map(|start| rough.approach(start, sigma).ok()).collect();
    let ends = rough.ends(&near, sigma);
    let (cost, arrivals) = lowest(&ends, sigma);
    let best = ends.iter().map(|(end, _)| end).find(|end| end.weighted(sigma) <= cost);
    let start =
        best.map_or_else(|| problem.space().free().iter().map(Axis::middle).collect(), |end| end.values.clone());
    let best = refine_problem(problem, &start, Some(sigma), Effort::Thorough)?;
    Ok(Ends { refined: best, starts: starts.len(), arrivals })
}

/// Refines starts spread over the box and returns the refinements, one per start, whose sum of squares weighted by `sigma` is
/// at most `limit`. The problem must be made by [`super::fit_problem`].
///
/// # Errors
/// Returns a usage error if no parameter is free, and propagates the errors of the batch evaluation.
pub fn optima(problem: &Problem, sigma: &[Vec<f64>], limit: f64) -> Result<Vec<Refined>> {
    let (starts, rough) = (starts(problem, sigma, false)?, RoughProblem::new(problem));
    let ends = starts.par_iter().filter_map(|start| rough.refine(start, sigma).ok());
    Ok(ends.filter(|end| end.weighted(sigma) <= limit).collect())
}

/// Returns the lowest weighted sum of squares of the optima and the number of refinements that ended there.
fn lowest(ends: &[(Refined, usize)], sigma: &[Vec<f64>]) -> (f64, usize) {
    let costs: Vec<(f64, usize)> = ends.iter().map(|(end, count)| (end.weighted(sigma), *count)).collect();
    let lowest = costs.iter().map(|(cost, _)| *cost).fold(f64::INFINITY, f64::min);
    let arrivals = costs.iter().filter(|(cost, _)| is_same(*cost, lowest)).map(|(_, count)| count).sum();
    (lowest, arrivals)
}

/// Returns the best point of each block of a Latin hypercube; with `any`, every second block is a single point.
fn starts(problem: &Problem, sigma: &[Vec<f64>], any: bool) -> Result<Vec<Vec<f64>>> {
    if problem.space().free().is_empty() {
        let message = "every parameter is fixed: there is no box to search";
        return Err(motorfit_core::Error::usage(message, "Leave at least one parameter free."));
    }
    let steps = problem.active().max(1);
    let count = (SAMPLES / steps).clamp(STARTS_MIN, STARTS);
    let part = (CANDIDATE_STEPS / steps / count).clamp(1, CANDIDATES);
    let sizes: Vec<usize> = (0..count).map(|n| if any && n % 2 == 1 { 1 } else { part }).collect();
    let points = hypercube(problem.space().free(), sizes.iter().sum());
    // Starts need not be exact, so their costs may be computed on rounded times.
    let problem = Arc::new(problem.weighted_by(sigma).at_coarse_steps());
    let costs = costs(&problem, &points)?;
    let axes = problem.space().free();
    let orders = if problem.features().is_linear() { Vec::new() } else { orders(axes) };
    let mut first = 0;
    let start = |(n, size): (usize, usize)| -> Result<Vec<f64>> {
        let best = (first..first + size).min_by(|a, b| costs[*a].total_cmp(&costs[*b])).unwrap_or(first);
        first += size;
        let point = points[best * axes.len()..(best + 1) * axes.len()].to_vec();
        match n % 2 == 1 && !orders.is_empty() {
            true => Ok(coordinate_search(&problem, point, &orders[n / 2 % orders.len()], 1)?.1),
            false => Ok(point),
        }
    };
    sizes.into_iter().enumerate().map(start).collect()
}

fn costs(problem: &Arc<Problem>, points: &[f64]) -> Result<Vec<f64>> {
    let candidates = Candidates::new(points, problem.space().free().len());
    let mut costs = vec![f64::INFINITY; candidates.count()];
    Simd::default().evaluate(&Batch { groups: &[Group { problem, candidates, reference: None }] }, &mut costs)?;
    Ok(costs)
}

/// Returns a Latin hypercube in the coordinates of the axes, point by point: each axis is cut into as many intervals as
/// there are points, and each interval holds one point.
fn hypercube(axes: &[Axis], size: usize) -> Vec<f64> {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut points = vec![0.0; axes.len() * size];
    for (n, axis) in axes.iter().enumerate() {
        let mut parts: Vec<u32> = (0..).take(size).collect();
        for last in (1..size).rev() {
            parts.swap(last, generator.random_range(0..=last));
        }
        let [low, high] = [axis.min, axis.max].map(|bound| axis.coordinate(bound));
        for (point, part) in points.chunks_exact_mut(axes.len()).zip(parts) {
            let share = (f64::from(part) + generator.random::<f64>()) / count(size);
            point[n] = axis.value(low + share * (high - low));
        }
    }
    points
}
