//! Starts of the refinement of an extended motor.
//!
//! The cost has several optima, because a dead time, a start latency and an averaging sensor are hard to distinguish. The
//! fit is therefore started once from each. A coordinate search evaluates a grid along that axis as one batch (for a dead
//! time this is the cross-correlation of the recording with the simulated output), then grids along the other axes. All
//! results are refined.

use super::refined::Refined;
use super::resampled::best_copy;
use super::rough::RoughProblem;
use motorfit_core::Result;
use motorfit_core::candidates::Candidates;
use motorfit_core::numeric::{rms, standard_deviation};
use motorfit_evaluate::{Batch, Evaluator as _, Group, Model, Problem, Simd};
use motorfit_motor::{Axis, Extension, Parameter, Space};
use motorfit_record::Record;
use std::sync::Arc;

/// Number of intervals of a grid along an axis.
const GRID: u32 = 32;
/// Number of rounds over the axes.
const ROUNDS: usize = 2;
/// Delays of the voltage given to Steiglitz–McBride \[samples\].
const LAGS: [usize; 8] = [0, 1, 2, 5, 10, 20, 40, 80];

/// Returns the grid of values along an axis.
fn grid(axis: &Axis) -> Vec<f64> {
    let range = axis.max - axis.min;
    let points = |of: &dyn Fn(f64) -> f64| (0..=GRID).map(|n| of(f64::from(n) / f64::from(GRID))).collect();
    match axis.parameter {
        // The effect of these depends on the ratio of values, so the grid is geometric.
        Parameter::CurrentAverage | Parameter::SpeedAverage | Parameter::NegativeGain => {
            points(&|share| axis.min * (axis.max / axis.min).powf(share))
        }
        // Small values of these matter too, so the grid is denser there.
        Parameter::Coulomb | Parameter::BrushDrop | Parameter::Deadband | Parameter::DeadTime | Parameter::Latency => {
            points(&|share| axis.min + range * share.powi(2))
        }
        _ => points(&|share| axis.min + range * share),
    }
}

/// Returns the neutral value of an axis, clamped to its bounds.
fn neutral(axis: &Axis) -> f64 {
    axis.parameter.neutral().clamp(axis.min, axis.max)
}

/// Improves a start by a coordinate search: each axis of `order` in turn takes the best value of its grid, evaluated as one
/// batch, in `rounds` rounds. Returns the cost and the start.
pub fn coordinate_search(
    problem: &Arc<Problem>,
    mut start: Vec<f64>,
    order: &[usize],
    rounds: usize,
) -> Result<(f64, Vec<f64>)> {
    let axes = problem.space().free();
    let mut lowest = f64::INFINITY;
    for &moving in std::iter::repeat_n(order, rounds).flatten() {
        let mut points = grid(&axes[moving]);
        points.push(start[moving]);
        let mut values = Vec::with_capacity(points.len() * start.len());
        for point in &points {
            values.extend_from_slice(&start);
            let last = values.len() - start.len();
            values[last + moving] = *point;
        }
        let mut costs = vec![f64::INFINITY; points.len()];
        let candidates = Candidates::new(&values, start.len());
        let groups = [Group { problem, candidates, reference: None }];
        Simd::default().evaluate(&Batch { groups: &groups }, &mut costs)?;
        // The present value is kept unless another one lowers the cost.
        let (mut best, mut cost) = (points.len() - 1, costs[points.len() - 1]);
        for (n, other) in costs.iter().enumerate() {
            if *other < cost * (1.0 - 1e-9) {
                (best, cost) = (n, *other);
            }
        }
        start[moving] = points[best];
        lowest = cost;
    }
    Ok((lowest, start))
}

