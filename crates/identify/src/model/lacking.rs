//! Score test (C. R. Rao, 1948) of the optional terms that a model lacks, evaluated at the optimum; a term that it shows is confirmed by a
//! fit, because the cost of a model with friction that sticks is not smooth. A term is tested by its parameters with a neutral value,
//! while the others of it have their usual values.

use super::selection::{extended, near_optimum, with_terms};
use super::spec::ModelSpec;
use super::terms::ModelTerms;
use crate::bic::effective;
use motorfit_core::setting::{Text, text};
use motorfit_core::text::significant;
use motorfit_estimate::model::best_model_start;
use motorfit_estimate::{Refined, Score, scores};
use motorfit_evaluate::model::{ModelAxis, ModelProblem, ModelSpace};
use motorfit_model::{GenericTerm, ModelParameter};
use motorfit_record::warning::Warning;

/// Threshold of the score statistic: χ² with one degree of freedom exceeds it with a probability of 5e-4.
const STATISTIC: f64 = 12.0;
/// Smallest shift of a parameter at which a missing effect matters \[standard errors\].
const SHIFT: f64 = 1.0;
/// Distance from the neutral value at which derivatives are taken, as a part of the bounds: where a limit of friction or an `abs` is zero,
/// they are not defined.
const BESIDE: f64 = 1e-5;
/// Code of the warning.
pub(super) const CODE: &str = "model_incomplete";

/// Returns the warning about the optional term that the residuals show most; `None` if there is none. `with` are the terms of the model.
pub(super) fn lacking_terms(
    (problem, spec): (&ModelProblem, &ModelSpec),
    refined: &Refined,
    with: &[String],
) -> Option<Warning> {
    let (name, shift) = shown((problem, spec), refined, with)?;
    let shift = significant(shift, 2);
    let message = format!(
        "the residuals show {name}, which the model lacks: adding it shifts a parameter by {shift} standard errors"
    );
    let all: Vec<&str> = with.iter().map(String::as_str).chain([name.as_str()]).collect();
    let named = text!("Use " [With = "{}", all.join(",")]);
    let is_selected = spec.with == ModelTerms::Auto;
    let remedy: Text = if is_selected { named.and(".") } else { named.and(text!(" or " [With = "auto"] ".")) };
    Some(Warning { remedy: Some(remedy), ..Warning::new(CODE, message) })
}

/// Returns the term with the largest statistic, and the largest shift of a parameter that it causes \[standard errors\].
fn shown((problem, spec): (&ModelProblem, &ModelSpec), refined: &Refined, with: &[String]) -> Option<(String, f64)> {
    let (effective_ratio, _) = effective(problem, refined);
    // Other residual tests detect delays and the lags of sensors; the derivatives of an average are not defined at one sample.
    let is_tested = |term: &GenericTerm| matches!(term, GenericTerm::Offset | GenericTerm::Load);
    let generic: Vec<GenericTerm> = problem.model().generic_terms().into_iter().filter(is_tested).collect();
    let model = problem.model().with_generic(&generic).ok()?;
    let mut space = problem.space().clone();
    // Parameters of generic terms follow those of the model.
    let further = model.fixed_without(&[]).ok()?;
    space.fixed.extend(further.into_iter().skip(problem.space().fixed.len()));
    let own = if generic.is_empty() { problem.clone() } else { extended(problem, &model, space).ok()? };
    let mut found: Vec<(f64, String, f64)> = Vec::new();
    for term in model.terms().iter().filter(|term| !with.contains(&term.name)) {
        let Some((space, values, tested)) = with_term(&own, refined, (spec, &term.parameters)) else { continue };
        let all = scores(&own.with_space(space).ok()?, &values, refined, &tested);
        let shows = |score: &&Score| score.statistic * effective_ratio > STATISTIC && score.shift > SHIFT;
        let most = all.iter().filter(shows).max_by(|a, b| a.statistic.total_cmp(&b.statistic));
        if let Some(score) = most {
            found.push((score.statistic, term.name.clone(), score.shift));
        }
    }
    // The fits tell better than the derivatives which of several it is.
    let gain = |(_, name, shift): (f64, String, f64)| {
        let gain = gained((problem, spec), refined, (with, &name)).filter(|gain| gain * effective_ratio > STATISTIC)?;
        Some((gain, name, shift))
    };
    let most = found.into_iter().filter_map(gain).max_by(|a, b| a.0.total_cmp(&b.0));
    most.map(|(_, name, shift)| (name, shift))
}

/// Returns the space with the parameters of a term that have a neutral value, the values of the optimum there, and the numbers of the
/// further parameters; `None` if there are none. Estimates at a bound do not move.
fn with_term(
    problem: &ModelProblem,
    refined: &Refined,
    (spec, parameters): (&ModelSpec, &[usize]),
) -> Option<(ModelSpace, Vec<f64>, Vec<usize>)> {
    let model = problem.model();
    let mut space = problem.space().clone();
    let is_at_bound = |n: usize| refined.at_bound[n].is_some() && space.free[n].recording.is_none();
    let kept: Vec<usize> = (0..space.free.len()).filter(|n| !is_at_bound(*n)).collect();
    let own = |n: usize| (space.free[n].parameter, refined.values[n]);
    let held: Vec<(usize, f64)> = (0..space.free.len()).filter(|n| is_at_bound(*n)).map(own).collect();
    let mut values: Vec<f64> = kept.iter().map(|n| refined.values[*n]).collect();
    space.free = kept.iter().map(|n| space.free[*n].clone()).collect();
    held.into_iter().for_each(|(parameter, value)| space.fixed[parameter] = Some(value));
    let mut tested = Vec::new();
    let has_kinks = model.reactions() > 0 || model.has_corners();
    for parameter in parameters {
        let of = &model.parameters()[*parameter];
        let is_given = spec.fixed.iter().any(|(name, _)| *name == of.name);
        let is_free = space.free.iter().any(|axis| axis.parameter == *parameter);
        let Some(neutral) = of.neutral.filter(|_| !is_given && !is_free) else { continue };
        // The logarithm of a value of zero has no derivative.
        if of.is_logarithmic || !(of.min..=of.max).contains(&neutral) {
            continue;
        }
        space.fixed[*parameter] = None;
        tested.push(space.free.len());
        let &ModelParameter { min, max, is_logarithmic, .. } = of;
        space.free.push(ModelAxis { parameter: *parameter, recording: None, min, max, is_logarithmic });
        let beside = if has_kinks { BESIDE * (max - min) } else { 0.0 };
        values.push(if neutral + beside <= max { neutral + beside } else { neutral - beside });
    }
    (!tested.is_empty()).then_some((space, values, tested))
}

/// Returns the decrease of the weighted sum of squares by a fit with a further term, under the weights of the estimate.
fn gained(
    (problem, spec): (&ModelProblem, &ModelSpec),
    refined: &Refined,
    (with, term): (&[String], &str),
) -> Option<f64> {
    let with: Vec<String> = with.iter().cloned().chain([term.to_owned()]).collect();
    let larger = with_terms((problem.model(), problem), spec, &with).ok()?;
    let names = problem.space().names(problem.model());
    let starts = near_optimum(&larger, (&names, refined)).ok()?;
    let fit = best_model_start(&larger, &starts, &refined.initial, &refined.sigmas).ok()??;
    Some(refined.weighted(&refined.sigmas) - fit.weighted(&refined.sigmas))
}
