//! A global reference: the lowest weighted sum of squares that a search over the whole box finds.

use super::normal::{Fit, Sigma};
use super::projection;
use super::refine::{Effort, refine_problem};
use super::refined::Refined;
use super::starts::best_start;
use crate::Result;
use crate::evaluate::Problem;
use crate::motor::Axis;
use crate::numeric;
use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;

/// How the reference was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ReferenceKind {
    /// The two-dimensional search of the linear motor, each basin refined.
    VariableProjection,
    /// Refinements from points all over the box.
    MultiStart,
}

/// The best fit within the bounds that a search of the whole box finds.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// How.
    pub kind: ReferenceKind,
    /// The fit.
    pub refined: Refined,
}

/// Basins that are refined, and starts of a multi-start.
const BASINS: usize = 4;
const STARTS: usize = 24;
/// With extensions derivatives cost some twenty times as much: fewer starts for long recordings.
const EXTENDED_SAMPLES: usize = 20_000;
const STARTS_MIN: usize = 2;

/// Searches the whole box of a problem that [`super::fit_problem`] has made for the lowest sum of squares weighted by
/// `sigma`, one pair for each recording.
///
/// # Errors
/// As for [`super::refine`]; `NotIdentified` when the motor diverges everywhere.
pub fn global_reference(problem: &Problem, sigma: &[[f64; 2]]) -> Result<Reference> {
    let sigma = &sigma.to_vec();
    let scattered = || lowest(problem, &scattered(problem), sigma);
    if !projection::applies(problem) {
        return Ok(Reference { kind: ReferenceKind::MultiStart, refined: scattered()? });
    }
    let axes = problem.space().free();
    let in_order = |start: &[f64; 5]| axes.iter().map(|axis| start[axis.parameter as usize]).collect();
    let starts: Vec<Vec<f64>> = projection::basins(problem, sigma, BASINS).iter().map(in_order).collect();
    let mut refined = lowest(problem, &starts, sigma)?;
    if refined.at_bound.iter().any(Option::is_some) {
        // The projection knows no bounds: where one is in the way, other starts may lead around it.
        let other = scattered()?;
        if other.weighted(sigma) < refined.weighted(sigma) {
            refined = other;
        }
    }
    Ok(Reference { kind: ReferenceKind::VariableProjection, refined })
}

/// The lowest refinement of some starts, or of the middle of the box where there are none.
fn lowest(problem: &Problem, starts: &[Vec<f64>], sigma: &Sigma) -> Result<Refined> {
    let refine = |start: &[f64]| refine_problem(problem, start, Some(sigma), Effort::Thorough);
    best_start(problem, starts, sigma).map_or_else(|| refine(&middle(problem)), |best| refine(&best.values))
}

fn middle(problem: &Problem) -> Vec<f64> {
    problem.space().free().iter().map(Axis::middle).collect()
}

/// A Latin hypercube in the coordinates of the axes: each axis is cut into as many parts as there are starts, and each part is used
/// once.
fn scattered(problem: &Problem) -> Vec<Vec<f64>> {
    let axes = problem.space().free();
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(1);
    let count = if problem.features().is_linear() {
        STARTS
    } else {
        (EXTENDED_SAMPLES / problem.active().max(1)).clamp(STARTS_MIN, STARTS)
    };
    let mut starts = vec![vec![0.0; axes.len()]; count];
    for (n, axis) in axes.iter().enumerate() {
        let mut parts: Vec<u32> = (0..).take(count).collect();
        for last in (1..count).rev() {
            parts.swap(last, generator.random_range(0..=last));
        }
        for (start, part) in starts.iter_mut().zip(parts) {
            let share = (f64::from(part) + generator.random::<f64>()) / numeric::count(count);
            let [low, high] = [axis.min, axis.max].map(|bound| axis.coordinate(bound));
            start[n] = axis.value(low + share * (high - low));
        }
    }
    starts.push(middle(problem));
    starts
}

/// Returns the sums of squared residuals \[A², rad²/s²\] of each recording at `values`, initial states as the problem, one
/// that [`super::fit_problem`] has made, has them.
#[must_use]
pub fn squares_on(problem: &Problem, values: &[f64]) -> Vec<[f64; 2]> {
    let fit = Fit::new(problem);
    fit.normal(&fit.start(values)).all_squares()
}
