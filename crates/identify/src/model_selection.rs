//! The model of a DC motor: the extensions that a spec names, or those of the forward selection among all (`forward_selection.rs`).

use super::extension_bounds::extended_space;
use super::forward_selection::{Alternative, FINALISTS, Family, Selected, SelectionStep, ranking_cost, select_forward};
use super::models::{Fit, Models, shared};
use super::normalized::is_measured;
use super::prepare::Prepared;
use super::spec::IdentifySpec;
use super::start::{Start, start};
use crate::analysis::fit_percent;
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_estimate::{Refined, delay_starts, transferred, warm_start};
use motorfit_motor::{Extension, Needs, Parameter, Scope, Space};
use motorfit_record::{Record, is_driven_by_current};
use rayon::prelude::*;

/// The model of a fit.
pub(super) struct Selection {
    pub space: Space,
    /// Models that were fitted, in their order; `None` if the spec names the extensions.
    pub steps: Option<Vec<SelectionStep>>,
    /// Models that fit the recordings equally well.
    pub alternatives: Vec<Alternative>,
    /// Fit of the selected model; `None` if the spec names the extensions.
    pub best: Option<Fit>,
}

/// Number of samples on which the models of a step are ranked if there are many recordings; the best are compared on all.
const SAMPLES: usize = 60_000;

/// Stage 3, select: returns the model with the extensions that the spec names, or with those of the forward selection.
///
/// # Errors
/// Returns `Usage` if a parameter that is to have one value per recording is not free in the model; propagates the errors of
/// the fits.
pub(super) fn select(prepared: &Prepared<'_>, start: &Start) -> Result<Selection> {
    let named = |space| Selection { space, steps: None, alternatives: Vec::new(), best: None };
    if prepared.is_linear() {
        return Ok(named(start.space.clone()));
    }
    let Some(list) = prepared.named() else { return selected(prepared, start) };
    let space = extended_space(prepared.records, &prepared.spec, &start.space, (list, &start.motors[0]))?;
    check_per_recording(&prepared.spec, &space)?;
    Ok(named(space))
}

/// Selects the extensions by forward selection and exchange.
fn selected(prepared: &Prepared<'_>, start: &Start) -> Result<Selection> {
    let some = representative(prepared.records, &start.space);
    let few = if some.is_empty() { None } else { Some(prepared.of(&some)?) };
    let all = Models { prepared, start };
    let family = Extended { all, few: few.as_ref().map(|prepared| Models { prepared, start }) };
    let Selected { best, steps, alternatives } = select_forward(&family)?;
    Ok(Selection { space: best.space.clone(), steps: Some(steps), alternatives, best: Some(best) })
}

/// Returns every Nth recording, with about [`SAMPLES`] samples together; empty if all recordings have no more than that, or if
/// a parameter has one value per recording.
fn representative(records: &[Record], space: &Space) -> Vec<Record> {
    let shared = |scope: &Scope| *scope == Scope::Shared;
    let is_shared =
        space.free().iter().all(|axis| shared(&axis.scope)) && space.fixed().iter().all(|(_, s, _)| shared(s));
    let samples: usize = records.iter().map(Record::len).sum();
    let every = samples.div_ceil(SAMPLES).min(records.len());
    if !is_shared || every < 2 {
        return Vec::new();
    }
    records.iter().step_by(every).cloned().collect()
}

/// The DC motor with its extensions as optional terms.
struct Extended<'a> {
    all: Models<'a>,
    /// Subset of the recordings on which candidates are ranked; `None` if they are ranked on all.
    few: Option<Models<'a>>,
}

