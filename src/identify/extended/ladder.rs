//! The ladder of models: from the linear motor up, each rung the extension that the recordings speak for most, until none
//! is worth its parameters.
//!
//! Extensions can need each other: a load and an offset of the voltage each alone may make nothing better. So the first
//! rung may be a pair, and where no extension more helps, one is exchanged for another. All are refined roughly, from where
//! the model is that they are made from; the best of them thoroughly and from several explanations.

use super::super::spec::IdentifySpec;
use super::super::verify::deviations;
use super::starts::{carried, warmed};
use super::worth::{Fit, gain, independent, is_worth};
use super::{Extension, best_start, explained, extended_space, led};
use crate::estimate::{Refined, fit_problem, refine_on};
use crate::evaluate::Problem;
use crate::motor::{Scope, Space};
use crate::record::Record;
use crate::{Error, ErrorKind, Result};
use rayon::prelude::*;
use std::sync::Arc;

/// A model that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Rung {
    /// Its extensions.
    pub with: Vec<Extension>,
    /// Its free parameters.
    pub free: usize,
    /// 100 (1 − ‖y − ŷ‖/‖y − mean y‖) of current and speed; `None` for a channel not measured.
    pub fit_percent: [Option<f64>; 2],
    /// Schwarz's criterion less that of the model that it was made from; below zero it is better. `None` for the linear
    /// motor.
    pub gain: Option<f64>,
    /// Whether it was taken.
    pub taken: bool,
}

/// The models that were tried, in their order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ladder {
    /// One by one.
    pub rungs: Vec<Rung>,
}

/// Extensions at most.
const HEIGHT: usize = 6;
/// Models of a rung that are refined thoroughly.
const FINALISTS: usize = 3;
/// Samples on which models are tried, if fewer recordings have as many: what is taken is estimated on all.
const SAMPLES: usize = 40_000;

/// The extensions that recordings speak for, with the ladder that led to them. `space` is that of the linear motor,
/// `motors` are near the right one.
pub(in super::super) fn climb(
    records: &[Record],
    spec: &IdentifySpec,
    space: &Space,
    motors: &[[f64; 5]],
) -> Result<(Vec<Extension>, Ladder)> {
    let some = representative(records, space);
    let scene = Scene { records: &some, spec, space, motors };
    let mut best = scene.first()?;
    let mut ladder = Ladder::default();
    ladder.rungs.push(Rung { taken: true, ..rung(scene.records, &best, None) });
    loop {
        let next = candidates(scene.records, &best);
        let more = more(&best, &next);
        let taken = match scene.step(&best, &more, &mut ladder)? {
            None => scene.step(&best, &exchanged(&best, &next), &mut ladder)?,
            taken => taken,
        };
        match taken {
            Some(fit) => best = scene.pruned(fit)?,
            None => return Ok((best.with, ladder)),
        }
    }
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

/// Models with one extension more; from the linear motor, two as well.
fn more(best: &Fit, next: &[Extension]) -> Vec<Vec<Extension>> {
    if best.with.len() >= HEIGHT {
        return Vec::new();
    }
    let mut sets: Vec<Vec<Extension>> = next.iter().map(|e| best.with.iter().copied().chain([*e]).collect()).collect();
    if best.with.is_empty() {
        let pairs = next.iter().enumerate().flat_map(|(n, one)| next[n + 1..].iter().map(|other| vec![*one, *other]));
        sets.extend(pairs);
    }
    sets
}

/// Models with one extension in another's place.
fn exchanged(best: &Fit, next: &[Extension]) -> Vec<Vec<Extension>> {
    let without = |out: &Extension| best.with.iter().copied().filter(move |e| e != out).collect::<Vec<_>>();
    let pairs = best.with.iter().flat_map(|out| next.iter().map(move |into| (out, into)));
    pairs.map(|(out, into)| without(out).into_iter().chain([*into]).collect()).collect()
}

/// What models are tried on.
struct Scene<'a> {
    records: &'a [Record],
    spec: &'a IdentifySpec,
    /// That of the linear motor.
    space: &'a Space,
    motors: &'a [[f64; 5]],
}

