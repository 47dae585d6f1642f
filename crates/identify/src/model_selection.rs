//! Forward selection of the model by BIC: starting from the linear motor, each step adds the extension with the best fit among
//! those that BIC prefers, and removes others that it makes superfluous, until none is preferred (`bic.rs`). Then each
//! extension is exchanged for those with similar effects while this decreases the BIC.

use super::bic::{Fit, gain, is_preferred};
use super::extension_bounds::extended_space;
use super::models::{Alternative, Models, SelectionStep, alternative, shared, step};
use super::normalized::is_measured;
use super::prepare::Prepared;
use super::spec::IdentifySpec;
use super::start::{Start, start};
use motorfit_core::numeric;
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_estimate::{delay_starts, transferred, warm_start};
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

/// Largest number of extensions of a model.
const EXTENSIONS_MAX: usize = 6;
/// Number of models of a step that are refined until convergence.
const FINALISTS: usize = 3;
/// Number of samples on which the models of a step are ranked if there are many recordings; the best are compared on all.
const SAMPLES: usize = 60_000;
/// Difference of BIC below which models are indistinguishable: odds of e³ = 20 to 1.
pub(super) const INDISTINGUISHABLE: f64 = 6.0;

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
    let search = ForwardSelection { all, few: few.as_ref().map(|prepared| Models { prepared, start }) };
    let mut steps = Vec::new();
    let best = search.run(&mut steps)?;
    let (best, alternatives) = search.exchanged(best, &mut steps);
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

/// A forward selection on all recordings, whose candidates may be ranked on a subset.
struct ForwardSelection<'a> {
    all: Models<'a>,
    /// Subset of the recordings on which candidates are ranked; `None` if they are ranked on all.
    few: Option<Models<'a>>,
}

