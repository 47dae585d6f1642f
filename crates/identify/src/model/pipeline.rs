//! The stages of an identification with a user's model: problem, search, refinement, tests, trust.

use super::combinations::Open;
use super::estimates::estimates;
use super::fine_steps::with_fine_steps;
use super::given_starts::{GivenStarts, add_responses_at_start, optima_beside, with_given_starts};
use super::homogeneity::homogeneity;
use super::islands::islands;
use super::result::{ModelIdentification, OwnModel};
use super::sampled_law::add_sampled_law;
use super::selection::select_terms;
use super::terms::ModelTerms;
use super::tests_of_residuals::fitted;
use super::trust::trust;
use crate::analysis::FitMetrics;
use crate::device::{BatchSearchEvaluator, DeviceSettings, DeviceSpec, PrecisionSpec};
use crate::method::Method;
use crate::repeated::{check_repeated, validation_repeats};
use crate::result::{Identification, Output, SearchOutcome};
use crate::verify::{Status, Verification};
use motorfit_core::candidates::Candidates;
use motorfit_core::clock::Instant;
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_estimate::model::{
    ARRIVALS, ModelOptima, ModelStarts, model_optima, open_flat, refine_model, rounds_max, signal_sigma,
};
use motorfit_estimate::{ReferenceKind, Refined};
use motorfit_evaluate::criterion::Criterion;
use motorfit_evaluate::model::{ModelProblem, ModelRecording, ModelSettings, ModelSpace};
use motorfit_model::{IntegrationMethod, Model};
use motorfit_optimize::{Budget, ConfiguredSearch, Run, SearchSettings, Stop, minimize};
use motorfit_record::warning::Warning;
use std::ops::ControlFlow;
use std::sync::Arc;

/// Settings of an identification with a user's model.
#[derive(Debug, Clone)]
pub struct ModelSpec {
    /// Method that finds the first optimum; [`Method::Auto`] is a multistart.
    pub method: Method,
    /// True if the first optimum is refined, which gives the standard errors.
    pub is_polished: bool,
    /// Number of candidates in a population.
    pub population: usize,
    /// Number of generations.
    pub generations: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Criterion that a population search minimizes.
    pub criterion: Criterion,
    /// Bounds of parameters that replace those of the model.
    pub bounds: Vec<(String, [f64; 2])>,
    /// Values of parameters that are fixed.
    pub fixed: Vec<(String, f64)>,
    /// Starts of further descents, beside those of the search: values of parameters. Others begin at their usual value, or in the middle
    /// of their bounds.
    pub starts: Vec<Vec<(String, f64)>>,
    /// Optional terms of the model.
    pub with: ModelTerms,
    /// Parameters with a value for each recording.
    pub per_recording: Vec<String>,
    /// True if the initial values of states that are measured or free are estimated.
    pub estimates_initial: bool,
    /// True if inputs are linear between samples.
    pub is_first_order_hold: bool,
    /// Integration method and number of substeps; `None` chooses them.
    pub integration: Option<(IntegrationMethod, usize)>,
    /// Device that evaluates populations; `auto` is the CPU.
    pub device: DeviceSpec,
    /// Precision of the evaluation of populations.
    pub precision: PrecisionSpec,
}

impl Default for ModelSpec {
    fn default() -> Self {
        Self {
            method: Method::Auto,
            is_polished: true,
            population: 100,
            generations: 100,
            seed: 1,
            criterion: Criterion::default(),
            bounds: Vec::new(),
            fixed: Vec::new(),
            starts: Vec::new(),
            with: ModelTerms::default(),
            per_recording: Vec::new(),
            estimates_initial: true,
            is_first_order_hold: false,
            integration: None,
            device: DeviceSpec::Auto,
            precision: PrecisionSpec::Auto,
        }
    }
}

