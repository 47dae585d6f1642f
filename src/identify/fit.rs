//! Identifications without the verification and without what judges a result: what a batch of thousands needs of each.
//!
//! [`fit`] is Steiglitz–McBride with the polish. A population search comes in two parts, so that many of them can be run in
//! lock step: [`PreparedSearch`] is what comes before it and what follows, by the stages of the pipeline.

use super::checks;
use super::current_driven::needs_voltage;
use super::model_selection::{ModelSelection, named_space, select};
use super::pipeline::unidentified;
use super::prepare::Prepared;
use super::refine::from_search;
use super::result::{Identification, SearchOutcome};
use super::search::SearchResult;
use super::spec::IdentifySpec;
use super::start::{around, asked_space, start, steiglitz_mcbride};
use super::unidentified::{fix_unidentified, not_told};
use super::verify::Verification;
use super::warnings;
use crate::Result;
use crate::analysis::{FitMetrics, fit_percent};
use crate::estimate::{Uncertainty, fit_problem};
use crate::evaluate::{Problem, Scalar};
use crate::motor::{Parameter, Space};
use crate::optimize::Stop;
use crate::record::Record;
use crate::warning::Warning;
use std::sync::Arc;

/// Steiglitz–McBride, then the spec's polish, of a linear motor. Nothing verifies or judges the result, and the cost of what
/// was searched is not computed.
///
/// # Errors
/// As [`super::identify`] with that method.
pub fn fit(records: &[Record], spec: &IdentifySpec) -> Result<Identification> {
    needs_voltage(records)?;
    let problem = Problem::new(records, spec.model, spec.space.clone(), spec.criterion)?;
    fit_on((&problem, &fit_problem(records, &spec.space, spec.model)?), records, spec)
}

/// Like [`fit`], on the problem whose cost is reported and that of a fit ([`fit_problem`]), both made of the recordings.
///
/// # Errors
/// As [`fit`].
pub fn fit_on(
    (problem, plain): (&Problem, &Problem),
    records: &[Record],
    spec: &IdentifySpec,
) -> Result<Identification> {
    checks::before(records, spec, problem)?;
    let estimate = steiglitz_mcbride(records, spec, plain)??;
    let prepared = Prepared::given(records, spec, problem, plain);
    let problem = prepared.searched(around(spec, &estimate)?);
    let found = SearchResult::of_estimate(&estimate, &problem);
    finished(&prepared, &problem, found)
}

/// The same result with its cost on another problem of the same recordings.
#[must_use]
pub fn with_cost_on(problem: &Problem, found: &Identification) -> Identification {
    let problem = problem.with_space(found.space.clone()).starting_from(&found.initial);
    Identification { cost: Scalar::cost(&problem, &found.values), ..found.clone() }
}

/// Whether all recordings have a voltage, a current and a speed. Others are fitted by a model that depends on the polish.
#[must_use]
pub fn has_all_channels(records: &[Record]) -> bool {
    records.iter().all(|record| record.measured().iter().all(Option::is_some))
}

/// What a population search found.
#[derive(Debug, Clone, Copy)]
pub struct SearchRun<'a> {
    /// The best candidate, one value per free axis.
    pub values: &'a [f64],
    /// Candidates evaluated.
    pub evaluations: u64,
    /// What evaluated: cpu or gpu, and its numbers.
    pub device: [&'static str; 2],
}

/// A population search that is to be run beside others.
pub struct PreparedSearch {
    problem: Arc<Problem>,
    selection: Option<ModelSelection>,
}

impl PreparedSearch {
    /// Checks recordings, selects the model and sets the bounds.
    ///
    /// # Errors
    /// As [`super::identify`].
    pub fn new(records: &[Record], spec: &IdentifySpec) -> Result<Self> {
        let prepared = Prepared::new(records, spec)?;
        let asked = prepared.searched(asked_space(records, &prepared.spec)?);
        checks::before(records, &prepared.spec, &asked)?;
        // The estimate of a linear motor is needed for bounds alone.
        if prepared.is_linear() && spec.auto_bounds.is_empty() {
            return Ok(Self { problem: asked, selection: None });
        }
        let model = select(&prepared, &start(&prepared)?)?;
        Ok(Self { problem: prepared.searched(model.space), selection: model.selection })
    }

    /// What candidates are evaluated on.
    #[must_use]
    pub fn problem(&self) -> &Arc<Problem> {
        &self.problem
    }

