//! Where a refinement of an extended motor begins. Its cost has several optima: a dead time, a late start and a sensor
//! that averages imitate each other. So each is tried as the first explanation: along its axis a whole grid is evaluated
//! at once (for a dead time that is the cross-correlation of the recording with what the motor would have done), then
//! along the others, and every end is refined.

use super::super::spec::IdentifySpec;
use crate::Result;
use crate::candidates::Candidates;
use crate::estimate::{Refined, SmOptions, refine_roughly, try_steiglitz_mcbride};
use crate::evaluate::{Batch, Evaluator as _, Group, Problem, Simd};
use crate::motor::{Axis, Parameter};
use crate::record::Record;
use std::sync::Arc;

/// Points of a grid along an axis.
const GRID: u32 = 32;
/// Rounds over the axes.
const ROUNDS: usize = 2;
/// Parameters that imitate each other: each is tried as the first explanation.
const LATE: [Parameter; 4] =
    [Parameter::DeadTime, Parameter::Latency, Parameter::CurrentAverage, Parameter::SpeedAverage];
/// Lags in samples by which Steiglitz–McBride is given the voltage later.
const LAGS: [usize; 8] = [0, 1, 2, 5, 10, 20, 40, 80];

/// Values along an axis that are tried.
fn grid(axis: &Axis) -> Vec<f64> {
    let range = axis.max - axis.min;
    let share = |n: u32, of: u32| f64::from(n) / f64::from(of);
    match axis.parameter {
        // What counts is the ratio.
        Parameter::CurrentAverage | Parameter::SpeedAverage | Parameter::ReverseGain => {
            (0..=GRID).map(|n| axis.min * (axis.max / axis.min).powf(share(n, GRID))).collect()
        }
        // Small ones matter too.
        Parameter::Coulomb | Parameter::BrushDrop | Parameter::Deadband => {
            (0..=GRID).map(|n| axis.min + range * share(n, GRID).powi(2)).collect()
        }
        _ => (0..=GRID).map(|n| axis.min + range * share(n, GRID)).collect(),
    }
}

/// The neutral value of an axis, or what within its bounds is nearest to it.
fn neutral(axis: &Axis) -> f64 {
    axis.parameter.neutral().clamp(axis.min, axis.max)
}

/// Lowers the cost along one axis after the other, all points of an axis at once.
fn descend(problem: &Arc<Problem>, start: &mut [f64], order: &[usize]) -> Result<f64> {
    let axes = problem.space().free();
    let mut lowest = f64::INFINITY;
    for &place in order {
        let mut points = grid(&axes[place]);
        points.push(start[place]);
        let mut values = Vec::with_capacity(points.len() * start.len());
        for point in &points {
            values.extend_from_slice(start);
            let last = values.len() - start.len();
            values[last + place] = *point;
        }
        let mut costs = vec![f64::INFINITY; points.len()];
        let candidates = Candidates::new(&values, start.len());
        let groups = [Group { problem, candidates, reference: None }];
        Simd::default().evaluate(&Batch { groups: &groups }, &mut costs)?;
        // Where others are as good, what was there stays.
        let (mut best, mut cost) = (points.len() - 1, costs[points.len() - 1]);
        for (n, other) in costs.iter().enumerate() {
            if *other < cost * (1.0 - 1e-9) {
                (best, cost) = (n, *other);
            }
        }
        start[place] = points[best];
        lowest = cost;
    }
    Ok(lowest)
}

/// Starts in the space of a problem: for each motor (R, L, K, B, J), each way to explain what is late, the rest after it.
pub(in super::super) fn explained(problem: &Arc<Problem>, motors: &[[f64; 5]]) -> Result<Vec<Vec<f64>>> {
    let axes = problem.space().free();
    let extended: Vec<usize> = (0..axes.len()).filter(|n| axes[*n].parameter.is_extension()).collect();
    let mut firsts: Vec<Parameter> = LATE.into_iter().filter(|p| axes.iter().any(|a| a.parameter == *p)).collect();
    if firsts.len() < 2 {
        firsts.truncate(1);
    }
    let orders: Vec<Vec<usize>> = if firsts.is_empty() {
        vec![extended]
    } else {
        let ordered = |first: &Parameter| {
            let is_first = |n: &&usize| axes[**n].parameter == *first;
            extended.iter().filter(is_first).chain(extended.iter().filter(|n| !is_first(n))).copied().collect()
        };
        firsts.iter().map(ordered).collect()
    };
    let mut starts: Vec<(f64, Vec<f64>)> = Vec::new();
    for motor in motors {
        for order in &orders {
            let own = |axis: &Axis| match axis.parameter.is_extension() {
                true => neutral(axis),
                false => motor[axis.parameter as usize].clamp(axis.min, axis.max),
            };
            let mut start: Vec<f64> = axes.iter().map(own).collect();
            let mut cost = f64::INFINITY;
            for _ in 0..ROUNDS {
                cost = descend(problem, &mut start, order)?;
            }
            if !starts.iter().any(|(_, other)| *other == start) {
                starts.push((cost, start));
            }
        }
    }
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(starts.into_iter().map(|(_, start)| start).collect())
}

/// Starts that are refined at most.
const REFINED: usize = 6;

/// The best of the rough refinements of some starts, each channel divided by its standard deviation.
pub(in super::super) fn best_start(plain: &Problem, starts: &[Vec<f64>], sigma: &[[f64; 2]]) -> Option<Refined> {
    use rayon::prelude::*;
    let refined = starts.par_iter().take(REFINED).map(|start| refine_roughly(plain, start, sigma));
    let ends: Vec<Result<Refined>> = refined.collect();
    ends.into_iter().flatten().min_by(|a, b| a.weighted(sigma).total_cmp(&b.weighted(sigma)))
}

/// Motors that Steiglitz–McBride finds when the voltage comes later by some samples, the earliest first: with a dead time
/// of about that, the right one is among them.
pub(in super::super) fn lagged(records: &[Record], spec: &IdentifySpec) -> Vec<[f64; 5]> {
    let options = SmOptions { model: spec.model, sigma: None };
    let longest = records.iter().max_by_key(|record| record.len());
    let of = |record: &Record, lag: &usize| {
        let late = record.with_late_voltage(*lag);
        Some(try_steiglitz_mcbride(&late, &options).ok()?.ok()?.parameters.to_array())
    };
    longest.map_or_else(Vec::new, |record| LAGS.iter().filter_map(|lag| of(record, lag)).collect())
}
