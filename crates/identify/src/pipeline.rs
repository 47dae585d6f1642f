//! The pipeline of an identification: prepare → start → select → refine → verify → analyse → result.

use super::automatic::{Chosen, choose, without_undersampled};
use super::checks;
use super::dc_motor::DcMotor;
use super::lacking::{Lacking, lacking};
use super::late_voltage::late_voltage;
use super::method::Method;
use super::model_selection::Selection;
use super::normalized::NormalizedModel;
use super::open_groups::Unidentified;
use super::prepare::Prepared;
use super::refine::{Fit, Observer, fit};
use super::result::{Identification, SearchOutcome, left_out};
use super::result_warnings::residuals_follow_input;
use super::spec::IdentifySpec;
use super::trust::motor::{OUTPUTS, trust};
use super::trust::{Missed, missed, set as set_trust};
use super::unidentified::fix_unidentified;
use super::verify::{settle, verify};
use super::warnings;
use crate::analysis::{
    Characteristics, FitMetrics, ResidualTests, coarse_rate, homogeneity, input_noise, intersample_of_current,
    intersample_of_voltage, noise_floor, regressions, residual_tests,
};
use crate::device::with_threads;
use motorfit_core::clock::Instant;
use motorfit_core::{Error, ErrorKind, Result};
use motorfit_estimate::robust_uncertainty;
use motorfit_evaluate::Scalar;
use motorfit_motor::{Input, Parameter, Scope, Space, With};
use motorfit_optimize::Progress;
use motorfit_record::warning::{Warning, name_of};
use motorfit_record::{Record, check_of_motor, driver};
use std::ops::ControlFlow;

/// Identifies one motor from one or more recordings (several: one joint fit).
///
/// # Errors
/// Returns the same errors as [`identify_with`].
pub fn identify(records: &[Record], spec: &IdentifySpec) -> Result<Identification> {
    identify_with(records, spec, &mut |_| ControlFlow::Continue(()))
}

/// Identifies one motor like [`identify`] and calls `observe` after each generation. If `observe` breaks, the search ends and
/// its best candidate is refined.
///
/// # Errors
/// Returns `Usage` for an invalid spec; `Data` for a recording that is given twice; `Device` if the requested device is not
/// available or fails; `NotIdentified` if nothing drives the motor, no sample has weight, there are no more measured values
/// than free parameters, every candidate diverges, Steiglitz–McBride fails where it is requested by name, the model fits no
/// channel, or the recordings do not identify a free parameter.
pub fn identify_with(
    records: &[Record],
    spec: &IdentifySpec,
    observe: &mut (dyn FnMut(&Progress) -> ControlFlow<()> + Send),
) -> Result<Identification> {
    let started = Instant::now();
    check_of_motor(records)?;
    let mut result = with_threads(spec.threads, || run(records, spec, observe))?;
    result.seconds = started.elapsed().as_secs_f64();
    Ok(result)
}

fn run(records: &[Record], spec: &IdentifySpec, observe: &mut Observer<'_>) -> Result<Identification> {
    let of_recordings = || warnings::of_recordings(records, spec);
    let (of_recordings, result) = rayon::join(of_recordings, || estimated(records, spec, observe));
    let hinted = |error| of_the_only_file(records, warnings::with_findings(error, &of_recordings));
    let (mut result, normalized, missed) = result.map_err(hinted)?;
    let mut warnings = warnings::with_normalized(of_recordings, normalized.as_ref());
    warnings.append(&mut result.warnings);
    result.warnings = warnings;
    let judged = trust(records, spec, &result, &missed);
    set_trust(&mut result, judged);
    Ok(result)
}

/// Adds the file to an error other than `Usage` if there is only one recording.
fn of_the_only_file(records: &[Record], error: Error) -> Error {
    let path = match records {
        [record] if error.kind() != ErrorKind::Usage => record.source().path.as_deref(),
        _ => None,
    };
    path.into_iter().fold(error, Error::in_file)
}

