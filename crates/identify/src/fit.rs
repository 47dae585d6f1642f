//! Identification in large batches, for sweeps and comparisons of methods.
//!
//! [`fit_on`] is Steiglitz–McBride with the polish. A population search is split so that many searches can share a batch:
//! [`PreparedSearch`] runs the stages of the pipeline before and after the search. Each result is verified and gets a level of
//! trust as from [`super::identify`]; the diagnosis of the recordings and the search of the box are shared by all runs.

use super::automatic::{Chosen, choose, without_undersampled};
use super::checks;
use super::dc_motor::DcMotor;
use super::forward_selection::{Alternative, SelectionStep};
use super::model_selection::Selection;
use super::open_groups::Unidentified;
use super::pipeline::{Conclusion, conclude, findings, tested};
use super::prepare::Prepared;
use super::refine::{Fit, from_search};
use super::result::{Identification, left_out};
use super::search::SearchResult;
use super::shared_reference::SharedReference;
use super::spec::IdentifySpec;
use super::start::{around, requested_space, start, steiglitz_mcbride};
use super::trust::motor::trust;
use super::trust::{is_noise, missed, set as set_trust};
use super::unidentified::fix_unidentified;
use super::verify::{Verification, verify};
use super::warnings;
use crate::analysis::{FitMetrics, fit_percent};
use crate::device::DeviceUsed;
use motorfit_core::Result;
use motorfit_evaluate::{Model, Problem, Scalar};
use motorfit_optimize::Stop;
use motorfit_record::Record;
use motorfit_record::warning::Warning;
use std::borrow::Cow;
use std::sync::Arc;

/// Recordings with the warnings that [`crate::analysis::warnings_of_records`] returns for them.
pub type Diagnosed<'a> = (&'a [Record], &'a [Warning]);

/// Identifies a linear motor by Steiglitz–McBride with the polish of the spec. The two problems of the recordings are the one
/// whose cost is reported and that of a fit ([`motorfit_estimate::fit_problem`]). The cost of the unrefined estimate is not
/// computed.
///
/// # Errors
/// Returns the same errors as [`super::identify`] with [`Method::SteiglitzMcBride`](super::Method::SteiglitzMcBride).
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
    // If the residuals are noise, no other optimum fits better, and the search of the box can be omitted.
    let verified = |fit: &Fit, is_noise: bool| match is_noise {
        true => Verification::none(),
        false => verify(&prepared, fit, Some(&estimate)).verification,
    };
    finished(&prepared, fit, &verified, (Vec::new(), diagnosis))
}

/// Returns a copy of a result with its cost on another problem of the same recordings.
#[must_use]
pub fn with_cost_on(problem: &Problem, found: &Identification) -> Identification {
    let problem = problem.with_space(found.space.clone()).starting_from(&found.initial);
    Identification { cost: Scalar::cost(&problem, &found.values), ..found.clone() }
}

/// Returns true if all recordings have a voltage, a current and a speed. For others the model depends on the polish.
#[must_use]
pub fn has_all_channels(records: &[Record]) -> bool {
    records.iter().all(|record| record.measured().iter().all(Option::is_some))
}

/// The result of a population search.
#[derive(Debug, Clone, Copy)]
pub struct SearchRun<'a> {
    /// Best candidate, one value per free axis.
    pub values: &'a [f64],
    /// Number of evaluated candidates.
    pub evaluations: u64,
    /// Device that evaluated.
    pub device: &'a DeviceUsed,
}

/// A population search that is run by the caller, possibly in one batch with others.
pub struct PreparedSearch {
    problem: Arc<Problem>,
    selection: Option<Vec<SelectionStep>>,
    alternatives: Vec<Alternative>,
    reference: Option<SharedReference>,
    model: Model,
    /// Recordings with undersampled segments excluded, if the model selection excludes them.
    masked: Option<Vec<Record>>,
}

impl PreparedSearch {
    /// Checks the recordings, selects the model and sets the bounds. Each run is verified by a separate search of the box.
    ///
    /// # Errors
    /// Returns the errors of the stages of [`super::identify`] before the search.
    pub fn new(records: &[Record], spec: &IdentifySpec) -> Result<Self> {
        Self::prepare(records, spec, false)
    }