impl ForwardSelection<'_> {
    /// Adds extensions to the linear motor, and removes superfluous ones, until none is preferred.
    fn run(&self, steps: &mut Vec<SelectionStep>) -> Result<Fit> {
        let Models { prepared, start } = self.all;
        let by = (&start.space, prepared.deviations());
        let mut best = self.all.thorough(by, &[], |problem| delay_starts(problem, &start.motors))?;
        best = self.all.lower(&best)?.unwrap_or(best);
        let records = self.all.prepared.records;
        steps.push(step(records, &best, None, true));
        while best.with.len() < EXTENSIONS_MAX {
            let mut tried = self.ranked(&best)?;
            let mut others = tried.split_off(tried.len().min(FINALISTS));
            tried.extend(likeliest(&mut others));
            let mut fits: Vec<Fit> = tried.into_par_iter().map(|fit| self.finished(&best, fit)).collect();
            fits.sort_by(|a, b| ranking_cost(&best, a).total_cmp(&ranking_cost(&best, b)));
            let taken = fits.iter().position(|fit| is_preferred(&best, fit));
            for (n, fit) in fits.iter().enumerate() {
                steps.push(step(records, fit, Some(gain(&best, fit)), taken == Some(n)));
            }
            if self.few.is_none() {
                steps.extend(others.iter().map(|fit| step(records, fit, Some(gain(&best, fit)), false)));
            }
            match taken {
                Some(n) => best = self.pruned(fits.swap_remove(n))?,
                // A lower optimum of the same model may allow further steps.
                None => match self.all.lower(&best)?.filter(|lower| gain(&best, lower) < -EXCHANGE) {
                    Some(lower) => best = lower,
                    None => break,
                },
            }
        }
        Ok(best)
    }

    /// Returns the models with one more extension after a few iterations of the refinement, the best first.
    fn ranked(&self, best: &Fit) -> Result<Vec<Fit>> {
        let candidates = candidates(self.all.prepared.records, &best.space);
        let larger = |extension: &Extension| best.with.iter().copied().chain([*extension]).collect::<Vec<_>>();
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
        let rough = candidates.par_iter().filter_map(|extension| models.rough(&from, &larger(extension)).ok());
        let mut fits: Vec<Fit> = rough.collect();
        fits.sort_by(|a, b| ranking_cost(&from, a).total_cmp(&ranking_cost(&from, b)));
        if self.few.is_none() {
            return Ok(fits);
        }
        let on_all = |fit: Fit| {
            self.all.thorough((&fit.space, &best.refined.weights), &fit.with, |problem| {
                let own = shared(problem, &fit);
                Ok(vec![warm_start(problem, (&best.space, &best.refined.values))?, own])
            })
        };
        Ok(fits.into_par_iter().take(FINALISTS).filter_map(|fit| on_all(fit).ok()).collect())
    }

    /// Refines a rough fit until convergence if it may become as good as the best.
    fn finished(&self, best: &Fit, rough: Fit) -> Fit {
        if gain(best, &rough) > FAR_WORSE { rough } else { self.all.finished(rough) }
    }

    /// Removes extensions that the last one has made superfluous.
    fn pruned(&self, fit: Fit) -> Result<Fit> {
        let mut best = fit;
        for extension in best.with.clone() {
            if best.with.last() == Some(&extension) {
                continue;
            }
            let with: Vec<Extension> = best.with.iter().copied().filter(|e| *e != extension).collect();
            let from = (&best.space, &best.refined.values[..]);
            let less = self.all.thorough((&best.space, &best.refined.weights), &with, |problem| {
                Ok(vec![transferred(problem, from)])
            })?;
            if !is_preferred(&less, &best) {
                best = less;
            }
        }
        Ok(best)
    }

    /// Exchanges each extension for those with similar effects while this decreases the BIC. Returns the best model and the
    /// indistinguishable alternatives.
    fn exchanged(&self, best: Fit, steps: &mut Vec<SelectionStep>) -> (Fit, Vec<Alternative>) {
        let records = self.all.prepared.records;
        let mut best = best;
        for _ in 0..EXTENSIONS_MAX {
            let possible = candidates(records, &best.space);
            let pairs = best.with.iter().flat_map(|old| possible.iter().map(move |new| (*old, *new)));
            let models: Vec<Vec<Extension>> = pairs
                .filter(|(old, new)| old.resembles(*new))
                .map(|(old, new)| best.with.iter().map(|e| if *e == old { new } else { *e }).collect())
                .collect();
            let tried = models.par_iter().filter_map(|with| self.all.rough(&best, with).ok());
            let tried: Vec<Fit> = tried.map(|fit| self.finished(&best, fit)).collect();
            let gains: Vec<f64> = tried.iter().map(|fit| gain(&best, fit)).collect();
            let lowest = (0..tried.len()).min_by(|a, b| gains[*a].total_cmp(&gains[*b]));
            let taken = lowest.filter(|n| gains[*n] < -EXCHANGE);
            for (n, fit) in tried.iter().enumerate() {
                steps.push(step(records, fit, Some(gains[n]), taken == Some(n)));
            }
            let Some(n) = taken else {
                let alike = tried.iter().zip(&gains).filter(|(_, gain)| **gain < INDISTINGUISHABLE);
                let alternatives = alike.map(|(fit, gain)| alternative(records, fit, *gain)).collect();
                return (best, alternatives);
            };
            best = tried.into_iter().nth(n).unwrap_or(best);
        }
        (best, Vec::new())
    }
}

/// Removes and returns the model with the lowest deviance of the innovations.
fn likeliest(fits: &mut Vec<Fit>) -> Option<Fit> {
    let lowest = (0..fits.len()).min_by(|a, b| fits[*a].deviance.total_cmp(&fits[*b].deviance))?;
    Some(fits.remove(lowest))
}

/// Difference of BIC above which a rough fit is not refined further; convergence would change it by some hundredths only.
const FAR_WORSE: f64 = 3.0 * INDISTINGUISHABLE;
/// Decrease of BIC, above rounding, from which a model is exchanged for another of the same size.
const EXCHANGE: f64 = 0.1;

/// Returns the cost that ranks models with the same predecessor: the sum of squares under the weights of the predecessor, times
/// the penalty of BIC for the additional parameters.
fn ranking_cost(from: &Fit, to: &Fit) -> f64 {
    let samples = (from.effective * from.count).max(std::f64::consts::E);
    let more = numeric::count(to.space.free().len()) - numeric::count(from.space.free().len());
    to.refined.weighted(&from.refined.weights) * (1.0 + more * samples.ln() / samples)
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
