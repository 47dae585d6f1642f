//! Selection of the optional terms of a model.
//!
//! A larger model starts at the optimum of a smaller one, with its further parameters where they have no effect and at the best of many
//! values over their bounds, since descents with friction that sticks end where the cost has kinks.

use super::islands::islands;
use super::spec::ModelSpec;
use super::terms::with_generic;
use crate::analysis::FitMetrics;
use crate::forward_selection::{Alternative, Family, FitOf, Selected, SelectionStep, select_forward};
use motorfit_core::candidates::Candidates;
use motorfit_core::numeric::spread;
use motorfit_core::{Error, Result};
use motorfit_estimate::Refined;
use motorfit_estimate::model::{ModelStarts, best_model_start, model_optima, refine_model};
use motorfit_evaluate::Evaluator;
use motorfit_evaluate::model::{ModelAxis, ModelProblem, ModelSettings, ModelSpace};
use motorfit_model::{GenericTerm, Model};
use std::borrow::Cow;
use std::ops::ControlFlow;

/// A model with optional terms on recordings.
struct Terms<'a> {
    model: &'a Model,
    spec: &'a ModelSpec,
    /// The problem with all terms of the text.
    problem: &'a ModelProblem,
    /// Names of the generic terms that apply.
    generic: Vec<String>,
    /// Fit without optional terms.
    smallest: FitOf<Self>,
}

/// The selected terms, and the optimum with them.
pub(super) struct SelectedTerms {
    /// Terms that were selected.
    pub with: Vec<String>,
    /// Models that were fitted, in their order.
    pub steps: Vec<SelectionStep>,
    /// Models that fit the recordings equally well.
    pub alternatives: Vec<Alternative>,
    /// Values of the free parameters with the selected terms.
    pub values: Vec<f64>,
}

/// Selects the optional terms of a model. `problem` has all of them.
///
/// # Errors
/// Returns `Usage` if the model has no terms, and propagates the errors of the search and the fits.
pub(super) fn select_terms(
    (model, problem): (&Model, &ModelProblem),
    spec: &ModelSpec,
    evaluator: &mut dyn Evaluator<ModelProblem>,
    observe: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<SelectedTerms> {
    let space = spec.space_with(model, problem.recordings(), &[])?;
    let own = problem.with_space(space)?;
    let starts = ModelStarts { given: &[], populations: &mut islands };
    let optima = model_optima(&own, evaluator, spec.seed, starts, observe)?;
    let refined = refine_model(&own, &optima.values, &optima.initial, None)?;
    let smallest = of(&[], &own, refined);
    let generic = model.generic_terms().into_iter().map(|term| term.name().to_owned()).collect();
    let family = Terms { model, spec, problem, generic, smallest };
    let Selected { best, steps, alternatives } = select_forward(&family)?;
    Ok(SelectedTerms { with: best.with, steps, alternatives, values: best.refined.values })
}

/// Keeps the names of the free parameters.
fn of(with: &[String], problem: &ModelProblem, refined: Refined) -> FitOf<Terms<'static>> {
    FitOf::<Terms<'_>>::new(with, problem.space().names(problem.model()), problem, refined)
}

impl Family for Terms<'_> {
    type Term = String;
    type Space = Vec<String>;

    fn smallest(&self) -> Result<FitOf<Self>> {
        Ok(self.smallest.clone())
    }

    fn stages(&self) -> usize {
        1 + usize::from(!self.generic.is_empty())
    }

    fn candidates(&self, of: &FitOf<Self>, stage: usize) -> Vec<String> {
        let own: Vec<String> = self.model.terms().iter().map(|term| term.name.clone()).collect();
        let frees = |name: &String| {
            let with: Vec<String> = of.with.iter().chain([name]).cloned().collect();
            let space = || {
                let model = with_generic(self.model, &with)?;
                self.spec.space_with(&model, self.problem.recordings(), &with)
            };
            // A term whose parameters are free with the others, or fixed by the spec, is none.
            space().is_ok_and(|space| space.free.len() > of.free)
        };
        let lacking = if stage == 0 { &own } else { &self.generic };
        lacking.iter().filter(|name| !of.with.contains(name) && frees(name)).cloned().collect()
    }

    fn resembles(&self, a: &String, b: &String) -> bool {
        // Delays and lags resemble each other, an offset of an output and a load do.
        let static_terms = [GenericTerm::Offset.name(), GenericTerm::Load.name()];
        let group = |name: &String| {
            let is_generic = self.generic.contains(name);
            (is_generic, is_generic && static_terms.contains(&name.as_str()))
        };
        group(a) == group(b)
    }

    fn rough(&self, from: &FitOf<Self>, with: &[String]) -> Result<FitOf<Self>> {
        let problem = with_terms((self.model, self.problem), self.spec, with)?;
        let starts = near_optimum(&problem, (&from.space, &from.refined))?;
        let (initial, sigma) = (&from.refined.initial, &from.refined.weights);
        let refined = best_model_start(&problem, &starts, initial, sigma)?.ok_or_else(diverges)?;
        Ok(of(with, &problem, refined))
    }

    fn finished(&self, rough: FitOf<Self>) -> FitOf<Self> {
        let finished = || {
            let problem = with_terms((self.model, self.problem), self.spec, &rough.with)?;
            let refined = refine_model(&problem, &rough.refined.values, &rough.refined.initial, None)?;
            Ok::<_, Error>(of(&rough.with, &problem, refined))
        };
        finished().unwrap_or(rough)
    }

    fn reduced(&self, larger: &FitOf<Self>, with: &[String]) -> Result<FitOf<Self>> {
        let problem = with_terms((self.model, self.problem), self.spec, with)?;
        let start = transferred(&problem, (&larger.space, &larger.refined));
        let refined = refine_model(&problem, &start, &larger.refined.initial, None)?;
        Ok(of(with, &problem, refined))
    }

    fn lower(&self, _: &FitOf<Self>) -> Result<Option<FitOf<Self>>> {
        // The smallest model was searched over its bounds, and the selected one is afterwards.
        Ok(None)
    }

    fn named(&self, term: &String) -> String {
        term.clone()
    }

    fn fit_percent(&self, refined: &Refined) -> Vec<Option<f64>> {
        let residuals = |n: usize| FitMetrics::of_squares(self.problem, n, &refined.squares[n]);
        let all = (0..self.problem.recordings()).map(residuals);
        all.fold(FitMetrics::default(), FitMetrics::and).fit_percent()
    }

    fn parameters(&self, fit: &FitOf<Self>) -> Vec<(String, f64)> {
        fit.space.iter().cloned().zip(fit.refined.values.iter().copied()).collect()
    }
}

