//! Automatic choices besides the extensions: samples to exclude, and the intersample behaviour of the voltage.

use super::bic::gain;
use super::checks;
use super::forward_selection::INDISTINGUISHABLE;
use super::model_selection::{Selection, select};
use super::models::{Fit, Models};
use super::prepare::Prepared;
use super::spec::IdentifySpec;
use super::start::{Start, requested_space, start};
use crate::analysis::is_lively;
use motorfit_core::Result;
use motorfit_core::numeric::rms;
use motorfit_evaluate::Model;
use motorfit_motor::{Discretization, Extension, With};
use motorfit_record::{Record, is_driven_by_current};
use std::borrow::Cow;

/// Prepared recordings with the selected model.
pub(super) struct Chosen<'a> {
    pub prepared: Prepared<'a>,
    pub start: Start,
    pub selection: Selection,
}

/// Returns copies of the recordings with undersampled segments excluded; `None` if there are none, the current is the input, or
/// extensions are not selected automatically.
pub(super) fn without_undersampled(records: &[Record], spec: &IdentifySpec) -> Option<Vec<Record>> {
    if spec.with != With::Auto || is_driven_by_current(records) {
        return None;
    }
    let masked: Vec<Option<Record>> = records.iter().map(Record::without_undersampled).collect();
    let is_any = masked.iter().any(Option::is_some);
    is_any.then(|| masked.into_iter().zip(records).map(|(own, record)| own.unwrap_or_else(|| record.clone())).collect())
}

/// Runs stages 1 to 3: prepares recordings, estimates start values and selects the model. `masked` are the same recordings with
/// undersampled segments excluded. These segments stay excluded only if the model that is fitted to the other samples does not
/// fit them.
///
/// # Errors
/// Propagates the errors of [`Prepared::new`], [`checks::before`], [`start`] and [`select`].
pub(super) fn choose<'a>(
    records: &'a [Record],
    masked: Option<&'a [Record]>,
    spec: &'a IdentifySpec,
) -> Result<Chosen<'a>> {
    if let Some(masked) = masked {
        let chosen = with_intersample(on(masked, spec)?, spec)?;
        if !fits_all(&chosen, records) {
            return Ok(chosen);
        }
    }
    with_intersample(on(records, spec)?, spec)
}

/// Runs stages 1 to 3 on the given recordings with the intersample behaviour of the spec.
fn on<'a>(records: &'a [Record], spec: &'a IdentifySpec) -> Result<Chosen<'a>> {
    let prepared = Prepared::new(records, Cow::Borrowed(spec))?;
    checks::before(records, &prepared.spec, &prepared.searched(requested_space(records, &prepared.spec)?))?;
    let start = start(&prepared)?;
    let selection = select(&prepared, &start)?;
    Ok(Chosen { prepared, start, selection })
}

/// Repeats the model selection with the other intersample behaviour if that may fit better, and returns the better result. On a
/// tie the first one stays, since the two holds differ mostly by a delay of half a period, which an estimated dead time
/// absorbs. An input that seldom changes, such as the duty of a PWM, keeps its hold: a ramp to the first sample after a change fits a
/// change between samples about as well as a dead time does, and biases L and J. `spec` is the requested spec, because the spec of a
/// normalized model fixes parameters that the request leaves free.
fn with_intersample<'a>(first: Chosen<'a>, spec: &IdentifySpec) -> Result<Chosen<'a>> {
    let Some(best) = &first.selection.best else { return Ok(first) };
    let is_open = spec.auto_discretization && !is_driven_by_current(first.prepared.records);
    let other = match spec.model.discretization {
        Discretization::Zoh => Discretization::Foh,
        Discretization::Foh => Discretization::Zoh,
        _ => return Ok(first),
    };
    let records = first.prepared.records;
    let is_sloped = |record: &Record| !record.slope().is_empty();
    if !is_open || records.iter().any(is_sloped) || !records.iter().any(is_lively) {
        return Ok(first);
    }
    let spec = IdentifySpec { model: Model { discretization: other, ..spec.model }, ..spec.clone() };
    let prepared = Prepared::new(first.prepared.records, Cow::Owned(spec))?;
    if !may_be_better(&Models { prepared: &prepared, start: &first.start }, best) {
        return Ok(first);
    }
    let start = start(&prepared)?;
    let selection = select(&prepared, &start)?;
    let is_better = selection.best.as_ref().is_some_and(|other| gain(best, other) < -INDISTINGUISHABLE);
    Ok(if is_better { Chosen { prepared, start, selection } } else { first })
}

/// Returns true if a model fits better with the intersample behaviour of `there`, as it is or with the dead time added or
/// removed: a zero-order hold and a first-order hold differ by a delay of half a period.
fn may_be_better(there: &Models<'_>, best: &Fit) -> bool {
    let mut toggled = best.with.clone();
    match toggled.iter().position(|e| *e == Extension::DeadTime) {
        Some(index) => drop(toggled.remove(index)),
        None => toggled.push(Extension::DeadTime),
    }
    let is_better =
        |with: &Vec<Extension>| there.near(best, with).is_ok_and(|fit| gain(best, &fit) < -INDISTINGUISHABLE);
    [best.with.clone(), toggled].iter().any(is_better)
}

/// Largest ratio of the root mean square of the residuals of excluded samples to that of the fitted ones at which the model
/// still fits the excluded samples.
const RMS_RATIO_MAX: f64 = 2.0;

/// Returns true if a model that was fitted to some of the samples fits the excluded ones as well.
fn fits_all(chosen: &Chosen<'_>, records: &[Record]) -> bool {
    let Some(best) = &chosen.selection.best else { return false };
    let problem = chosen.prepared.fitted(&best.space);
    let fits = |(n, record): (usize, &Record)| {
        let (model, counting) = (problem.simulate(&best.refined.values, n, best.refined.state(n)), record.counting());
        let fitted = chosen.prepared.records[n].counting();
        record.measured().iter().zip(&model).enumerate().all(|(channel, (measured, model))| {
            let Some(measured) = measured else { return true };
            let of = |is_counted: bool| -> Vec<f64> {
                let counts = |list: &[[bool; 2]], n: usize| list.get(n).is_none_or(|counts| counts[channel]);
                let here = |n: &usize| counts(&counting, *n) && counts(&fitted, *n) == is_counted;
                (0..measured.len()).filter(here).map(|n| measured[n] - model[n]).collect()
            };
            let [counted, others] = [of(true), of(false)];
            others.is_empty() || rms(&others) <= RMS_RATIO_MAX * rms(&counted)
        })
    };
    records.iter().enumerate().all(fits)
}