impl ModelSpec {
    /// Returns the search space of a model with its terms.
    ///
    /// # Errors
    /// Returns `Usage` if a name is not a parameter or a term, a value does not suit it, or the terms are selected by fits.
    pub fn space(&self, model: &Model, recordings: usize) -> Result<ModelSpace> {
        let Some(with) = self.with.taken(model) else {
            let message = text!([With = "auto"] " selects terms by fits, and nothing is fitted here");
            return Err(Error::usage(message, text!("Name the terms, or leave out " [With] " to take all.")));
        };
        self.space_with(model, recordings, &with)
    }

    /// Returns the search space of a model with some of its terms.
    pub(super) fn space_with(&self, model: &Model, recordings: usize, with: &[String]) -> Result<ModelSpace> {
        let mut space = ModelSpace::new(model, recordings).per_recording(model, &self.per_recording, recordings)?;
        for (name, bounds) in &self.bounds {
            space = space.with_bounds(model, name, *bounds)?;
        }
        let taken: Vec<&str> = with.iter().map(String::as_str).collect();
        for (parameter, value) in model.parameters().iter().zip(model.fixed_without(&taken)?) {
            if let Some(value) = value {
                space = space.with_fixed(model, &parameter.name, value)?;
            }
        }
        for (name, value) in &self.fixed {
            space = space.with_fixed(model, name, *value)?;
        }
        Ok(space)
    }

    /// Returns the settings of a problem.
    #[must_use]
    pub fn settings(&self) -> ModelSettings {
        ModelSettings {
            criterion: self.criterion,
            is_first_order_hold: self.is_first_order_hold,
            method: self.integration,
            has_known_initial: !self.estimates_initial,
        }
    }
}

impl From<&ModelSpec> for DeviceSettings {
    fn from(spec: &ModelSpec) -> Self {
        let &ModelSpec { precision, population, generations, .. } = spec;
        Self { device: spec.device.clone(), precision, population, generations, ..Self::default() }
    }
}

/// Progress of an identification: the steps that are done, and all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModelProgress {
    /// Generations, or rounds of starts, that are done.
    pub done: usize,
    /// Their number at most.
    pub of: usize,
}

/// Identifies the parameters of a model from recordings. `observe` may end the search; the result is then the best so far.
///
/// # Errors
/// Returns the errors of [`ModelSpec::space`], [`ModelProblem::new`] and [`BatchSearchEvaluator::open`], `Data` for a recording that is
/// given twice, `Usage` for Steiglitz–McBride, and `NotIdentified` if the model diverges from every start.
pub fn identify_model(
    model: &Model,
    recordings: &[ModelRecording],
    spec: &ModelSpec,
    observe: &mut dyn FnMut(ModelProgress) -> ControlFlow<()>,
) -> Result<ModelIdentification> {
    let begin = Instant::now();
    check_repeated(recordings)?;
    let all = ModelTerms::All.taken(model).unwrap_or_default();
    let space = spec.space_with(model, recordings.len(), &spec.with.taken(model).unwrap_or(all))?;
    let mut problem = Arc::new(ModelProblem::new(model, space, recordings.to_vec(), spec.settings())?);
    let mut device = BatchSearchEvaluator::open(spec, vec![problem.clone()])?;
    let mut selected = None;
    if spec.with == ModelTerms::Auto {
        let mut look = |done, of| observe(ModelProgress { done, of });
        let found = select_terms((model, &problem), spec, device.evaluator(), &mut look)?;
        let space = spec.space_with(model, recordings.len(), &found.with)?;
        problem = Arc::new(problem.with_space(space)?);
        device = BatchSearchEvaluator::open(spec, vec![problem.clone()])?;
        selected = Some(found);
    }
    let mut found = search((&problem, &mut device), spec, observe)?;
    if let Some(selected) = &selected {
        found.given.add(&problem, &selected.values)?;
    }
    // With the steps of the search: others have another lowest sum of squares.
    let mut verification = verified(&problem, spec, &found);
    let problem = Arc::unwrap_or_clone(problem);
    let (problem, refined) = match spec.is_polished {
        true => {
            let refined = refine_model(&problem, &found.start.0, &found.start.1, None)?;
            let refined = with_fine_steps(problem, refined)?;
            let cost = found.optima.as_ref().map_or(f64::NEG_INFINITY, |optima| optima.cost);
            let (refined, is_of_given) = with_given_starts(refined, &found.given, cost)?;
            // No start over the bounds led there.
            if is_of_given && matches!(verification.status, Status::Agrees | Status::ReferenceFailed) {
                verification = Verification { status: Status::ReferenceFailed, arrivals: 0, ..verification };
            }
            let (problem, mut refined) = refined;
            open_flat(&problem, &mut refined);
            (problem, Some(refined))
        }
        false => (problem, None),
    };
    let mut result = result(&problem, spec, (found, verification), refined.as_ref());
    add_sampled_law(&problem, &mut result, refined.as_ref());
    result.with =
        selected.as_ref().map_or_else(|| spec.with.taken(model), |of| Some(of.with.clone())).unwrap_or_default();
    if let Some(selected) = selected {
        (result.selection, result.alternatives) = (Some(selected.steps), selected.alternatives);
    }
    result.device = device.device();
    result.warnings.extend(device.take_warnings());
    result.seconds = begin.elapsed().as_secs_f64();
    Ok(result)
}

