//! The stages of an identification with a user's model: problem, search, refinement, tests, trust.

use super::combinations::Open;
use super::derived::derived;
use super::estimates::{estimates, is_idle};
use super::fine_steps::with_fine_steps;
use super::given_starts::{GivenStarts, add_responses_at_start, optima_beside, with_given_starts};
use super::homogeneity::homogeneity;
use super::islands::islands;
use super::lacking::lacking_terms;
use super::recordings::of_recordings;
use super::result::{ModelIdentification, OwnModel};
use super::sampled_law::add_sampled_law;
use super::selection::{SelectedTerms, select_terms};
use super::spec::ModelSpec;
use super::terms::{ModelTerms, with_generic};
use super::tests_of_residuals::fitted;
use super::trust::trust;
use crate::analysis::{FitMetrics, Output};
use crate::device::BatchSearchEvaluator;
use crate::estimates::ParameterEstimate;
use crate::method::Method;
use crate::repeated::{check_repeated, validation_repeats};
use crate::result::{Identification, SearchOutcome};
use crate::result_warnings::{at_bound, of_fit, residuals_follow_input};
use crate::trust::{judge_validation, set as set_trust};
use crate::verify::{Status, Verification};
use motorfit_core::candidates::Candidates;
use motorfit_core::clock::Instant;
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_estimate::model::{
    ARRIVALS, ModelOptima, ModelStarts, model_optima, open_flat, refine_model, rounds_max, signal_sigma,
};
use motorfit_estimate::{ReferenceKind, Refined};
use motorfit_evaluate::model::{ModelProblem, ModelRecording, ModelSpace};
use motorfit_model::Model;
use motorfit_optimize::{Budget, ConfiguredSearch, Run, SearchSettings, Stop, minimize};
use motorfit_record::warning::Warning;
use std::borrow::Cow;
use std::ops::ControlFlow;
use std::sync::Arc;

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
    let with = spec.with.taken(model).unwrap_or(all);
    let mut problem = Arc::new(spec.problem_with(model, recordings.to_vec(), &with)?);
    let mut device = BatchSearchEvaluator::open(spec, vec![problem.clone()])?;
    let mut selected = None;
    if spec.with == ModelTerms::Auto {
        let mut look = |done, of| observe(ModelProgress { done, of });
        let of = select_terms((model, &problem), spec, device.evaluator(), &mut look)?;
        problem = Arc::new(match with_generic(model, &of.with)? {
            Cow::Borrowed(own) => problem.with_space(spec.space_with(own, recordings.len(), &of.with)?)?,
            // With the steps that the generic terms need.
            Cow::Owned(_) => spec.problem_with(model, recordings.to_vec(), &of.with)?,
        });
        device = BatchSearchEvaluator::open(spec, vec![problem.clone()])?;
        selected = Some(of);
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
    let mut result = result(&problem, spec, (found, verification), refined.as_ref(), selected);
    add_sampled_law(&problem, &mut result, refined.as_ref());
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
    selected: Option<SelectedTerms>,
) -> ModelIdentification {
    let with = selected.as_ref().map_or_else(|| spec.with.taken(problem.model()), |of| Some(of.with.clone()));
    let with = with.unwrap_or_default();
    let (selection, alternatives) = selected.map(|of| (of.steps, of.alternatives)).unzip();
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
    let derived = uncertainty.as_ref().map(|uncertainty| derived(problem, &values, uncertainty)).unwrap_or_default();
    let mut warnings = of_recordings(problem);
    for text in &combinations {
        warnings.push(Warning::new("not_identifiable", text.clone()));
    }
    warnings.extend(refined.and_then(|refined| homogeneity(problem, refined)));
    warnings.extend(refined.and_then(|refined| lacking_terms((problem, spec), refined, &with)));
    let model = problem.model();
    let outputs = model.outputs().iter();
    let names = problem.space().names(model);
    let mut result = Identification {
        outputs: outputs.map(|of| Output { name: of.name.clone(), unit: of.unit.text.clone() }).collect(),
        estimates: estimates(problem, &values, refined),
        values,
        with,
        selection,
        alternatives: alternatives.unwrap_or_default(),
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
            identified: derived.into_iter().chain(open.identified()).collect(),
            fits,
            held_out: Vec::new(),
            held_out_percent: Vec::new(),
        })
    };
    result.warnings.extend(of_result(problem, &result));
    let judged = trust(problem, spec, &result);
    set_trust(&mut result, judged);
    result
}

/// Returns the warnings about a result.
fn of_result(problem: &ModelProblem, found: &ModelIdentification) -> Vec<Warning> {
    let model = problem.model();
    let one = |e: &ParameterEstimate| Some(at_bound(&e.label(), e.at_bound?, is_idle(model, e)));
    let mut warnings: Vec<Warning> = found.estimates.iter().filter_map(one).collect();
    warnings.extend(of_fit(found));
    let recordings: Vec<String> = (0..problem.recordings()).map(|n| problem.recording(n).label(n)).collect();
    let outputs: Vec<String> = found.outputs.iter().map(|of| of.name.clone()).collect();
    let input = match model.inputs() {
        [only] => &only.name,
        _ => "the inputs",
    };
    warnings.extend(residuals_follow_input(found, &recordings, &outputs, input));
    warnings
}

/// Simulates held-out recordings with the result of `recordings`; initial values that are measured or free are estimated from each.
///
/// # Errors
/// Propagates the errors of [`ModelProblem::new`]; parameters of single recordings take the values of the first one.
pub fn hold_out_model(
    found: &mut ModelIdentification,
    recordings: &[ModelRecording],
    held_out: &[ModelRecording],
    spec: &ModelSpec,
) -> Result<()> {
    if held_out.is_empty() {
        return Ok(());
    }
    found.warnings.extend(validation_repeats(recordings, held_out));
    let is_complete = spec.with == ModelTerms::Auto || found.model.terms().is_empty();
    let space = ModelSpace::all_fixed(&found.space.values(&found.values, 0));
    let problem = ModelProblem::new(&found.machine.model, space, held_out.to_vec(), spec.settings())?;
    let initial = problem.open_initials();
    let initial = match spec.estimates_initial && !initial.iter().all(Vec::is_empty) {
        true => refine_model(&problem, &[], &initial, None).map_or(initial, |refined| refined.initial),
        false => initial,
    };
    let (fits, metrics): (Vec<_>, Vec<_>) = (0..held_out.len()).map(|n| fitted(&problem, &[], n, &initial[n])).unzip();
    let metrics = metrics.into_iter().fold(FitMetrics::default(), FitMetrics::and);
    let next = || match is_complete {
        true => "Fit the held-out recordings too; check whether the machine or its load changed.".into(),
        false => text!([With = "auto"]),
    };
    judge_validation(found, (&metrics.fit_percent(), &metrics.residual_sigma()), next);
    found.machine.held_out = fits;
    found.machine.held_out_percent = metrics.fit_percent();
    Ok(())
}