    /// Prepares a search like [`PreparedSearch::new`], and searches the complete box once for the verification of all runs.
    ///
    /// # Errors
    /// Returns the same errors as [`PreparedSearch::new`].
    pub fn with_reference(records: &[Record], spec: &IdentifySpec) -> Result<Self> {
        Self::prepare(records, spec, true)
    }

    fn prepare(records: &[Record], spec: &IdentifySpec, has_reference: bool) -> Result<Self> {
        // With fixed bounds and all channels the linear motor needs an estimate only for the reference.
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
        let problem = prepared.searched(requested_space(records, spec)?);
        checks::before(records, spec, &problem)?;
        let reference = match has_reference {
            true => Some(SharedReference::new(&prepared, &problem, &start(&prepared)?, None)),
            false => None,
        };
        let model = spec.model;
        Ok(Self { problem, selection: None, alternatives: Vec::new(), reference, model, masked: None })
    }

    /// Returns the problem that the search is to minimize.
    #[must_use]
    pub fn problem(&self) -> &Arc<Problem> {
        &self.problem
    }

    /// Returns the result of a run of the search with the polish of `spec`. The polish may differ from that of the preparation
    /// if the recordings have all channels.
    ///
    /// # Errors
    /// Returns the errors of the stages of [`super::identify`] after the search.
    pub fn finish(
        &self,
        (records, diagnosis): Diagnosed<'_>,
        spec: &IdentifySpec,
        run: SearchRun<'_>,
    ) -> Result<Identification> {
        let SearchRun { values, evaluations, device } = run;
        let found = SearchResult::new(spec.method.name(), values.to_vec(), Stop::BudgetSpent, evaluations);
        let found = SearchResult { device: device.clone(), ..found };
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

/// Checks and verifies a fit and returns its result with the level of trust.
fn finished(
    prepared: &Prepared<'_>,
    mut fit: Fit,
    verified: &dyn Fn(&Fit, bool) -> Verification,
    (alternatives, diagnosis): (Vec<Alternative>, &[Warning]),
) -> Result<Identification> {
    let (records, spec) = (prepared.records, prepared.spec.as_ref());
    let dropped = fix_unidentified(prepared, &mut fit, Unidentified::default())?;
    let residual_tests = tested(prepared, &fit);
    let verification = verified(&fit, is_noise(&residual_tests, &missed(fit.problem.as_ref(), &fit.refined.sigmas)));
    let of_recordings = warnings::as_taken(diagnosis, records, spec);
    let mut warnings = warnings::with_normalized(of_recordings, prepared.normalized.as_ref());
    let Conclusion { warnings: own, unidentified, missed } = conclude(prepared, &mut fit, &dropped)?;
    warnings.extend(own);
    let result = reported(prepared, fit)?;
    let machine = DcMotor { model: spec.model, unidentified, ..result.machine };
    let mut result = Identification { machine, verification, residual_tests, alternatives, ..result };
    result.estimates = result.listed();
    result.machine.identified = result.identified_characteristics(records);
    warnings.extend(warnings::of_result(&result, None));
    warnings.extend(findings(prepared, &result));
    // The result of a run has only one warning of each code.
    for warning in warnings {
        if result.warnings.iter().all(|known| known.code != warning.code) {
            result.warnings.push(warning);
        }
    }
    let judged = trust(records, spec, &result, &missed);
    set_trust(&mut result, judged);
    Ok(result)
}

/// Returns the parameters of a fit with its fit and residual deviations per channel.
fn reported(prepared: &Prepared<'_>, fit: Fit) -> Result<Identification> {
    if prepared.spec.is_polished() {
        // The sums of squares of the refinement make another simulation unnecessary.
        let fit_percent = fit_percent(prepared.records, &fit.refined);
        checks::fit(prepared.records, &prepared.spec, &fit_percent)?;
        let problem = fit.problem.with_space(fit.space).starting_from(&fit.refined.initial);
        let fit_percent = fit_percent.to_vec();
        return Ok(Identification { fit_percent, ..Identification::new(&problem, fit.found, Some(fit.refined)) });
    }
    let metrics = FitMetrics::of(&prepared.fitted(fit.problem.space()), &fit.found.values);
    Ok(Identification {
        fit_percent: metrics.fit_percent(),
        residual_sigma: metrics.residual_sigma(),
        ..Identification::new(&fit.problem, fit.found, None)
    })
}