impl Family for Extended<'_> {
    type Term = Extension;
    type Space = Space;

    fn smallest(&self) -> Result<Fit> {
        let Models { prepared, start } = self.all;
        let by = (&start.space, prepared.deviations());
        self.all.thorough(by, &[], |problem| delay_starts(problem, &start.motors))
    }

    fn candidates(&self, of: &Fit, _: usize) -> Vec<Extension> {
        candidates(self.all.prepared.records, &of.space)
    }

    fn resembles(&self, a: &Extension, b: &Extension) -> bool {
        a.resembles(*b)
    }

    fn rough(&self, from: &Fit, with: &[Extension]) -> Result<Fit> {
        self.all.rough(from, with)
    }

    fn finished(&self, rough: Fit) -> Fit {
        self.all.finished(rough)
    }

    fn reduced(&self, of: &Fit, with: &[Extension]) -> Result<Fit> {
        let from = (&of.space, &of.refined.values[..]);
        let by = (&of.space, &of.refined.weights[..]);
        self.all.thorough(by, with, |problem| Ok(vec![transferred(problem, from)]))
    }

    fn lower(&self, own: &Fit) -> Result<Option<Fit>> {
        self.all.lower(own)
    }

    fn ranked(&self, best: &Fit, larger: &[Vec<Extension>]) -> Result<(Vec<Fit>, bool)> {
        let (models, from) = match &self.few {
            Some(few) => (
                few,
                few.thorough((&best.space, few.prepared.deviations()), &best.with, |problem| {
                    Ok(vec![shared(problem, best)])
                })?,
            ),
            None => (&self.all, best.clone()),
        };
        // Models whose fit fails are left out.
        let mut fits: Vec<Fit> = larger.par_iter().filter_map(|with| models.rough(&from, with).ok()).collect();
        fits.sort_by(|a, b| ranking_cost(&from, a).total_cmp(&ranking_cost(&from, b)));
        if self.few.is_none() {
            return Ok((fits, true));
        }
        let on_all = |fit: Fit| {
            self.all.thorough((&fit.space, &best.refined.weights), &fit.with, |problem| {
                let own = shared(problem, &fit);
                Ok(vec![warm_start(problem, (&best.space, &best.refined.values))?, own])
            })
        };
        Ok((fits.into_par_iter().take(FINALISTS).filter_map(|fit| on_all(fit).ok()).collect(), false))
    }

    fn named(&self, term: &Extension) -> String {
        term.name().to_owned()
    }

    fn fit_percent(&self, refined: &Refined) -> Vec<Option<f64>> {
        fit_percent(self.all.prepared.records, refined).to_vec()
    }

    fn parameters(&self, fit: &Fit) -> Vec<(String, f64)> {
        let values = fit.space.free().iter().zip(&fit.refined.values);
        values.map(|(axis, value)| (axis.scope.name(axis.parameter), *value)).collect()
    }
}

/// Returns the extensions that a model lacks and that the recordings can show.
pub(super) fn candidates(records: &[Record], model: &Space) -> Vec<Extension> {
    let any = |of: &dyn Fn(f64) -> bool| records.iter().any(|record| record.input().iter().any(|v| of(*v)));
    let both_ways = any(&|v| v > 0.0) && any(&|v| v < 0.0);
    let by_current = is_driven_by_current(records);
    let can = |extension: &Extension| match extension.needs() {
        _ if by_current && !extension.acts_on_current() => false,
        Needs::BothSigns => both_ways,
        Needs::Current => is_measured(records, 0),
        Needs::Nothing => true,
    };
    let features = model.features();
    Extension::ALL.into_iter().filter(|e| !features.has_any(e.parameters())).filter(can).collect()
}

/// Checks that all parameters with one value per recording are free in the model.
pub(super) fn check_per_recording(spec: &IdentifySpec, space: &Space) -> Result<()> {
    let free = |p: &Parameter| space.free().iter().any(|axis| axis.parameter == *p);
    let Some(parameter) = spec.per_recording.iter().find(|p| !free(p)) else { return Ok(()) };
    let symbol = parameter.symbol();
    let extension = Extension::of(*parameter);
    let is_fixed = space.fixed().iter().any(|(of, ..)| of == parameter);
    let (what, remedy) = match extension {
        _ if is_fixed => ("is fixed", text!("Leave {symbol} out of " [PerRecording] ", or do not fix it.")),
        Some(extension) => {
            ("is not in the model", text!("Add " [With = "{}", extension.name()] ", or leave {symbol} out."))
        }
        None => ("is not in the model", text!("Leave {symbol} out of " [PerRecording] ".")),
    };
    Err(Error::usage(text!([PerRecording] ": {symbol} {what}"), remedy))
}

/// Returns the search space with the extensions that a spec names.
///
/// # Errors
/// Returns `Usage` if the extensions are to be selected, which needs fits.
pub(super) fn named_space(records: &[Record], spec: &IdentifySpec) -> Result<Space> {
    let prepared = Prepared::as_given(records, spec)?;
    let Some(list) = prepared.named() else {
        let message = text!([With = "auto"] " selects extensions by fits, and nothing is fitted here");
        let hint = text!("Name the extensions, as in " [With = "coulomb,dead-time"] ".");
        return Err(Error::usage(message, hint));
    };
    let start = start(&prepared)?;
    let space = extended_space(records, spec, &start.space, (list, &start.motors[0]))?;
    check_per_recording(spec, &space)?;
    Ok(space)
}