fn diverges() -> Error {
    Error::not_identified("the model diverges from every start", "Narrow the bounds of its terms.")
}

/// Returns the value at which a parameter has no effect, within its bounds; its usual value where it has none.
fn usual(model: &Model, axis: &ModelAxis) -> f64 {
    let parameter = &model.parameters()[axis.parameter];
    parameter.neutral.unwrap_or_else(|| parameter.usual()).clamp(axis.min, axis.max)
}

/// Returns the values of an estimate, with the names of its parameters, in the space of a problem; parameters that it lacks have no effect.
fn transferred(problem: &ModelProblem, (names, refined): (&[String], &Refined)) -> Vec<f64> {
    let own = problem.space().names(problem.model());
    let value = |(axis, name): (&ModelAxis, &String)| match names.iter().position(|known| known == name) {
        Some(n) => refined.values[n].clamp(axis.min, axis.max),
        None => usual(problem.model(), axis),
    };
    problem.space().free.iter().zip(&own).map(value).collect()
}

/// Returns the problem of a model with some of its terms and generic ones, with the steps of `problem`, that of the model with all of its own.
pub(super) fn with_terms(
    (model, problem): (&Model, &ModelProblem),
    spec: &ModelSpec,
    with: &[String],
) -> Result<ModelProblem> {
    let model = with_generic(model, with)?;
    let space = spec.space_with(&model, problem.recordings(), with)?;
    match model {
        Cow::Borrowed(_) => problem.with_space(space),
        Cow::Owned(model) => extended(problem, &model, space),
    }
}

/// Returns the problem of a model with generic terms and the steps of that without.
pub(super) fn extended(problem: &ModelProblem, model: &Model, space: ModelSpace) -> Result<ModelProblem> {
    let recordings = (0..problem.recordings()).map(|n| problem.recording(n).clone()).collect();
    let method = Some((problem.method().method, problem.method().substeps));
    ModelProblem::new(model, space, recordings, ModelSettings { method, ..problem.settings() })
}

/// Number of values of the further parameters over their bounds.
const SPREAD: usize = 96;
/// Distances from where they have no effect, as parts of those.
const SCALES: [f64; 3] = [1.0, 0.2, 0.03];
/// Number of the best of these that are starts, and the smallest distance of two, as a fraction of the range of some coordinate.
const STARTS: usize = 3;
const APART: f64 = 0.1;

/// Returns starts of a model at the optimum of another one: where its further parameters have no effect, and at the best values over
/// their bounds.
pub(super) fn near_optimum(problem: &ModelProblem, from: (&[String], &Refined)) -> Result<Vec<Vec<f64>>> {
    let axes = &problem.space().free;
    let first = transferred(problem, from);
    let names = problem.space().names(problem.model());
    let new: Vec<usize> = (0..axes.len()).filter(|n| !from.0.contains(&names[*n])).collect();
    if new.is_empty() {
        return Ok(vec![first]);
    }
    let mut all: Vec<f64> = Vec::new();
    for n in 0..SPREAD {
        for scale in SCALES {
            let mut values = first.clone();
            for (axis, at) in new.iter().zip(spread(n, new.len())) {
                let range = axes[*axis].range();
                let at = range.of(axes[*axis].at(at));
                // A parameter without a neutral value, such as the speed of an effect, is spread over its bounds.
                let has_neutral = problem.model().parameters()[axes[*axis].parameter].neutral.is_some();
                let scale = if has_neutral { scale } else { 1.0 };
                let neutral = range.of(first[*axis]);
                values[*axis] = range.value(neutral + scale * (at - neutral));
            }
            all.extend(values);
        }
    }
    let mut costs = vec![f64::INFINITY; SPREAD * SCALES.len()];
    problem.with_open_initials(&from.1.initial).costs(Candidates::new(&all, axes.len()), &mut costs)?;
    let mut order: Vec<usize> = (0..costs.len()).filter(|n| costs[*n].is_finite()).collect();
    order.sort_by(|a, b| costs[*a].total_cmp(&costs[*b]));
    let of = |n: usize| &all[n * axes.len()..(n + 1) * axes.len()];
    let mut starts: Vec<Vec<f64>> = vec![first];
    for n in order {
        let is_apart = |other: &Vec<f64>| {
            new.iter().any(|axis| {
                let range = axes[*axis].range();
                let [a, b] = [of(n)[*axis], other[*axis]].map(|value| range.of(value));
                (a - b).abs() > APART * (range.of(range.max) - range.of(range.min))
            })
        };
        if starts.len() <= STARTS && starts[1..].iter().all(is_apart) {
            starts.push(of(n).to_vec());
        }
    }
    Ok(starts)
}