/// Runs the stages. Returns the result, the normalized model if a channel is missing, and the channels
/// with residuals far above the noise.
fn estimated(
    records: &[Record],
    spec: &IdentifySpec,
    observe: &mut Observer<'_>,
) -> Result<(Identification, Option<NormalizedModel>, Vec<Missed>)> {
    let masked = without_undersampled(records, spec);
    let Chosen { prepared, start, selection } = choose(records, masked.as_deref(), spec)?;
    let left_out = left_out(records, prepared.records);
    let records = prepared.records;
    let Selection { space, steps: selection, alternatives, best } = selection;
    let mut fit = fit(&prepared, &start, &space, best.map(|best| best.refined), observe)?;
    let mut dropped = fix_unidentified(&prepared, &mut fit, Unidentified::default())?;
    // The residual tests run in parallel with the verification, which rarely replaces the fit.
    let estimate = start.estimate.as_ref().ok().filter(|estimate| !estimate.is_resampled);
    let verified = || verify(&prepared, &fit, estimate);
    let (verified, tests) = rayon::join(verified, || tested(&prepared, &fit));
    let (verification, is_replaced) = settle(&prepared, &mut fit, estimate, verified)?;
    if is_replaced {
        dropped = fix_unidentified(&prepared, &mut fit, dropped)?;
    }
    let residual_tests = if is_replaced { tested(&prepared, &fit) } else { tests };
    let Conclusion { mut warnings, unidentified, missed } = conclude(&prepared, &mut fit, &dropped)?;
    let found = assembled(&prepared, fit);
    let found = Identification { selection, alternatives, left_out, ..found };
    let machine = DcMotor { unidentified, ..found.machine };
    let mut result = Identification { machine, verification, residual_tests, ..found };
    result.estimates = result.listed();
    result.machine.identified = result.identified_characteristics(records);
    checks::fit(records, &prepared.spec, &result.fit_percent)?;
    warnings.extend(warnings::of_result(&result, start.estimate.as_ref().err().copied()));
    result.warnings = warnings;
    analyse(&prepared, &mut result)?;
    Ok((result, prepared.normalized, missed))
}

/// The findings about a finished fit.
pub(super) struct Conclusion {
    pub warnings: Vec<Warning>,
    pub unidentified: Vec<(Parameter, Scope)>,
    /// Channels of recordings with residuals far above the noise.
    pub missed: Vec<Missed>,
}

/// Widens the standard errors of a finished fit for correlated residuals and collects the findings about it.
///
/// # Errors
/// Returns `NotIdentified` if the recordings do not identify a free parameter.
pub(super) fn conclude(prepared: &Prepared<'_>, fit: &mut Fit, dropped: &Unidentified) -> Result<Conclusion> {
    let (records, spec) = (prepared.records, prepared.spec.as_ref());
    if spec.is_polished() {
        fit.refined.uncertainty = robust_uncertainty(&prepared.fitted(&fit.space), &fit.refined);
    }
    let mut warnings = std::mem::take(&mut fit.found.warnings);
    warnings.extend(checks::after(records, spec, &fit.space, &fit.refined, prepared.open())?);
    if spec.is_polished() {
        warnings.extend(homogeneity(records, &prepared.fitted(&fit.space), &fit.refined, prepared.open()));
    }
    warnings.extend(dropped.warnings());
    let unidentified = unidentified(prepared, &fit.space, dropped);
    let extensions = fit.space.features().extensions();
    let late = if spec.is_polished() { late_voltage(prepared, fit) } else { None };
    warnings.extend(late.map(|late| late.warning(&extensions, spec.with == With::Auto)));
    let lacking = if spec.is_polished() { lacking(prepared, fit) } else { Lacking::default() };
    warnings.extend(lacking.warnings(&extensions, spec.with == With::Auto));
    let missed = missed(fit.problem.as_ref(), &fit.refined.sigmas);
    Ok(Conclusion { warnings, unidentified, missed })
}