/// Returns the orders in which a coordinate search takes the extension axes: one for each delay-like parameter, which comes
/// first.
pub(super) fn orders(axes: &[Axis]) -> Vec<Vec<usize>> {
    let extended: Vec<usize> = (0..axes.len()).filter(|n| axes[*n].parameter.is_extension()).collect();
    // These parameters are hard to distinguish, so the fit is started once from each.
    let late = Extension::ALL.into_iter().filter(|e| e.is_delay_like()).flat_map(Extension::parameters).copied();
    let firsts: Vec<Parameter> = late.filter(|p| axes.iter().any(|a| a.parameter == *p)).collect();
    if firsts.len() < 2 {
        return vec![extended];
    }
    let ordered = |first: &Parameter| {
        let is_first = |n: &&usize| axes[**n].parameter == *first;
        extended.iter().filter(is_first).chain(extended.iter().filter(|n| !is_first(n))).copied().collect()
    };
    firsts.iter().map(ordered).collect()
}

/// Returns the problem with rounded times, which suffices to compare starts.
fn coarse(problem: &Problem) -> Arc<Problem> {
    Arc::new(problem.at_coarse_steps())
}

/// Returns the results of a coordinate search from `values` along the extension axes, one for each order.
pub fn coordinate_searched(problem: &Arc<Problem>, values: &[f64]) -> Result<Vec<Vec<f64>>> {
    let problem = &coarse(problem);
    let all = orders(problem.space().free());
    all.iter().map(|order| Ok(coordinate_search(problem, values.to_vec(), order, ROUNDS)?.1)).collect()
}

/// Returns starts in the space of a problem, the lowest cost first: for each motor (R, L, K, B, J) and each order of the
/// extension axes the result of a coordinate search, then starts with a saturation.
pub fn delay_starts(problem: &Arc<Problem>, motors: &[[f64; 5]]) -> Result<Vec<Vec<f64>>> {
    let problem = &coarse(problem);
    let axes = problem.space().free();
    let orders = orders(axes);
    let mut starts: Vec<(f64, Vec<f64>)> = Vec::new();
    for motor in motors {
        for order in &orders {
            let start = coordinate_search(problem, neutral_start(axes, motor), order, ROUNDS)?;
            if !starts.iter().any(|(_, other)| *other == start.1) {
                starts.push(start);
            }
        }
    }
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    starts.truncate(STARTS_MAX);
    starts.extend(limited(problem, motors, &orders[0])?);
    Ok(starts.into_iter().map(|(_, start)| start).collect())
}

/// Returns a motor with extensions at their neutral values, within the bounds.
fn neutral_start(axes: &[Axis], motor: &[f64; 5]) -> Vec<f64> {
    let own = |axis: &Axis| match axis.parameter.is_extension() {
        true => neutral(axis),
        false => motor[axis.parameter as usize].clamp(axis.min, axis.max),
    };
    axes.iter().map(own).collect()
}

/// Returns the values of another model in the space of a problem; parameters that the other model lacks have their neutral
/// value.
pub fn transferred(problem: &Arc<Problem>, (space, values): (&Space, &[f64])) -> Vec<f64> {
    let own = |axis: &Axis| {
        let same = |(other, _): &(&Axis, &f64)| (other.parameter, other.scope) == (axis.parameter, axis.scope);
        let known = space.free().iter().zip(values).find(same).map(|(_, value)| *value);
        known.map_or_else(|| neutral(axis), |value| value.clamp(axis.min, axis.max))
    };
    problem.space().free().iter().map(own).collect()
}

/// Returns the values of another model in the space of a problem, improved by a coordinate search along the parameters that
/// the other model lacks.
pub fn warm_start(problem: &Arc<Problem>, from: (&Space, &[f64])) -> Result<Vec<f64>> {
    Ok(coordinate_search(&coarse(problem), transferred(problem, from), &added(problem.space(), from.0), 1)?.1)
}

/// Returns the values of another model in the space of a problem, improved by a coordinate search along the parameters that
/// it lacks and then along its delays: a delay that compensated for a missing parameter has another optimum. `None` if the
/// other model has no delay.
pub fn warm_start_with_delays(problem: &Arc<Problem>, from: (&Space, &[f64])) -> Option<Result<Vec<f64>>> {
    let mut order = added(problem.space(), from.0);
    let is_delay = |axis: &Axis| matches!(axis.parameter, Parameter::DeadTime | Parameter::Latency);
    let axes = problem.space().free();
    let delays: Vec<usize> = (0..axes.len()).filter(|n| is_delay(&axes[*n]) && !order.contains(n)).collect();
    order.extend(&delays);
    let lowered = || Ok(coordinate_search(&coarse(problem), transferred(problem, from), &order, 1)?.1);
    (!delays.is_empty()).then(lowered)
}

