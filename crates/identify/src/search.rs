//! The first optimum of a method: the Steiglitz–McBride estimate, a start from a grid, or the result of a population search.

use super::spec::IdentifySpec;
use crate::device::{BatchSearchEvaluator, DeviceUsed, with_threads_awake};
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_estimate::Estimate;
use motorfit_evaluate::{Problem, Scalar};
use motorfit_motor::Axis;
use motorfit_optimize::{Budget, Progress, Run, Stop, minimize};
use motorfit_record::warning::Warning;
use std::ops::ControlFlow;
use std::sync::Arc;

/// A first optimum with the history of the search.
pub(super) struct SearchResult {
    pub method: &'static str,
    /// Values of the optimum, one per free axis.
    pub values: Vec<f64>,
    pub stop: Stop,
    pub evaluations: u64,
    pub history: Vec<f64>,
    pub device: DeviceUsed,
    pub cost_difference: Option<f64>,
    pub warnings: Vec<Warning>,
    /// True if a population search was run, also if its result was not used.
    pub has_population: bool,
}

impl SearchResult {
    /// Makes a first optimum that was not evaluated on a device.
    pub(super) fn new(method: &'static str, values: Vec<f64>, stop: Stop, evaluations: u64) -> Self {
        Self {
            method,
            values,
            stop,
            evaluations,
            history: Vec::new(),
            device: DeviceUsed::default(),
            cost_difference: None,
            warnings: Vec::new(),
            has_population: false,
        }
    }

    /// Makes a first optimum from an estimate, clamped to the bounds of a problem and not evaluated on a device.
    pub(super) fn of_estimate(estimate: &Estimate, problem: &Problem) -> Self {
        let value = |axis: &Axis| estimate.parameters.get(axis.parameter).clamp(axis.min, axis.max);
        let values = problem.space().free().iter().map(value).collect();
        Self::new("sm", values, Stop::Converged, estimate.iterations as u64)
    }

    /// Adds the description of the device, and the difference of its cost to that of the scalar oracle.
    fn on(self, mut evaluation: BatchSearchEvaluator) -> Self {
        let cost_difference = evaluation.cost_difference(0, &self.values);
        let device = evaluation.device();
        Self { cost_difference, device, warnings: evaluation.take_warnings(), ..self }
    }
}

/// Returns an estimate as a first optimum of a problem, evaluated on the requested device as well.
pub(super) fn taken(estimate: &Estimate, spec: &IdentifySpec, problem: &Arc<Problem>) -> Result<SearchResult> {
    let evaluation = BatchSearchEvaluator::for_check(spec, problem.clone())?;
    Ok(SearchResult::of_estimate(estimate, problem).on(evaluation))
}

/// Returns given values as a first optimum of a problem, evaluated on the requested device as well.
pub(super) fn evaluated(problem: &Arc<Problem>, spec: &IdentifySpec, values: Vec<f64>) -> Result<SearchResult> {
    let evaluation = BatchSearchEvaluator::for_check(spec, problem.clone())?;
    Ok(SearchResult::new("grid", values, Stop::Converged, 0).on(evaluation))
}

/// Runs the population search of the spec.
///
/// # Errors
/// Propagates the errors of the method and the device, and returns `NotIdentified` if no candidate has a finite cost.
pub(super) fn population(
    problem: &Arc<Problem>,
    spec: &IdentifySpec,
    observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<SearchResult> {
    let generations = spec.generations;
    let mut runs = [Run::new(spec.method.optimizer(spec.search(problem.space()))?)];
    let mut evaluation = BatchSearchEvaluator::open(spec, vec![problem.clone()])?;
    let slice = evaluation.slice();
    let is_on_cpu = evaluation.device().kind == "cpu";
    let steps = if is_on_cpu { spec.population.saturating_mul(problem.active()) } else { 0 };
    let mut search = || minimize(&mut runs, Budget { generations, slice }, &mut evaluation, &mut *observe);
    let stop = with_threads_awake(steps, &mut search)?;
    let [Run { optimizer, history, evaluations }] = runs;
    let best = optimizer.best().filter(|best| Scalar::cost(problem, best.values).is_finite());
    let Some(best) = best else {
        let message = format!("all {evaluations} candidates diverge");
        let zoh = text!([Discretization = "zoh"] " cannot diverge numerically.");
        return Err(Error::not_identified(message, text!("Check the units of the recording and " [Bounds] "; " {zoh})));
    };
    let method = spec.method.search().map_or("", |tuned| tuned.search.name);
    let found = SearchResult::new(method, best.values.to_vec(), stop, evaluations);
    Ok(SearchResult { history, has_population: true, ..found.on(evaluation) })
}