/// Returns the residual tests of a refined fit, one entry per recording; empty without a refinement.
pub(super) fn tested(prepared: &Prepared<'_>, fit: &Fit) -> Vec<ResidualTests> {
    if !prepared.spec.is_polished() {
        return Vec::new();
    }
    let problem = fit.problem.with_space(fit.space.clone()).starting_from(&fit.refined.initial);
    residual_tests(prepared.records, &problem, &fit.refined.values, &[])
}

/// Returns the parameters that are not identifiable because a channel is missing, and those that this fit does not identify.
fn unidentified(prepared: &Prepared<'_>, space: &Space, dropped: &Unidentified) -> Vec<(Parameter, Scope)> {
    let free = space.free().iter().map(|axis| (axis.parameter, axis.scope));
    let fixed = space.fixed().iter().map(|(parameter, scope, _)| (*parameter, *scope));
    let is_open = |of: &(Parameter, Scope)| prepared.open().contains(&of.0);
    let mut all: Vec<_> = free.chain(fixed).filter(is_open).chain(dropped.all()).collect();
    all.sort_by_key(|(parameter, scope)| scope.order(*parameter));
    all.dedup();
    all
}

/// Stage 6, analyse: adds warnings about the finished fit, the regressions and the noise floor.
fn analyse(prepared: &Prepared<'_>, result: &mut Identification) -> Result<()> {
    let (records, spec) = (prepared.records, prepared.spec.as_ref());
    result.warnings.extend(findings(prepared, result));
    let time_constant = Characteristics::of(&*result).map(|c| c.time_constant.value);
    result.machine.regressions = regressions(records, time_constant);
    result.machine.noise_floor = noise_floor(&records.iter().collect::<Vec<_>>(), spec.model)?;
    Ok(())
}

/// Returns the warnings about a finished fit that need its residual tests.
pub(super) fn findings(prepared: &Prepared<'_>, result: &Identification) -> Vec<Warning> {
    let (records, spec) = (prepared.records, prepared.spec.as_ref());
    let motor = result.into();
    let names: Vec<String> = records.iter().map(name_of).collect();
    let intersample = match (prepared.is_linear(), result.input) {
        (true, Input::Voltage) => intersample_of_voltage(records, spec.model, &motor),
        (false, Input::Current) => intersample_of_current(records, spec.model, &motor),
        _ => None,
    };
    let found = [
        intersample,
        input_noise(records, &motor),
        residuals_follow_input(result, &names, &OUTPUTS.map(str::to_owned), &format!("the {}", driver(records))),
        coarse_rate(records, &motor),
        warnings::long_dead_time(result),
    ];
    found.into_iter().flatten().collect()
}

/// Stage 7, result: assembles the result with its fit per channel and recording.
fn assembled(prepared: &Prepared<'_>, fit: Fit) -> Identification {
    let Fit { found, problem, refined, space } = fit;
    let refined = Some(refined).filter(|_| prepared.spec.is_polished());
    let cost = Scalar::cost(&problem, &found.values);
    let problem = problem.with_space(space);
    let problem = match &refined {
        Some(refined) => problem.starting_from(&refined.initial),
        None => problem,
    };
    let model = prepared.spec.model;
    let mut result = Identification::new(&problem, found, refined);
    result.machine.model = model;
    let each = FitMetrics::each(&problem, &result.values);
    result.fit_percent_by_recording = each.iter().map(FitMetrics::fit_percent).collect();
    let metrics = each.into_iter().fold(FitMetrics::default(), FitMetrics::and);
    result.fit_percent = metrics.fit_percent();
    if result.uncertainty.is_none() {
        result.residual_sigma = metrics.residual_sigma();
    }
    let is_fallback = prepared.spec.method == Method::Auto && !matches!(result.searched.method, "sm" | "grid");
    result.searched = SearchOutcome { is_fallback, cost, ..result.searched };
    result
}
