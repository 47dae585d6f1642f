//! Directions that are known on one side only: an estimate may end where a limit, or friction that sticks, begins to act. The derivatives
//! there take the direction for known, while on the other side the recordings leave it open.
//!
//! The estimate is moved along the least known direction by some standard errors to either side. Where the information then has a
//! direction that is known far less, the direction is open.

use super::fit::Fit;
use super::fitted::Fitted;
use super::refined::Refined;
use super::uncertainty::{marginal, takes_part_in};
use motorfit_core::coordinate::Coordinate;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Length of the step \[standard errors\], and the longest of a coordinate: a factor of e, or the range of the parameter.
const STEP: f64 = 4.0;
const LONGEST: f64 = 1.0;
/// Ratio of the information on the least known direction beside an estimate to that at it from which the direction is open. Where a step
/// is a factor of e, smooth equations change the information by some e².
const RATIO: f64 = 0.02;

/// Marks the parameters of the least known direction as not identified where it is known on one side only.
pub(super) fn open_flat(problem: &dyn Fitted, refined: &mut Refined) {
    if !refined.suits(problem) {
        return;
    }
    let Some((own, direction)) = information(problem, refined, &refined.values).and_then(|of| least(&of)) else {
        return;
    };
    let beside = [-1.0, 1.0].map(|side| least_beside(problem, refined, &direction, side / own.sqrt()));
    if !beside.iter().flatten().any(|other| *other < RATIO * own) {
        return;
    }
    let of = &mut refined.uncertainty;
    for (a, row) in of.covariance.iter_mut().enumerate() {
        row.iter_mut().zip(direction.iter()).for_each(|(entry, b)| *entry -= direction[a] * b / own);
    }
    let parts = takes_part_in(problem, &refined.values, direction.as_slice());
    for (n, _) in parts.iter().enumerate().filter(|(_, takes_part)| **takes_part) {
        of.forget(n);
        of.open[n] = true;
    }
    of.rank = of.rank.saturating_sub(1);
    of.unidentifiable.push(direction.as_slice().to_vec());
}

/// Returns the information on the least known direction beside an estimate, at [`STEP`] times an error along a direction; `None` beyond a
/// bound.
fn least_beside(problem: &dyn Fitted, refined: &Refined, direction: &DVector<f64>, error: f64) -> Option<f64> {
    let longest = LONGEST / direction.amax();
    let by = (STEP * error).clamp(-longest, longest);
    let moved = |(n, axis): (usize, &Coordinate)| {
        let at = axis.of(refined.values[n]) + by * direction[n];
        let value = axis.value(at);
        let is_inside = (axis.of(value) - at).abs() <= 1e-9 * at.abs().max(1.0);
        is_inside.then_some(value)
    };
    let values = problem.axes().iter().enumerate().map(moved).collect::<Option<Vec<f64>>>()?;
    least(&information(problem, refined, &values)?).map(|(information, _)| information)
}

/// The information on the parameters that are identified and not at a bound.
struct Known {
    matrix: DMatrix<f64>,
    /// Numbers of these parameters.
    moving: Vec<usize>,
    /// Number of all free parameters.
    axes: usize,
}

/// Returns the information on the parameters that are identified and not at a bound; `None` if the machine diverges.
fn information(problem: &dyn Fitted, refined: &Refined, values: &[f64]) -> Option<Known> {
    let fit = Fit::new(problem);
    let (matrix, _) = fit.weighted(&fit.normal(&fit.at(values, &refined.initial))?, &refined.weights);
    let axes = fit.axes.len();
    let is_known = |n: &usize| refined.at_bound[*n].is_none() && !refined.uncertainty.open[*n];
    let moving: Vec<usize> = (0..axes).filter(is_known).collect();
    let (own, _) = marginal(&matrix, &moving, &(axes..fit.unknowns).collect::<Vec<_>>());
    let is_finite = own.iter().all(|value| value.is_finite());
    (is_finite && !moving.is_empty()).then_some(Known { matrix: own, moving, axes })
}

/// Returns the least known direction with its information, over all parameters.
fn least(Known { matrix, moving, axes }: &Known) -> Option<(f64, DVector<f64>)> {
    let SymmetricEigen { eigenvalues, eigenvectors } = SymmetricEigen::new(matrix.clone());
    let least = (0..moving.len()).min_by(|a, b| eigenvalues[*a].total_cmp(&eigenvalues[*b]))?;
    let mut direction = DVector::zeros(*axes);
    moving.iter().enumerate().for_each(|(place, axis)| direction[*axis] = eigenvectors[(place, least)]);
    Some((eigenvalues[least].max(0.0), direction))
}