    /// The result of the search, with the spec's polish. The spec may differ from that of the preparation in its polish where
    /// the recordings have all channels.
    ///
    /// # Errors
    /// As [`super::identify`].
    pub fn finish(&self, records: &[Record], spec: &IdentifySpec, run: SearchRun<'_>) -> Result<Identification> {
        let found = SearchResult {
            method: spec.method.name(),
            values: run.values.to_vec(),
            stop: Stop::BudgetSpent,
            evaluations: run.evaluations,
            history: Vec::new(),
            device_kind: run.device[0],
            device: String::new(),
            precision: run.device[1],
            cost_difference: None,
            warnings: Vec::new(),
        };
        let prepared = Prepared::new(records, spec)?;
        Ok(Identification { selection: self.selection.clone(), ..finished(&prepared, &self.problem, found)? })
    }
}

/// What is told of a fit beside what was searched.
struct Known {
    values: Vec<f64>,
    fit_percent: [Option<f64>; 2],
    residual_sigma: [Option<f64>; 2],
    uncertainty: Option<Uncertainty>,
    converged: bool,
    unidentified: Vec<Parameter>,
    warnings: Vec<Warning>,
}

/// The result of a search or an estimate: refined, checked and reported, or as it is without a polish.
fn finished(prepared: &Prepared<'_>, problem: &Arc<Problem>, found: SearchResult) -> Result<Identification> {
    let mut warnings = warnings::with_normalized(Vec::new(), prepared.normalized.as_ref());
    if !prepared.spec.is_polished() {
        let values = found.values.clone();
        let metrics = FitMetrics::of(prepared.records, &prepared.fitted(problem.space()), &values);
        let known = Known {
            values,
            fit_percent: metrics.fit_percent(),
            residual_sigma: metrics.residual_sigma(),
            uncertainty: None,
            converged: true,
            unidentified: prepared.open().to_vec(),
            warnings,
        };
        return Ok(reported(problem, found, known));
    }
    let mut fit = from_search(prepared, problem, found, Vec::new())?;
    let dropped = fix_unidentified(prepared, &mut fit)?;
    warnings.extend(checks::after(prepared.records, &prepared.spec, &fit.space, &fit.refined)?);
    warnings.extend(dropped.iter().copied().map(not_told));
    let unidentified = unidentified(prepared, &fit, &dropped);
    // From the sums of the refinement: no simulation is needed.
    let fit_percent = fit_percent(prepared.records, &fit.refined);
    checks::fit(prepared.records, &prepared.spec, fit_percent)?;
    let refined = fit.refined;
    let problem = problem.with_space(fit.space).starting_from(&refined.initial);
    let known = Known {
        values: refined.values,
        fit_percent,
        residual_sigma: refined.sigma,
        uncertainty: Some(refined.uncertainty),
        converged: refined.converged,
        unidentified,
        warnings,
    };
    Ok(reported(&problem, fit.found, known))
}

fn reported(problem: &Problem, found: SearchResult, known: Known) -> Identification {
    let mut result = Identification {
        input: problem.input(),
        parameters: problem.parameters(&known.values, 0),
        cost: Scalar::cost(problem, &known.values),
        searched: SearchOutcome {
            method: found.method,
            is_fallback: false,
            parameters: problem.parameters(&found.values, 0),
            cost: f64::NAN,
        },
        space: problem.space().clone(),
        initial: problem.signals().iter().map(|signals| signals.initial).collect(),
        values: known.values,
        unidentified: known.unidentified,
        fit_percent: known.fit_percent,
        residual_sigma: known.residual_sigma,
        uncertainty: known.uncertainty,
        converged: known.converged,
        selection: None,
        residual_tests: Vec::new(),
        verification: Verification::none(),
        warnings: known.warnings,
        stop: found.stop,
        evaluations: found.evaluations,
        history: found.history,
        device_kind: found.device_kind,
        device: found.device,
        precision: found.precision,
        cost_difference: None,
        validation: None,
        regressions: Vec::new(),
        noise_floor: None,
        seconds: 0.0,
    };
    // A code once: the lines of a batch have no more of them.
    for warning in warnings::of_result(&result, None) {
        if result.warnings.iter().all(|known| known.code != warning.code) {
            result.warnings.push(warning);
        }
    }
    result
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
