//! Forward selection of the model: from the linear motor up, each step adds the extension that lowers Schwarz's criterion
//! most, until none lowers it by enough.

use super::bic::{Fit, gain, independent, is_worth};
use super::extension_bounds::extended_space;
use super::normalized::is_measured;
use super::prepare::Prepared;
use super::spec::IdentifySpec;
use super::start::{Start, start};
use crate::analysis::fit_percent;
use crate::channels;
use crate::estimate::{Refined, best_start, carried, explained, refine_on, warmed};
use crate::evaluate::Problem;
use crate::motor::{Extension, Needs, Parameter, Scope, Space, With};
use crate::record::{Record, is_driven_by_current};
use crate::setting::text;
use crate::{Error, ErrorKind, Result};
use rayon::prelude::*;
use std::sync::Arc;

/// A model that was tried.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct SelectionStep {
    /// Its extensions.
    pub with: Vec<Extension>,
    /// Its free parameters.
    pub free: usize,
    /// 100 (1 − ‖y − ŷ‖/‖y − mean y‖) of current and speed; `None` for a channel not measured.
    #[serde(serialize_with = "channels::by_name")]
    pub fit_percent: [Option<f64>; 2],
    /// Schwarz's criterion less that of the model that it was made from; below zero it is better. `None` for the linear
    /// motor.
    #[serde(rename = "criterion_gain")]
    pub gain: Option<f64>,
    /// Whether it was taken.
    pub taken: bool,
}

/// Extensions at most.
const HEIGHT: usize = 6;
/// Models of a step that are refined thoroughly.
const FINALISTS: usize = 3;
/// Samples on which models are tried, if fewer recordings have as many: what is taken is estimated on all.
const SAMPLES: usize = 20_000;

/// Stage 3, select: the extensions that the spec names or, where it leaves them open, those that forward selection takes.
/// Returns the space of the model that is fitted, and the models that were tried where it was selected.
///
/// # Errors
/// `Usage` for parameters of single recordings that the model lacks, and as a fit.
pub(super) fn select(prepared: &Prepared<'_>, start: &Start) -> Result<(Space, Option<Vec<SelectionStep>>)> {
    if prepared.is_linear() {
        return Ok((start.space.clone(), None));
    }
    let (with, selection) = match prepared.named() {
        Some(list) => (list.to_vec(), None),
        None => {
            let some = representative(prepared.records, &start.space);
            let mut steps = Vec::new();
            let best = Selection { prepared: &prepared.of(&some)?, start }.up(&mut steps)?;
            (best.with, Some(steps))
        }
    };
    let space = extended_space(prepared.records, &prepared.spec, &start.space, (&with, &start.motors[0]))?;
    if prepared.spec.with != With::Auto {
        check_per_recording(&prepared.spec, &space)?;
    }
    Ok((space, selection))
}

/// Of many recordings some from all over them; recordings with parameters of their own are needed as they are.
fn representative(records: &[Record], space: &Space) -> Vec<Record> {
    let shared = |scope: &Scope| *scope == Scope::Shared;
    let is_shared =
        space.free().iter().all(|axis| shared(&axis.scope)) && space.fixed().iter().all(|(_, s, _)| shared(s));
    let samples: usize = records.iter().map(Record::len).sum();
    let every = if is_shared { samples.div_ceil(SAMPLES).clamp(1, records.len().max(1)) } else { 1 };
    records.iter().step_by(every).cloned().collect()
}

/// What models are tried on.
struct Selection<'a> {
    prepared: &'a Prepared<'a>,
    start: &'a Start,
}

impl Selection<'_> {
    /// From the linear motor up.
    fn up(&self, steps: &mut Vec<SelectionStep>) -> Result<Fit> {
        let mut best = self.thorough(&[], |problem| explained(problem, &self.start.motors))?;
        let records = self.prepared.records;
        steps.push(step(records, &best, None, true));
        while best.with.len() < HEIGHT {
            let next = candidates(records, &best);
            // One that cannot be fitted explains nothing.
            let mut tried = ranked(&best, next.par_iter().filter_map(|extension| self.rough(&best, *extension).ok()));
            let others = tried.split_off(tried.len().min(FINALISTS));
            let fits = ranked(&best, tried.into_par_iter().map(|(_, fit)| self.finished(fit)));
            let take = fits.first().is_some_and(|(_, fit)| is_worth(&best, fit));
            for (n, (gain, fit)) in fits.iter().chain(&others).enumerate() {
                steps.push(step(records, fit, Some(*gain), take && n == 0));
            }
            match fits.into_iter().next().filter(|_| take) {
                Some((_, fit)) => best = self.pruned(fit)?,
                None => break,
            }
        }
        Ok(best)
    }

    /// A model with one extension more, roughly, from where it is without: that alone, and as the first explanation of
    /// all that is late.
    fn rough(&self, from: &Fit, extension: Extension) -> Result<Fit> {
        let with: Vec<Extension> = from.with.iter().copied().chain([extension]).collect();
        let (problem, plain) = self.problems(&with)?;
        let mut starts = vec![warmed(&problem, (&from.space, &from.refined.values))?];
        starts.extend(explained(&problem, &[from.refined.parameters.to_array()])?.into_iter().take(ANEW));
        let refined = best_start(&plain, &starts, self.prepared.deviations()).ok_or_else(nowhere)?;
        Ok(fit(&with, &plain, refined))
    }

    /// A rough fit made thorough.
    fn finished(&self, rough: Fit) -> Fit {
        let refined = self.problems(&rough.with).and_then(|(_, plain)| {
            let refined = refine_on(&plain, &rough.refined.values, None)?;
            Ok(fit(&rough.with, &plain, refined))
        });
        refined.unwrap_or(rough)
    }

    /// A model with one extension less, from where it is with it.
    fn without(&self, from: &Fit, extension: Extension) -> Result<Fit> {
        let with: Vec<Extension> = from.with.iter().copied().filter(|e| *e != extension).collect();
        self.thorough(&with, |problem| Ok(vec![carried(problem, (&from.space, &from.refined.values))]))
    }

    /// Without extensions that another has made idle.
    fn pruned(&self, fit: Fit) -> Result<Fit> {
        let mut best = fit;
        for extension in best.with.clone() {
            if best.with.last() == Some(&extension) {
                continue;
            }
            let less = self.without(&best, extension)?;
            if !is_worth(&less, &best) {
                best = less;
            }
        }
        Ok(best)
    }

    /// A model refined thoroughly from the best of some starts.
    fn thorough(&self, with: &[Extension], starts: impl Fn(&Arc<Problem>) -> Result<Vec<Vec<f64>>>) -> Result<Fit> {
        let (problem, plain) = self.problems(with)?;
        let starts = starts(&problem)?;
        let rough = best_start(&plain, &starts, self.prepared.deviations());
        let values = rough.map(|refined| refined.values).or_else(|| starts.into_iter().next()).unwrap_or_default();
        Ok(fit(with, &plain, refine_on(&plain, &values, None)?))
    }

    /// The problem of a search and that of a fit.
    fn problems(&self, with: &[Extension]) -> Result<(Arc<Problem>, Problem)> {
        let Self { prepared, start } = *self;
        let motor = start.motors.first().copied().unwrap_or([1.0; 5]);
        let space = extended_space(prepared.records, &prepared.spec, &start.space, (with, &motor))?;
        let plain = prepared.fitted(&space);
        Ok((prepared.searched(space), plain))
    }
}

