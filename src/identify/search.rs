//! The two ways to a first optimum: Steiglitz–McBride and a population search.

use super::device::Opened;
use super::lockstep::Lockstep;
use super::not_identified;
use super::spec::IdentifySpec;
use super::warnings::Warning;
use crate::Result;
use crate::estimate::{Estimate, SmFailure, SmOptions, try_steiglitz_mcbride, try_steiglitz_mcbride_on};
use crate::evaluate::{Problem, Scalar};
use crate::motor::{Axis, Space};
use crate::optimize::{Budget, Progress, Run, Setup, Stop, minimize};
use crate::record::Record;
use crate::setting::text;
use std::ops::ControlFlow;
use std::sync::Arc;

/// A first optimum.
pub(super) struct Found {
    pub method: &'static str,
    /// One value per free axis.
    pub values: Vec<f64>,
    pub stop: Stop,
    pub evaluations: u64,
    pub history: Vec<f64>,
    pub device_kind: &'static str,
    pub device: String,
    pub precision: &'static str,
    pub cost_difference: Option<f64>,
    pub warnings: Vec<Warning>,
}

/// The Steiglitz–McBride estimate of each recording, and of these the one that costs least on all. `plain` is the
/// problem of a fit to the recordings.
pub(super) fn steiglitz_mcbride(
    records: &[Record],
    spec: &IdentifySpec,
    plain: &Problem,
) -> Result<std::result::Result<Estimate, SmFailure>> {
    let options = SmOptions { model: spec.model, sigma: None };
    // Where the voltage is a line over each step the fit has another method than this one.
    let is_same = *plain.model() == spec.model;
    let one = |(n, record): (usize, &Record)| match is_same {
        true => try_steiglitz_mcbride_on(plain, n, None),
        false => try_steiglitz_mcbride(record, &options),
    };
    if let [record] = records {
        return one((0, record));
    }
    let mut best: std::result::Result<Estimate, SmFailure> = Err(SmFailure::ChannelMissing);
    let mut lowest = f64::INFINITY;
    let problem = Problem::new(records, spec.model, Space::table2(), spec.criterion)?;
    for found in records.iter().enumerate().map(one) {
        match (found?, &best) {
            (Ok(found), _) => {
                let cost = Scalar::cost(&problem, &found.parameters.to_array());
                if best.is_err() || cost < lowest {
                    (best, lowest) = (Ok(found), cost);
                }
            }
            (Err(failure), Err(_)) => best = Err(failure),
            (Err(_), Ok(_)) => {}
        }
    }
    Ok(best)
}

/// The space with a decade to each side of an estimate for the axes that have no bounds of their own.
pub(super) fn around(spec: &IdentifySpec, estimate: &Estimate) -> Result<Space> {
    let decade = |axis: &Axis| {
        if !spec.auto_bounds.contains(&axis.parameter) {
            return *axis;
        }
        let value = estimate.parameters.get(axis.parameter);
        Axis { min: 0.1 * value, max: 10.0 * value, ..*axis }
    };
    Space::new(spec.space.free().iter().map(decade).collect(), spec.space.fixed().to_vec())
}

/// An estimate as a first optimum of a problem. A device that is asked for evaluates it too.
pub(super) fn taken(estimate: &Estimate, spec: &IdentifySpec, problem: &Arc<Problem>) -> Result<Found> {
    let inside = |axis: &Axis| estimate.parameters.get(axis.parameter).clamp(axis.min, axis.max);
    let values: Vec<f64> = problem.space().free().iter().map(inside).collect();
    Ok(Found { method: "sm", evaluations: estimate.iterations as u64, ..evaluated(problem, spec, values)? })
}

/// Values as a first optimum of a problem, by nothing but its costs. A device that is asked for evaluates them too.
pub(super) fn evaluated(problem: &Arc<Problem>, spec: &IdentifySpec, values: Vec<f64>) -> Result<Found> {
    let mut evaluation = Lockstep::on(Opened::for_check(spec, problem)?, vec![problem.clone()]);
    let cost_difference = evaluation.cost_difference(0, &values);
    let (device_kind, device, precision) = evaluation.device();
    Ok(Found {
        method: "grid",
        stop: Stop::Converged,
        evaluations: 0,
        history: Vec::new(),
        cost_difference,
        device_kind,
        device,
        precision,
        warnings: evaluation.take_warnings(),
        values,
    })
}

/// What a population search starts from.
pub(super) fn setup(spec: &IdentifySpec, space: &Space) -> Setup {
    let &IdentifySpec { population, generations, seed, .. } = spec;
    Setup { bounds: space.bounds(), population, generations, seed, run: 0 }
}

/// A population search.
pub(super) fn population(
    problem: &Arc<Problem>,
    spec: &IdentifySpec,
    observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Found> {
    let generations = spec.generations;
    let mut runs = [Run::new(spec.method.optimizer(setup(spec, problem.space()))?)];
    let mut evaluation = Lockstep::on(Opened::for_search(spec, problem)?, vec![problem.clone()]);
    let slice = evaluation.slice();
    let stop = minimize(&mut runs, Budget { generations, slice }, &mut evaluation, observe)?;
    let [run] = runs;
    let best = run.optimizer.best().filter(|best| Scalar::cost(problem, best.values).is_finite());
    let Some(best) = best else {
        return Err(not_identified(
            format!("all {} candidates diverge", run.evaluations),
            text!(
                "Check the units of the recording and " [Bounds] "; " [Discretization = "zoh"]
                " cannot diverge by itself."
            ),
        ));
    };
    let cost_difference = evaluation.cost_difference(0, best.values);
    let (device_kind, device, precision) = evaluation.device();
    Ok(Found {
        method: spec.method.search().map_or("", |tuned| tuned.search.name),
        values: best.values.to_vec(),
        stop,
        evaluations: run.evaluations,
        history: run.history,
        device_kind,
        device,
        precision,
        cost_difference,
        warnings: evaluation.take_warnings(),
    })
}
