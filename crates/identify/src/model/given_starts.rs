//! Given starts: descents from them may lead to a better optimum, and change nothing else of a search.

use super::fine_steps::{fitted_at, is_better, with_fine_steps};
use super::islands::islands;
use super::result::ModelFit;
use motorfit_core::{ErrorKind, Result};
use motorfit_estimate::Refined;
use motorfit_estimate::model::{ModelEnd, ModelOptima, ModelStarts, model_ends, model_optima, refine_model};
use motorfit_evaluate::Evaluator;
use motorfit_evaluate::model::{ModelAxis, ModelProblem};
use std::ops::ControlFlow;

/// Given starts and the ends of the descents from them with the steps and weights of the search.
#[derive(Debug, Default)]
pub(super) struct GivenStarts {
    starts: Vec<Vec<f64>>,
    pub ends: Vec<ModelEnd>,
    /// Number of simulations of the descents.
    pub simulations: u64,
}

impl GivenStarts {
    /// Descends from starts.
    pub fn new(problem: &ModelProblem, starts: Vec<Vec<f64>>) -> Result<Self> {
        let (ends, simulations) = model_ends(problem, &starts)?;
        Ok(Self { starts, ends, simulations })
    }

    /// Descends from another start.
    pub fn add(&mut self, problem: &ModelProblem, start: &[f64]) -> Result<()> {
        let more = Self::new(problem, vec![start.to_vec()])?;
        self.starts.extend(more.starts);
        self.ends.extend(more.ends);
        self.simulations += more.simulations;
        Ok(())
    }

    /// Returns the end that is lower than a cost of the search, if there is one; the lowest of several.
    pub fn lower_than(&self, cost: f64) -> Option<&ModelEnd> {
        let lower = self.ends.iter().filter(|end| end.cost < cost);
        lower.min_by(|a, b| a.cost.total_cmp(&b.cost))
    }
}

/// Searches without the given starts, so that the other starts and their random numbers do not depend on them, and descends from the given
/// ones; with them, if the model diverges from all others.
pub(super) fn optima_beside(
    problem: &ModelProblem,
    evaluator: &mut dyn Evaluator<ModelProblem>,
    seed: u64,
    given: &[Vec<f64>],
    observe: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<(ModelOptima, GivenStarts)> {
    let mut of = |given| {
        let starts = ModelStarts { given, populations: &mut islands };
        model_optima(problem, evaluator, seed, starts, observe)
    };
    let optima = match of(&[]) {
        Err(error) if error.kind() == ErrorKind::NotIdentified && !given.is_empty() => of(given)?,
        optima => optima?,
    };
    let given = match optima.is_interrupted {
        true => GivenStarts::default(),
        false => GivenStarts::new(problem, given.to_vec())?,
    };
    Ok((optima, given))
}

/// Returns the first given start, or else the usual values of the free parameters if all have one.
fn first_start(problem: &ModelProblem, given: &[Vec<(String, f64)>]) -> Option<Vec<f64>> {
    let given = problem.space().starts(problem.model(), given).ok()?;
    let usual = || {
        let of = |axis: &ModelAxis| problem.model().parameters().get(axis.parameter)?.value;
        problem.space().free.iter().map(of).collect::<Option<Vec<f64>>>()
    };
    given.into_iter().next().or_else(usual)
}

/// Simulates each recording with the first start.
pub(super) fn add_responses_at_start(problem: &ModelProblem, given: &[Vec<(String, f64)>], fits: &mut [ModelFit]) {
    let Some(start) = first_start(problem, given).filter(|start| !start.is_empty()) else { return };
    for (recording, fit) in fits.iter_mut().enumerate() {
        let outputs = problem.simulate(&start, recording, problem.open_initial(recording)).outputs;
        let is_finite = outputs.iter().flatten().all(|value| value.is_finite());
        fit.at_start = is_finite.then_some(outputs);
    }
}

/// Problem with its steps, and an estimate on it.
type Fitted = (ModelProblem, Refined);

/// Returns the better of an estimate and those that the given starts lead to, so that a model that contains another one and starts at its
/// estimates explains no less, and a start never makes a result worse; true beside it if that of a start is better. `cost` is that of the
/// lowest optimum of the search.
pub(super) fn with_given_starts(found: Fitted, given: &GivenStarts, cost: f64) -> Result<(Fitted, bool)> {
    let (mut found, mut is_replaced) = (found, false);
    for (values, end) in given.starts.iter().map(|values| (values, None)).chain(ends(given)) {
        let (problem, refined) = &found;
        let better = match end {
            Some(end) if end.cost < cost => of_lower_end(problem, refined, end),
            _ => better_from(problem, refined, values),
        };
        let Some((finer, better)) = better else { continue };
        let own = finer.unwrap_or_else(|| problem.clone());
        let next = with_fine_steps(own, better)?;
        // With shorter steps the order of the two may be another.
        if next.0.method().substeps == problem.method().substeps || is_better_there(&next, refined) {
            (found, is_replaced) = (next, true);
        }
    }
    Ok((found, is_replaced))
}

fn ends(given: &GivenStarts) -> impl Iterator<Item = (&Vec<f64>, Option<&ModelEnd>)> {
    given.ends.iter().map(|end| (&end.values, Some(end)))
}

/// Returns the estimate that an end leads to if it is better. With the steps of the search it is lower than all other ends, so that it
/// need not be better before its refinement.
fn of_lower_end(problem: &ModelProblem, best: &Refined, end: &ModelEnd) -> Option<(Option<ModelProblem>, Refined)> {
    let other = refine_model(problem, &end.values, &end.initial, None).ok()?;
    is_better(&other, best).then_some((None, other))
}

/// Returns true if an estimate is better than another one that is refined with its steps.
fn is_better_there((problem, refined): &Fitted, best: &Refined) -> bool {
    let same = refine_model(problem, &best.values, &best.initial, None);
    same.is_ok_and(|same| is_better(refined, &same))
}

/// Returns the estimate from a start if it is better, beside the problem with steps that are short enough for the start, if others are.
/// The initial states are fitted to the start first. With parameters of single recordings, which a start does not have, the steps remain.
fn better_from(problem: &ModelProblem, best: &Refined, start: &[f64]) -> Option<(Option<ModelProblem>, Refined)> {
    let mut initial = problem.open_initials();
    if problem.space().free.iter().any(|axis| axis.recording.is_some()) {
        let other = refine_model(problem, start, &initial, None).ok()?;
        return is_better(&other, best).then_some((None, other));
    }
    // A start from which the model diverges is no better.
    let (substeps, mut fitted) = fitted_at(problem, start, &initial, &best.weights).ok()?;
    let finer = match substeps == problem.method().substeps {
        true => None,
        false => Some(problem.with_substeps(substeps).ok()?),
    };
    let same = finer.as_ref().unwrap_or(problem);
    let best = match finer {
        Some(_) => &refine_model(same, &best.values, &best.initial, None).ok()?,
        None => best,
    };
    if finer.is_some() {
        (_, fitted) = fitted_at(same, start, &initial, &best.weights).ok()?;
    }
    if !is_better(&fitted, best) {
        return None;
    }
    initial.clone_from(&fitted.initial);
    let other = refine_model(same, start, &initial, None).ok()?;
    let is_better = is_better(&other, best);
    is_better.then_some((finer, other))
}
