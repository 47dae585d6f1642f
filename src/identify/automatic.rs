//! The choices of `auto` beside the extensions: which samples count, and the course of the voltage between samples.

use super::bic::{Fit, gain};
use super::checks;
use super::model_selection::{Selection, TOLD_APART, select};
use super::models::Models;
use super::prepare::Prepared;
use super::spec::IdentifySpec;
use super::start::{Start, asked_space, start};
use crate::Result;
use crate::evaluate::Model;
use crate::motor::{Discretization, Extension, With};
use crate::numeric::rms;
use crate::record::{Record, is_driven_by_current};
use std::borrow::Cow;

/// Recordings with the model that explains them.
pub(super) struct Chosen<'a> {
    pub prepared: Prepared<'a>,
    pub start: Start,
    pub selection: Selection,
}

/// Returns copies of recordings in which undersampled stretches do not count, under `auto` and where there are such.
pub(super) fn without_undersampled(records: &[Record], spec: &IdentifySpec) -> Option<Vec<Record>> {
    if spec.with != With::Auto || is_driven_by_current(records) {
        return None;
    }
    let masked: Vec<Option<Record>> = records.iter().map(Record::without_undersampled).collect();
    let is_any = masked.iter().any(Option::is_some);
    is_any.then(|| masked.into_iter().zip(records).map(|(own, record)| own.unwrap_or_else(|| record.clone())).collect())
}

/// Stages 1 to 3: prepares recordings, finds where a fit starts, and selects the model. `masked` are the same recordings without
/// their undersampled stretches; the model that explains what is left must miss these, or all samples count.
///
/// # Errors
/// As the stages.
pub(super) fn choose<'a>(
    records: &'a [Record],
    masked: Option<&'a [Record]>,
    spec: &'a IdentifySpec,
) -> Result<Chosen<'a>> {
    if let Some(masked) = masked {
        let chosen = between_samples(on(masked, spec)?, spec)?;
        if !explains_all(&chosen, records) {
            return Ok(chosen);
        }
    }
    between_samples(on(records, spec)?, spec)
}

fn on<'a>(records: &'a [Record], spec: &'a IdentifySpec) -> Result<Chosen<'a>> {
    let prepared = Prepared::new(records, Cow::Borrowed(spec))?;
    checks::before(records, &prepared.spec, &prepared.searched(asked_space(records, &prepared.spec)?))?;
    let start = start(&prepared)?;
    let selection = select(&prepared, &start)?;
    Ok(Chosen { prepared, start, selection })
}

/// Selects the model anew with the other course of the voltage between samples, where that may fit better, and returns the
/// better one. Of models that are alike the one with a dead time of its own remains: a line between samples is a delay of half a
/// period, taken for certain. The spec is that which was asked for: the one of a normalized model holds parameters that nobody held.
fn between_samples<'a>(first: Chosen<'a>, spec: &IdentifySpec) -> Result<Chosen<'a>> {
    let Some(best) = &first.selection.best else { return Ok(first) };
    let is_open = spec.auto_discretization && !is_driven_by_current(first.prepared.records);
    let other = match spec.model.discretization {
        Discretization::Zoh => Discretization::Foh,
        Discretization::Foh => Discretization::Zoh,
        _ => return Ok(first),
    };
    if !is_open || first.prepared.records.iter().any(|record| !record.slope().is_empty()) {
        return Ok(first);
    }
    let spec = IdentifySpec { model: Model { discretization: other, ..spec.model }, ..spec.clone() };
    let prepared = Prepared::new(first.prepared.records, Cow::Owned(spec))?;
    if !may_be_better(&Models { prepared: &prepared, start: &first.start }, best) {
        return Ok(first);
    }
    let start = start(&prepared)?;
    let selection = select(&prepared, &start)?;
    let is_better = selection.best.as_ref().is_some_and(|other| gain(best, other) < -TOLD_APART);
    Ok(if is_better { Chosen { prepared, start, selection } } else { first })
}

/// Returns whether a model fits better on other terms, also with or without a dead time: between a voltage that is held and one
/// that is a line lies half a period.
fn may_be_better(there: &Models<'_>, best: &Fit) -> bool {
    let mut toggled = best.with.clone();
    match toggled.iter().position(|e| *e == Extension::DeadTime) {
        Some(place) => drop(toggled.remove(place)),
        None => toggled.push(Extension::DeadTime),
    }
    let is_better = |with: &Vec<Extension>| there.near(best, with).is_ok_and(|fit| gain(best, &fit) < -TOLD_APART);
    [best.with.clone(), toggled].iter().any(is_better)
}

/// Residuals of stretches up to this many times as large as those of other samples are explained.
const EXPLAINED: f64 = 2.0;

/// Returns whether a model that was fitted to some of the samples explains the others as well.
fn explains_all(chosen: &Chosen<'_>, records: &[Record]) -> bool {
    let Some(best) = &chosen.selection.best else { return false };
    let problem = chosen.prepared.fitted(&best.space);
    let explains = |(n, record): (usize, &Record)| {
        let (model, counting) = (problem.simulate(&best.refined.values, n, best.refined.initial[n]), record.counting());
        let fitted = chosen.prepared.records[n].counting();
        record.measured().iter().zip(&model).enumerate().all(|(channel, (measured, model))| {
            let Some(measured) = measured else { return true };
            let of = |is_counted: bool| -> Vec<f64> {
                let counts = |list: &[[bool; 2]], n: usize| list.get(n).is_none_or(|counts| counts[channel]);
                let here = |n: &usize| counts(&counting, *n) && counts(&fitted, *n) == is_counted;
                (0..measured.len()).filter(here).map(|n| measured[n] - model[n]).collect()
            };
            let [counted, others] = [of(true), of(false)];
            others.is_empty() || rms(&others) <= EXPLAINED * rms(&counted)
        })
    };
    records.iter().enumerate().all(explains)
}
