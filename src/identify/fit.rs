//! Identifications without the verification and without what judges a result: what a batch of thousands needs of each.
//!
//! [`fit_on`] is Steiglitz–McBride with the polish. A population search comes in two parts, so that many of them can be run in
//! lock step: [`PreparedSearch`] is what comes before it and what follows, by the stages of the pipeline.

use super::automatic::{Chosen, choose, without_undersampled};
use super::checks;
use super::models::SelectionStep;
use super::open_groups::Unidentified;
use super::pipeline::unidentified;
use super::prepare::Prepared;
use super::refine::from_search;
use super::result::{Identification, left_out};
use super::search::SearchResult;
use super::spec::IdentifySpec;
use super::start::{around, asked_space, steiglitz_mcbride};
use super::unidentified::fix_unidentified;
use super::warnings;
use crate::Result;
use crate::analysis::{FitMetrics, fit_percent};
use crate::estimate::widened;
use crate::evaluate::{Model, Problem, Scalar};
use crate::optimize::Stop;
use crate::record::Record;
use std::borrow::Cow;
use std::sync::Arc;

/// Steiglitz–McBride, then the spec's polish, of a linear motor, on the problem whose cost is reported and that of a fit
/// ([`crate::estimate::fit_problem`]), both made of the recordings. Nothing verifies or judges the result, and the cost of what was searched is
/// not computed.
///
/// # Errors
/// As [`super::identify`] with that method.
pub fn fit_on(
    (problem, plain): (&Problem, &Problem),
    records: &[Record],
    spec: &IdentifySpec,
) -> Result<Identification> {
    checks::before(records, spec, problem)?;
    let estimate = steiglitz_mcbride(records, spec, plain)??;
    let prepared = Prepared::given(records, spec, problem, plain);
    let problem = prepared.searched(around(spec, &[estimate.parameters.to_array()])?);
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
    selection: Option<Vec<SelectionStep>>,
    model: Model,
    /// The recordings without the samples that do not count.
    masked: Option<Vec<Record>>,
}

impl PreparedSearch {
    /// Checks recordings, selects the model and sets the bounds.
    ///
    /// # Errors
    /// As [`super::identify`].
    pub fn new(records: &[Record], spec: &IdentifySpec) -> Result<Self> {
        // The estimate of a linear motor is needed for bounds alone.
        if !spec.is_extended() && spec.auto_bounds.is_empty() && has_all_channels(records) {
            let prepared = Prepared::new(records, Cow::Borrowed(spec))?;
            let problem = prepared.searched(asked_space(records, spec)?);
            checks::before(records, spec, &problem)?;
            return Ok(Self { problem, selection: None, model: spec.model, masked: None });
        }
        let masked = without_undersampled(records, spec);
        let Chosen { prepared, selection, .. } = choose(records, masked.as_deref(), spec)?;
        let (problem, model) = (prepared.searched(selection.space), prepared.spec.model);
        let is_masked = !left_out(records, prepared.records).is_empty();
        Ok(Self { problem, selection: selection.steps, model, masked: masked.filter(|_| is_masked) })
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
        let SearchRun { values, evaluations, device: [device_kind, precision] } = run;
        let found = SearchResult::new(spec.method.name(), values.to_vec(), Stop::BudgetSpent, evaluations);
        let found = SearchResult { device_kind, precision, ..found };
        let spec = IdentifySpec { model: self.model, ..spec.clone() };
        let prepared = Prepared::new(self.masked.as_deref().unwrap_or(records), Cow::Owned(spec))?;
        let left_out = left_out(records, prepared.records);
        Ok(Identification { selection: self.selection.clone(), left_out, ..finished(&prepared, &self.problem, found)? })
    }
}

/// The result of a search or an estimate: refined, checked and reported, or as it is without a polish.
fn finished(prepared: &Prepared<'_>, problem: &Arc<Problem>, found: SearchResult) -> Result<Identification> {
    let mut warnings = warnings::with_normalized(Vec::new(), prepared.normalized.as_ref());
    let mut result = if prepared.spec.is_polished() {
        let mut fit = from_search(prepared, problem, found, Vec::new())?;
        let dropped = fix_unidentified(prepared, &mut fit, Unidentified::default())?;
        fit.refined.uncertainty = widened(&prepared.fitted(&fit.space), &fit.refined);
        warnings.extend(checks::after(prepared.records, &prepared.spec, &fit.space, &fit.refined)?);
        warnings.extend(dropped.warnings());
        let unidentified = unidentified(prepared, &fit.space, &dropped);
        // From the sums of the refinement: no simulation is needed.
        let fit_percent = fit_percent(prepared.records, &fit.refined);
        checks::fit(prepared.records, &prepared.spec, fit_percent)?;
        let problem = problem.with_space(fit.space).starting_from(&fit.refined.initial);
        Identification { unidentified, fit_percent, ..Identification::new(&problem, fit.found, Some(fit.refined)) }
    } else {
        let metrics = FitMetrics::of(prepared.records, &prepared.fitted(problem.space()), &found.values);
        Identification {
            unidentified: unidentified(prepared, problem.space(), &Unidentified::default()),
            fit_percent: metrics.fit_percent(),
            residual_sigma: metrics.residual_sigma(),
            ..Identification::new(problem, found, None)
        }
    };
    result.model = prepared.spec.model;
    result.warnings = warnings;
    // A code once: the lines of a batch have no more of them.
    for warning in warnings::of_result(&result, None) {
        if result.warnings.iter().all(|known| known.code != warning.code) {
            result.warnings.push(warning);
        }
    }
    Ok(result)
}