fn fit(with: &[Extension], plain: &Problem, refined: Refined) -> Fit {
    let independent = independent(plain, &refined);
    Fit { with: with.to_vec(), space: plain.space().clone(), refined, independent }
}

/// Fits with their gains on another, the lowest first.
fn ranked(best: &Fit, fits: impl ParallelIterator<Item = Fit>) -> Vec<(f64, Fit)> {
    let mut fits: Vec<(f64, Fit)> = fits.map(|fit| (gain(best, &fit), fit)).collect();
    fits.sort_by(|a, b| a.0.total_cmp(&b.0));
    fits
}

fn nowhere() -> Error {
    Error::new(ErrorKind::NotIdentified, "no start of this model can be refined", "Name other extensions.")
}

/// Explanations that are tried anew for an extension.
const ANEW: usize = 2;

/// Extensions that could be next: not what the model has, nor what the recordings cannot show.
fn candidates(records: &[Record], model: &Fit) -> Vec<Extension> {
    let any = |of: &dyn Fn(f64) -> bool| records.iter().any(|record| record.input().iter().any(|v| of(*v)));
    let both_ways = any(&|v| v > 0.0) && any(&|v| v < 0.0);
    let by_current = is_driven_by_current(records);
    let can = |extension: &Extension| match extension.needs() {
        _ if by_current && !extension.acts_on_current() => false,
        Needs::BothSigns => both_ways,
        Needs::Current => is_measured(records, 0),
        Needs::Nothing => true,
    };
    let features = model.space.features();
    Extension::ALL.into_iter().filter(|e| !features.has_any(e.parameters())).filter(can).collect()
}

fn step(records: &[Record], fit: &Fit, gain: Option<f64>, taken: bool) -> SelectionStep {
    let fit_percent = fit_percent(records, &fit.refined);
    SelectionStep { with: fit.with.clone(), free: fit.space.free().len(), fit_percent, gain, taken }
}

/// What each recording is to have for itself must be free in the model.
pub(super) fn check_per_recording(spec: &IdentifySpec, space: &Space) -> Result<()> {
    let free = |p: &Parameter| space.free().iter().any(|axis| axis.parameter == *p);
    let Some(parameter) = spec.per_recording.iter().find(|p| !free(p)) else { return Ok(()) };
    let symbol = parameter.symbol();
    let extension = Extension::of(*parameter);
    let is_held = space.fixed().iter().any(|(of, ..)| of == parameter);
    let (what, remedy) = match extension {
        _ if is_held => ("is held", text!("Leave {symbol} out of " [PerRecording] ", or do not hold it.")),
        Some(extension) => {
            ("is not in the model", text!("Add " [With = "{}", extension.name()] ", or leave {symbol} out."))
        }
        None => ("is not in the model", text!("Leave {symbol} out of " [PerRecording] ".")),
    };
    Err(Error::usage(text!([PerRecording] ": {symbol} {what}"), remedy))
}

/// Returns the space of a search with the extensions that a spec names.
///
/// # Errors
/// `Usage` where the spec leaves them open: nothing is fitted here.
pub(super) fn named_space(records: &[Record], spec: &IdentifySpec) -> Result<Space> {
    let prepared = Prepared::as_given(records, spec)?;
    let Some(list) = prepared.named() else {
        let message = text!([With = "auto"] " chooses by fits, and there are none here");
        let hint = text!("Name the extensions, as in " [With = "coulomb,dead-time"] ".");
        return Err(Error::usage(message, hint));
    };
    let start = start(&prepared)?;
    let space = extended_space(records, spec, &start.space, (list, &start.motors[0]))?;
    check_per_recording(spec, &space)?;
    Ok(space)
}
