//! Identifications of which thousands are made: what a batch needs of each.
//!
//! [`fit_on`] is Steiglitz–McBride with the polish. A population search comes in two parts, so that many of them can be run in
//! lock step: [`PreparedSearch`] is what comes before it and what follows, by the stages of the pipeline. A result is verified
//! and judged as [`super::identify`] judges it; recordings are looked through and their box is searched once for all runs.

use super::automatic::{Chosen, choose, without_undersampled};
use super::checks;
use super::model_selection::Selection;
use super::models::{Alternative, SelectionStep};
use super::open_groups::Unidentified;
use super::pipeline::{Conclusion, conclude, findings, missed, tested};
use super::prepare::Prepared;
use super::refine::{Fit, from_search};
use super::result::{Identification, left_out};
use super::search::SearchResult;
use super::shared_reference::SharedReference;
use super::spec::IdentifySpec;
use super::start::{around, asked_space, start, steiglitz_mcbride};
use super::trust::{is_noise, trust};
use super::unidentified::fix_unidentified;
use super::verify::{Verification, verify};
use super::warnings;
use crate::Result;
use crate::analysis::{FitMetrics, fit_percent};
use crate::evaluate::{Model, Problem, Scalar};
use crate::optimize::Stop;
use crate::record::Record;
use crate::warning::Warning;
use std::borrow::Cow;
use std::sync::Arc;

/// Recordings, with what [`crate::analysis::warnings_of_records`] says of them.
pub type Diagnosed<'a> = (&'a [Record], &'a [Warning]);

/// Steiglitz–McBride, then the spec's polish, of a linear motor, on the problem whose cost is reported and that of a fit
/// ([`crate::estimate::fit_problem`]), both made of the recordings. The cost of what was searched is not computed.
///
/// # Errors
/// As [`super::identify`] with that method.
pub fn fit_on(
    (problem, plain): (&Problem, &Problem),
    (records, diagnosis): Diagnosed<'_>,
    spec: &IdentifySpec,
) -> Result<Identification> {
    checks::before(records, spec, problem)?;
    let estimate = steiglitz_mcbride(records, spec, plain)??;
    let prepared = Prepared::given(records, spec, problem, plain);
    let problem = prepared.searched(around(spec, &[estimate.parameters.to_array()])?);
    let found = SearchResult::of_estimate(&estimate, &problem);
    let fit = from_search(&prepared, &problem, found, Vec::new())?;
    // A fit whose residuals are noise is not improved by another optimum: the box need not be searched.
    let verified = |fit: &Fit, is_noise: bool| match is_noise {
        true => Verification::none(),
        false => verify(&prepared, fit, Some(&estimate)).verification,
    };
    finished(&prepared, fit, &verified, (Vec::new(), diagnosis))
}

/// The same result with its cost on another problem of the same recordings.
#[must_use]
pub fn with_cost_on(problem: &Problem, found: &Identification) -> Identification {
    let problem = problem.with_space(found.space.clone()).starting_from(&found.initial);
    Identification { cost: Scalar::cost(&problem, &found.values), ..found.clone() }
}

/// Returns whether all recordings have a voltage, a current and a speed. Others are fitted by a model that depends on the polish.
#[must_use]
pub fn has_all_channels(records: &[Record]) -> bool {
    records.iter().all(|record| record.measured().iter().all(Option::is_some))
}

/// The result of a population search.
#[derive(Debug, Clone, Copy)]
pub struct SearchRun<'a> {
    /// The best candidate, one value per free axis.
    pub values: &'a [f64],
    /// Candidates evaluated.
    pub evaluations: u64,
    /// The device that evaluated: cpu or gpu, and its precision.
    pub device: [&'static str; 2],
}

/// A population search that is to be run beside others.
pub struct PreparedSearch {
    problem: Arc<Problem>,
    selection: Option<Vec<SelectionStep>>,
    alternatives: Vec<Alternative>,
    reference: Option<SharedReference>,
    model: Model,
    /// The recordings without the samples that do not count.
    masked: Option<Vec<Record>>,
}

impl PreparedSearch {
    /// Checks recordings, selects the model and sets the bounds. What such a search finds is verified run by run.
    ///
    /// # Errors
    /// As [`super::identify`].
    pub fn new(records: &[Record], spec: &IdentifySpec) -> Result<Self> {
        Self::prepare(records, spec, false)
    }

    /// Prepares a search, and searches the whole box once for the verification of all its runs.
    ///
    /// # Errors
    /// As [`super::identify`].
    pub fn with_reference(records: &[Record], spec: &IdentifySpec) -> Result<Self> {
        Self::prepare(records, spec, true)
    }