/// The outcome of a search.
struct Found {
    method: &'static str,
    values: Vec<f64>,
    cost: f64,
    /// Values and initial states from which the refinement begins.
    start: (Vec<f64>, Vec<Vec<f64>>),
    optima: Option<ModelOptima>,
    given: GivenStarts,
    is_of_multistart: bool,
    stop: Stop,
    evaluations: u64,
    history: Vec<f64>,
}

fn cost_of(problem: &ModelProblem, values: &[f64]) -> Result<f64> {
    let mut cost = [f64::INFINITY];
    problem.costs(Candidates::new(values, values.len()), &mut cost).map(|()| cost[0])
}

/// Runs a population search.
fn of_population(
    (problem, device): (&Arc<ModelProblem>, &mut BatchSearchEvaluator<ModelProblem>),
    spec: &ModelSpec,
    search: &ConfiguredSearch,
    observe: &mut dyn FnMut(ModelProgress) -> ControlFlow<()>,
) -> Result<(Run, Stop)> {
    let bounds = problem.space().free.iter().map(|axis| (axis.min, axis.max)).collect();
    let &ModelSpec { population, generations, seed, .. } = spec;
    let search_settings = SearchSettings { bounds, population, generations, seed, ..SearchSettings::default() };
    let mut runs = [Run::new(search.begin(search_settings)?)];
    let budget = Budget { generations, slice: device.slice() };
    let rounds = rounds_max(problem.model());
    let mut progress =
        |of: &motorfit_optimize::Progress| observe(ModelProgress { done: of.generation, of: of.generations + rounds });
    let stop = minimize(&mut runs, budget, device, &mut progress)?;
    let [run] = runs;
    Ok((run, stop))
}