impl Scene<'_> {
    /// The linear motor.
    fn first(&self) -> Result<Fit> {
        let starts = |problem: &Arc<Problem>| explained(problem, self.motors);
        self.thorough(&[], starts)
    }

    /// The best of some models, if it is worth more than the one that they are made from. Those of one extension more
    /// are noted; of others those that were refined thoroughly.
    fn step(&self, best: &Fit, sets: &[Vec<Extension>], ladder: &mut Ladder) -> Result<Option<Fit>> {
        // One that cannot be fitted explains nothing.
        let fits = sets.par_iter().filter_map(|with| self.rough(best, with).ok());
        let mut tried: Vec<(f64, Fit)> = fits.map(|fit| (gain(best, &fit), fit)).collect();
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        let others = tried.split_off(tried.len().min(FINALISTS));
        let thorough: Vec<Fit> = tried.into_par_iter().map(|(_, fit)| self.finished(best, fit)).collect();
        let mut fits: Vec<(f64, Fit)> = thorough.into_iter().map(|fit| (gain(best, &fit), fit)).collect();
        fits.sort_by(|a, b| a.0.total_cmp(&b.0));
        let take = fits.first().is_some_and(|(_, fit)| is_worth(best, fit));
        let others = others.iter().filter(|(_, fit)| fit.with.len() == best.with.len() + 1);
        let rungs = fits.iter().chain(others).enumerate();
        ladder.rungs.extend(
            rungs.map(|(n, (gain, fit))| Rung { taken: take && n == 0, ..rung(self.records, fit, Some(*gain)) }),
        );
        Ok(fits.into_iter().next().filter(|_| take).map(|(_, fit)| fit))
    }

    /// A model from where another is: along what is new, then roughly from there and from other explanations of what is
    /// late.
    fn rough(&self, from: &Fit, with: &[Extension]) -> Result<Fit> {
        let known = (&from.space, from.refined.values.as_slice());
        let (problem, plain) = self.problems(with)?;
        let mut starts = vec![warmed(&problem, known)?];
        starts.extend(
            led(&problem, &starts[0])?.into_iter().filter(|start| *start != starts[0]).take(ANEW).collect::<Vec<_>>(),
        );
        let refined = best_start(&plain, &starts, &from.refined.sigmas).ok_or_else(nowhere)?;
        Ok(fit(with, &plain, refined))
    }

    /// A rough fit made thorough, from where it is and from explanations anew.
    fn finished(&self, from: &Fit, rough: Fit) -> Fit {
        let Fit { with, space, refined, .. } = &rough;
        let starts = |problem: &Arc<Problem>| {
            let motors: Vec<[f64; 5]> =
                [from.refined.parameters.to_array()].into_iter().chain(self.motors.iter().take(1).copied()).collect();
            let mut starts = vec![carried(problem, (space, &refined.values))];
            starts.extend(explained(problem, &motors)?.into_iter().take(ANEW));
            Ok(starts)
        };
        let thorough = self.thorough(with, starts).ok();
        match thorough {
            Some(fit) if gain(&rough, &fit) < 0.0 => fit,
            _ => rough,
        }
    }

    /// Without extensions that another has made idle.
    fn pruned(&self, fit: Fit) -> Result<Fit> {
        let mut best = fit;
        for extension in best.with.clone() {
            let with: Vec<Extension> = best.with.iter().copied().filter(|e| *e != extension).collect();
            if best.with.last() == Some(&extension) {
                continue;
            }
            let warm = |problem: &Arc<Problem>| Ok(vec![carried(problem, (&best.space, &best.refined.values))]);
            let less = self.thorough(&with, warm)?;
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
        let rough = best_start(&plain, &starts, &deviations(self.records));
        let values = rough.map(|refined| refined.values).or_else(|| starts.into_iter().next()).unwrap_or_default();
        Ok(fit(with, &plain, refine_on(&plain, &values, None)?))
    }

    /// The problem of a search and that of a fit.
    fn problems(&self, with: &[Extension]) -> Result<(Arc<Problem>, Problem)> {
        let Self { records, spec, space, motors } = *self;
        let motor = motors.first().copied().unwrap_or([1.0; 5]);
        let space = extended_space(records, spec, space, (with, &motor))?;
        let plain = fit_problem(records, &space, spec.model)?;
        Ok((Arc::new(Problem::new(records, spec.model, space, spec.criterion)?), plain))
    }
}

fn fit(with: &[Extension], plain: &Problem, refined: Refined) -> Fit {
    let independent = independent(plain, &refined);
    Fit { with: with.to_vec(), space: plain.space().clone(), refined, independent }
}

fn nowhere() -> Error {
    Error::new(ErrorKind::NotIdentified, "no start of this model can be refined", "Name other extensions.")
}

/// Explanations that are tried anew for an extension.
const ANEW: usize = 2;

/// Extensions that could be next: not what the model has, nor what the recordings cannot show.
fn candidates(records: &[Record], model: &Fit) -> Vec<Extension> {
    let any = |of: &dyn Fn(f64) -> bool| records.iter().any(|record| record.samples().voltage.iter().any(|v| of(*v)));
    let both_ways = any(&|v| v > 0.0) && any(&|v| v < 0.0);
    let measured = |channel: usize| records.iter().any(|record| record.measured()[channel].is_some());
    let can = |extension: &Extension| match extension {
        Extension::DirectionGain => both_ways,
        // Without a current the drop of the brushes is that of a deadband or of friction.
        Extension::BrushDrop => measured(0),
        _ => true,
    };
    let extent = model.space.extent();
    Extension::ALL.into_iter().filter(|e| !extent.has_any(e.parameters())).filter(can).collect()
}

fn rung(records: &[Record], fit: &Fit, gain: Option<f64>) -> Rung {
    Rung {
        with: fit.with.clone(),
        free: fit.space.free().len(),
        fit_percent: super::super::fit::fit_percent(records, &fit.refined),
        gain,
        taken: false,
    }
}
