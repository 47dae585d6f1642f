//! A fit without the search of the whole box and without diagnoses: what a batch of thousands needs of each.

use super::checks;
use super::current_driven::needs_voltage;
use super::model_selection::named_space;
use super::refine::refine_widening;
use super::result::side;
use super::spec::IdentifySpec;
use super::start::{around, steiglitz_mcbride};
use crate::Result;
use crate::analysis::{FitMetrics, fit_percent, poor_fit};
use crate::estimate::{Uncertainty, fit_problem};
use crate::evaluate::Problem;
use crate::motor::{Axis, Parameters, Space};
use crate::record::Record;

/// Parameters with how sure they are.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    /// The parameters, those held included.
    pub parameters: Parameters,
    /// The free ones of them, in the order of the space.
    pub values: Vec<f64>,
    /// What was free within which bounds.
    pub space: Space,
    /// The state `[i, ω]` at the start of each recording where the refinement estimated it.
    pub initial: Option<Vec<[f64; 2]>>,
    /// How sure the parameters are; `None` without a polish.
    pub uncertainty: Option<Uncertainty>,
    /// The bound, `min` or `max`, that each free parameter stands at.
    pub at_bound: Vec<Option<&'static str>>,
    /// 100 (1 − ‖y − ŷ‖/‖y − mean y‖) of current and speed; `None` for a channel not measured.
    pub fit_percent: [Option<f64>; 2],
    /// Iterations of Steiglitz–McBride; 0 for a search's result.
    pub iterations: usize,
    /// Codes of what the reader should know.
    pub warnings: Vec<&'static str>,
}

/// Steiglitz–McBride, then the spec's polish.
///
/// # Errors
/// As [`super::identify`] with that method.
pub fn fit(records: &[Record], spec: &IdentifySpec) -> Result<Fitted> {
    needs_voltage(records)?;
    fit_on(&fit_problem(records, &spec.space, spec.model)?, records, spec)
}

/// Like [`fit`], on the problem of a fit that was made of the recordings ([`fit_problem`]).
///
/// # Errors
/// As [`fit`].
pub fn fit_on(plain: &Problem, records: &[Record], spec: &IdentifySpec) -> Result<Fitted> {
    let estimate = steiglitz_mcbride(records, spec, plain)??;
    let space = around(spec, &estimate)?;
    let inside = |axis: &Axis| estimate.parameters.get(axis.parameter).clamp(axis.min, axis.max);
    let values: Vec<f64> = space.free().iter().map(inside).collect();
    Ok(Fitted { iterations: estimate.iterations, ..polished_on(plain, records, (spec, &space), &values)? })
}

/// The spec's polish of what a search found in a space (one value per free axis).
///
/// # Errors
/// As [`super::identify`].
pub fn polished(records: &[Record], spec: &IdentifySpec, space: &Space, values: &[f64]) -> Result<Fitted> {
    polished_on(&fit_problem(records, space, spec.model)?, records, (spec, space), values)
}

fn polished_on(
    plain: &Problem,
    records: &[Record],
    (spec, space): (&IdentifySpec, &Space),
    values: &[f64],
) -> Result<Fitted> {
    if !spec.is_polished() {
        let fit_percent = FitMetrics::of(records, &plain.with_space(space.clone()), values).fit_percent();
        return Ok(Fitted {
            parameters: space.parameters(values, 0),
            values: values.to_vec(),
            at_bound: sides(space, values),
            space: space.clone(),
            initial: None,
            uncertainty: None,
            fit_percent,
            iterations: 0,
            warnings: codes(&sides(space, values), fit_percent),
        });
    }
    let (refined, space) = refine_widening(plain, spec, space, values)?;
    let warning = checks::after(records, spec, &space, &refined)?;
    let fit_percent = fit_percent(records, &refined);
    checks::fit(records, spec, fit_percent)?;
    let at_bound = sides(&space, &refined.values);
    let mut codes: Vec<&'static str> =
        warning.iter().map(|warning| warning.code).chain(codes(&at_bound, fit_percent)).collect();
    if !refined.converged {
        codes.push("not_converged");
    }
    if refined.uncertainty.whiteness.iter().flatten().any(|w| !w.is_white) {
        codes.push("residuals_not_white");
    }
    Ok(Fitted {
        parameters: refined.parameters,
        fit_percent,
        space,
        initial: Some(refined.initial),
        values: refined.values,
        at_bound,
        uncertainty: Some(refined.uncertainty),
        iterations: 0,
        warnings: codes,
    })
}

/// The bounds that values stand at.
fn sides(space: &Space, values: &[f64]) -> Vec<Option<&'static str>> {
    space.free().iter().zip(values).map(|(axis, value)| side(axis, *value)).collect()
}

/// Codes of what bounds and fit say.
fn codes(at_bound: &[Option<&'static str>], fit_percent: [Option<f64>; 2]) -> Vec<&'static str> {
    let bound = at_bound.iter().any(Option::is_some).then_some("at_bound");
    bound.into_iter().chain(poor_fit(fit_percent).map(|warning| warning.code)).collect()
}

/// The space of a search: bounds that follow the Steiglitz–McBride estimate do so where there is one.
///
/// # Errors
/// As for a problem.
pub fn search_space(records: &[Record], spec: &IdentifySpec) -> Result<Space> {
    needs_voltage(records)?;
    if spec.is_extended() {
        return named_space(records, spec);
    }
    if spec.auto_bounds.is_empty() {
        return Ok(spec.space.clone());
    }
    match steiglitz_mcbride(records, spec, &fit_problem(records, &spec.space, spec.model)?)? {
        Ok(estimate) => around(spec, &estimate),
        Err(_) => Ok(spec.space.clone()),
    }
}

/// What the recordings cannot give, said before a fit.
///
/// # Errors
/// As [`super::identify`].
pub fn check(records: &[Record], spec: &IdentifySpec, problem: &Problem) -> Result<()> {
    checks::before(records, spec, problem)
}