fn search(
    (problem, device): (&Arc<ModelProblem>, &mut BatchSearchEvaluator<ModelProblem>),
    spec: &ModelSpec,
    observe: &mut dyn FnMut(ModelProgress) -> ControlFlow<()>,
) -> Result<Found> {
    let cost = |values: &[f64]| cost_of(problem, values);
    let seed = spec.seed;
    let starts = problem.space().starts(problem.model(), &spec.starts)?;
    let population = match &spec.method {
        Method::Auto => None,
        Method::SteiglitzMcBride => {
            let hint = "Choose auto (a multistart) or a population search.";
            return Err(Error::usage("Steiglitz–McBride is a method of the linear DC motor", hint));
        }
        Method::Search(search) => {
            let (run, stop) = of_population((problem, device), spec, search, observe)?;
            Some((search.search.name, run, stop))
        }
    };
    // The rounds of starts follow the generations.
    let before = population.as_ref().map_or(0, |_| spec.generations);
    let mut look = |done, of| observe(ModelProgress { done: before + done, of: before + of });
    if let Some((method, run, stop)) = population {
        let Some(best) = run.optimizer.best().map(|best| best.values.to_vec()) else {
            return Err(Error::not_identified("no candidate of the search was evaluated", "Give more generations."));
        };
        let optima = match spec.is_polished && stop != Stop::Interrupted {
            true => {
                let starts = ModelStarts { given: std::slice::from_ref(&best), populations: &mut islands };
                Some(model_optima(problem, device.evaluator(), seed, starts, &mut look)?)
            }
            false => None,
        };
        let is_interrupted = optima.as_ref().is_some_and(|optima| optima.is_interrupted);
        let initial = problem.open_initials();
        let given = match optima.is_some() && !is_interrupted {
            true => GivenStarts::new(problem, starts)?,
            false => GivenStarts::default(),
        };
        return Ok(Found {
            method,
            cost: cost(&best)?,
            start: (best.clone(), initial),
            values: best,
            optima,
            given,
            is_of_multistart: false,
            stop: if is_interrupted { Stop::Interrupted } else { stop },
            evaluations: run.evaluations,
            history: run.history,
        });
    }
    let (optima, given) = optima_beside(problem, device.evaluator(), seed, &starts, &mut look)?;
    // Refined, each is compared with the other.
    let lower = given.lower_than(optima.cost).filter(|_| !spec.is_polished);
    let (values, initial) = lower.map_or((&optima.values, &optima.initial), |lower| (&lower.values, &lower.initial));
    Ok(Found {
        method: "multistart",
        values: values.clone(),
        cost: cost(values)?,
        start: (values.clone(), initial.clone()),
        stop: if optima.is_interrupted { Stop::Interrupted } else { Stop::BudgetSpent },
        evaluations: optima.evaluations + given.simulations,
        history: Vec::new(),
        is_of_multistart: true,
        optima: Some(optima),
        given,
    })
}

/// Sum of squares above the lowest, relative to it, from which a search was stuck.
const STUCK: f64 = 1e-3;

/// Compares the optimum of a search with those of descents from other starts.
fn verified(problem: &ModelProblem, spec: &ModelSpec, found: &Found) -> Verification {
    let none = Verification::none();
    let Some(optima) = found.optima.as_ref().filter(|_| spec.is_polished) else { return none };
    let of = |status: Status, cost_gap: Option<f64>| Verification {
        status,
        reference: Some(ReferenceKind::MultiStart),
        starts: optima.starts,
        arrivals: optima.arrivals,
        cost_gap,
        refined_agrees: status == Status::Agrees,
        ..none.clone()
    };
    let is_conclusive = optima.arrivals >= ARRIVALS || problem.space().free.is_empty();
    let conclusion = if is_conclusive { Status::Agrees } else { Status::ReferenceFailed };
    if found.is_of_multistart {
        // Its optimum is the lowest one by itself.
        return of(conclusion, Some(0.0));
    }
    // The descent of the search's own optimum, with the weights of the multistart.
    let sigma = signal_sigma(problem);
    let own = refine_model(problem, &found.start.0, &found.start.1, Some(&sigma));
    let cost_gap = own.ok().map(|own| own.weighted(&sigma) / optima.cost - 1.0).filter(|gap| gap.is_finite());
    of(if cost_gap.is_some_and(|gap| gap > STUCK) { Status::SearchStuck } else { conclusion }, cost_gap)
}