    fn prepare(records: &[Record], spec: &IdentifySpec, has_reference: bool) -> Result<Self> {
        // The estimate of a linear motor is needed for bounds and the reference alone.
        if !spec.is_extended() && spec.auto_bounds.is_empty() && has_all_channels(records) {
            return Self::bounded(records, spec, has_reference);
        }
        let masked = without_undersampled(records, spec);
        let Chosen { prepared, start, selection } = choose(records, masked.as_deref(), spec)?;
        let Selection { space, steps: selection, alternatives, best } = selection;
        let (problem, optimum) = (prepared.searched(space), best.map(|best| best.refined.values));
        let reference = has_reference.then(|| SharedReference::new(&prepared, &problem, &start, optimum.as_deref()));
        let (model, is_masked) = (prepared.spec.model, !left_out(records, prepared.records).is_empty());
        drop(prepared);
        Ok(Self { problem, selection, alternatives, reference, model, masked: masked.filter(|_| is_masked) })
    }

    /// Prepares a search of a linear motor in the box of the spec.
    fn bounded(records: &[Record], spec: &IdentifySpec, has_reference: bool) -> Result<Self> {
        let prepared = Prepared::new(records, Cow::Borrowed(spec))?;
        let problem = prepared.searched(asked_space(records, spec)?);
        checks::before(records, spec, &problem)?;
        let reference = match has_reference {
            true => Some(SharedReference::new(&prepared, &problem, &start(&prepared)?, None)),
            false => None,
        };
        let model = spec.model;
        Ok(Self { problem, selection: None, alternatives: Vec::new(), reference, model, masked: None })
    }

    /// Returns settings of the problem.
    #[must_use]
    pub fn problem(&self) -> &Arc<Problem> {
        &self.problem
    }

    /// The result of the search, with the spec's polish. The spec may differ from that of the preparation in its polish where
    /// the recordings have all channels.
    ///
    /// # Errors
    /// As [`super::identify`].
    pub fn finish(
        &self,
        (records, diagnosis): Diagnosed<'_>,
        spec: &IdentifySpec,
        run: SearchRun<'_>,
    ) -> Result<Identification> {
        let SearchRun { values, evaluations, device: [device_kind, precision] } = run;
        let found = SearchResult::new(spec.method.name(), values.to_vec(), Stop::BudgetSpent, evaluations);
        let found = SearchResult { device_kind, precision, ..found };
        let spec = IdentifySpec { model: self.model, ..spec.clone() };
        let prepared = Prepared::new(self.masked.as_deref().unwrap_or(records), Cow::Owned(spec))?;
        let left_out = left_out(records, prepared.records);
        let fit = from_search(&prepared, &self.problem, found, Vec::new())?;
        let verified = |fit: &Fit, _| match &self.reference {
            Some(reference) => reference.verify(&prepared, fit),
            None => verify(&prepared, fit, None).verification,
        };
        let result = finished(&prepared, fit, &verified, (self.alternatives.clone(), diagnosis))?;
        Ok(Identification { selection: self.selection.clone(), left_out, ..result })
    }
}

/// The result of a fit, checked, verified and judged: refined, or as it was searched without a polish.
fn finished(
    prepared: &Prepared<'_>,
    mut fit: Fit,
    verified: &dyn Fn(&Fit, bool) -> Verification,
    (alternatives, diagnosis): (Vec<Alternative>, &[Warning]),
) -> Result<Identification> {
    let (records, spec) = (prepared.records, prepared.spec.as_ref());
    let dropped = fix_unidentified(prepared, &mut fit, Unidentified::default())?;
    let residual_tests = tested(prepared, &fit);
    let verification = verified(&fit, is_noise(&residual_tests, &missed(&fit)));
    let of_recordings = warnings::as_taken(diagnosis, records, spec);
    let mut warnings = warnings::with_normalized(of_recordings, prepared.normalized.as_ref());
    let Conclusion { warnings: own, unidentified, evidence } = conclude(prepared, &mut fit, &dropped)?;
    warnings.extend(own);
    let result = Identification { model: spec.model, ..reported(prepared, fit)? };
    let mut result = Identification { verification, unidentified, residual_tests, alternatives, ..result };
    warnings.extend(warnings::of_result(&result, None));
    warnings.extend(findings(prepared, &result));
    // A code once: the lines of a batch have no more of them.
    for warning in warnings {
        if result.warnings.iter().all(|known| known.code != warning.code) {
            result.warnings.push(warning);
        }
    }
    result.trust = trust(records, spec, &result, &evidence);
    Ok(result)
}

/// The parameters of a fit with how much they explain, as the polish leaves them.
fn reported(prepared: &Prepared<'_>, fit: Fit) -> Result<Identification> {
    if prepared.spec.is_polished() {
        // From the sums of the refinement: no simulation is needed.
        let fit_percent = fit_percent(prepared.records, &fit.refined);
        checks::fit(prepared.records, &prepared.spec, fit_percent)?;
        let problem = fit.problem.with_space(fit.space).starting_from(&fit.refined.initial);
        return Ok(Identification { fit_percent, ..Identification::new(&problem, fit.found, Some(fit.refined)) });
    }
    let metrics = FitMetrics::of(prepared.records, &prepared.fitted(fit.problem.space()), &fit.found.values);
    Ok(Identification {
        fit_percent: metrics.fit_percent(),
        residual_sigma: metrics.residual_sigma(),
        ..Identification::new(&fit.problem, fit.found, None)
    })
}