/// Returns the indices of the axes whose parameters another space lacks.
fn added(space: &Space, from: &Space) -> Vec<usize> {
    let has = |axis: &Axis| from.free().iter().any(|other| other.parameter == axis.parameter);
    (0..space.free().len()).filter(|n| !has(&space.free()[*n])).collect()
}

/// Saturation limits that are tried, as fractions of the upper bound.
const LIMITS: [f64; 4] = [0.8, 0.6, 0.45, 0.3];

/// Returns starts with a fixed saturation, improved along the other axes. A search along the saturation axis alone would not
/// find it: the motor was fitted without saturation and has too low a gain, so that any saturation increases the cost.
fn limited(problem: &Arc<Problem>, motors: &[[f64; 5]], order: &[usize]) -> Result<Vec<(f64, Vec<f64>)>> {
    let axes = problem.space().free();
    let Some(place) = axes.iter().position(|axis| axis.parameter == Parameter::Saturation) else {
        return Ok(Vec::new());
    };
    let others: Vec<usize> = order.iter().copied().filter(|n| *n != place).collect();
    let Some(motor) = motors.first() else { return Ok(Vec::new()) };
    let limited = LIMITS.map(|limit| {
        let mut start = neutral_start(axes, motor);
        start[place] = (limit * axes[place].max).max(axes[place].min);
        coordinate_search(problem, start, &others, ROUNDS)
    });
    limited.into_iter().collect()
}

/// Largest number of starts from the coordinate searches that are refined.
const STARTS_MAX: usize = 6;

/// Returns the standard deviation of current \[A\] and speed \[rad/s\] of each recording: the root mean square for a
/// constant channel, and 1 for a channel that was not measured or is zero.
#[must_use]
pub fn signal_deviations(records: &[Record]) -> Vec<Vec<f64>> {
    let of = |signal: Option<&[f64]>| {
        let Some(signal) = signal else { return 1.0 };
        [standard_deviation(signal), rms(signal), 1.0].into_iter().find(|v| *v > 0.0).unwrap_or(1.0)
    };
    records.iter().map(|record| record.measured().map(of).to_vec()).collect()
}

/// Returns the best of the rough refinements of some starts, with the residuals of each channel divided by its `sigma`;
/// `None` if all fail.
pub fn best_start(plain: &Problem, starts: &[Vec<f64>], sigma: &[Vec<f64>]) -> Option<Refined> {
    use rayon::prelude::*;
    let rough = RoughProblem::new(plain);
    let found: Vec<Result<Refined>> = starts.par_iter().map(|start| rough.approach(start, sigma)).collect();
    let near: Vec<Refined> = found.into_iter().flatten().collect();
    let ends = rough.ends(&near, sigma).into_iter().map(|(end, _)| end);
    ends.min_by(|a, b| a.weighted(sigma).total_cmp(&b.weighted(sigma)))
}

/// Returns the motors that Steiglitz–McBride finds with the voltage delayed by 0 to 80 samples, the shortest delay first;
/// for a motor with a dead time one of them is near the true motor. On an irregular clock the copy that fits best without a
/// delay serves for all.
pub fn delayed_estimates(records: &[Record], model: Model) -> Vec<[f64; 5]> {
    let Some(record) = records.iter().max_by_key(|record| record.len()) else { return Vec::new() };
    let mut copy = None;
    let mut one = |lag: &usize| {
        let (place, found) = best_copy(&record.with_delayed_input(*lag), model, copy).ok()?;
        copy = copy.or(place);
        Some(found.ok()?.parameters.to_array())
    };
    LAGS.iter().filter_map(&mut one).collect()
}