fn result(
    problem: &ModelProblem,
    spec: &ModelSpec,
    (found, verification): (Found, Verification),
    refined: Option<&Refined>,
) -> ModelIdentification {
    let values = refined.map_or_else(|| found.values.clone(), |refined| refined.values.clone());
    let initial = refined.map_or_else(|| found.start.1.clone(), |refined| refined.initial.clone());
    let all = (0..problem.recordings()).map(|recording| fitted(problem, &values, recording, &initial[recording]));
    let (mut fits, metrics): (Vec<_>, Vec<_>) = all.unzip();
    add_responses_at_start(problem, &spec.starts, &mut fits);
    let metrics = metrics.into_iter().fold(FitMetrics::default(), FitMetrics::and);
    let mut cost = [f64::INFINITY];
    // The length fits: the values are those of the space. With the initial values that were estimated beside them.
    let _ = problem.with_open_initials(&initial).costs(Candidates::new(&values, values.len()), &mut cost);
    let uncertainty = refined.map(|refined| refined.uncertainty.clone());
    let open = uncertainty.as_ref().map(|uncertainty| Open::new(problem, &values, uncertainty)).unwrap_or_default();
    let combinations = open.sentences();
    let mut warnings = Vec::new();
    for text in &combinations {
        warnings.push(Warning::new("not_identifiable", text.clone()));
    }
    warnings.extend(refined.and_then(|refined| homogeneity(problem, refined)));
    let model = problem.model();
    let outputs = model.outputs().iter();
    let names = problem.space().names(model);
    let mut result = Identification {
        outputs: outputs.map(|of| Output { name: of.name.clone(), unit: of.unit.text.clone() }).collect(),
        estimates: estimates(problem, &values, refined),
        values,
        searched: SearchOutcome {
            method: found.method,
            is_fallback: false,
            has_population: !found.is_of_multistart,
            parameters: names.into_iter().zip(found.values).collect(),
            cost: found.cost,
        },
        cost: cost[0],
        uncertainty,
        converged: refined.is_none_or(|refined| refined.converged),
        fit_percent: metrics.fit_percent(),
        residual_sigma: metrics.residual_sigma(),
        fit_percent_by_recording: fits.iter().map(|fit| fit.fit_percent.clone()).collect(),
        residual_tests: fits.iter().map(|fit| fit.residuals.clone()).collect(),
        verification,
        warnings,
        stop: found.stop,
        evaluations: found.evaluations + refined.map_or(0, |refined| refined.evaluations as u64),
        history: found.history,
        ..Identification::of(OwnModel {
            model: model.clone(),
            space: problem.space().clone(),
            method: *problem.method(),
            combinations,
            identified: open.identified(),
            fits,
            held_out: Vec::new(),
            held_out_percent: Vec::new(),
        })
    };
    result.trust = trust(problem, &result, spec.is_polished);
    result
}

/// Simulates held-out recordings with the result of `recordings`; initial values that are measured or free are estimated from each.
///
/// # Errors
/// Propagates the errors of [`ModelProblem::new`]; parameters of single recordings take the values of the first one.
pub fn hold_out_model(
    model: &Model,
    found: &mut ModelIdentification,
    recordings: &[ModelRecording],
    held_out: &[ModelRecording],
    spec: &ModelSpec,
) -> Result<()> {
    if held_out.is_empty() {
        return Ok(());
    }
    found.warnings.extend(validation_repeats(recordings, held_out));
    let space = ModelSpace::all_fixed(&found.space.values(&found.values, 0));
    let problem = ModelProblem::new(model, space, held_out.to_vec(), spec.settings())?;
    let initial = problem.open_initials();
    let initial = match spec.estimates_initial && !initial.iter().all(Vec::is_empty) {
        true => refine_model(&problem, &[], &initial, None).map_or(initial, |refined| refined.initial),
        false => initial,
    };
    let (fits, metrics): (Vec<_>, Vec<_>) = (0..held_out.len()).map(|n| fitted(&problem, &[], n, &initial[n])).unzip();
    found.machine.held_out = fits;
    found.machine.held_out_percent = metrics.into_iter().fold(FitMetrics::default(), FitMetrics::and).fit_percent();
    Ok(())
}
