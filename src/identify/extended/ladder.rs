//! The ladder of models: from the linear motor up, each rung the extension that the recordings speak for most, until none
//! is worth its parameters.
//!
//! Worth is judged by Schwarz's criterion (BIC, 1978) with as many samples as the residuals have independent ones:
//! `N (1 − ρ)/(1 + ρ)` for a correlation ρ from sample to sample (G. V. Bayley, J. M. Hammersley 1946). Residuals that a
//! wrong model leaves are correlated, and counted as they are they would speak for any extension at all.

use super::super::mechanical::{allows, is_driven_by_current};
use super::super::spec::IdentifySpec;
use super::super::verify::deviations;
use super::starts::{carried, warmed};
use super::{Extension, best_start, explained, extended_space};
use crate::Result;
use crate::estimate::{Refined, fit_problem, refine_on};
use crate::evaluate::Problem;
use crate::motor::Space;
use crate::record::Record;
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

/// A criterion must be lower by this much: odds of e³ = 20 to 1.
const GAIN: f64 = 6.0;
/// And the residuals of some channel by this part: below it nobody would notice.
const SMALLEST: f64 = 0.01;
/// Extensions at most.
const HEIGHT: usize = 6;

/// A fitted model.
struct Fit {
    with: Vec<Extension>,
    space: Space,
    refined: Refined,
    /// Independent samples of each recording and channel.
    independent: Vec<[f64; 2]>,
}

/// The extensions that recordings speak for, with the ladder that led to them. `space` is that of the linear motor,
/// `motors` are near the right one.
pub(in super::super) fn climb(
    records: &[Record],
    spec: &IdentifySpec,
    space: &Space,
    motors: &[[f64; 5]],
) -> Result<(Vec<Extension>, Ladder)> {
    let mut ladder = Ladder::default();
    let scene = Scene { records, spec, space, motors };
    let mut best = scene.first()?;
    ladder.rungs.push(rung(records, &best, None, true));
    while best.with.len() < HEIGHT {
        let next = candidates(records, &best);
        // One that cannot be fitted explains nothing.
        let fits = next.par_iter().filter_map(|extension| scene.with(&best, *extension).ok());
        let mut tried: Vec<(f64, Fit)> = fits.map(|fit| (gain(&best, &fit), fit)).collect();
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        let take = tried.first().is_some_and(|(gain, fit)| *gain < -GAIN && is_smaller(&best, fit));
        for (n, (gain, fit)) in tried.iter().enumerate() {
            ladder.rungs.push(rung(records, fit, Some(*gain), take && n == 0));
        }
        match tried.into_iter().next().filter(|_| take) {
            Some((_, fit)) => best = scene.pruned(fit)?,
            None => break,
        }
    }
    Ok((best.with, ladder))
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
        self.fitted(&[], starts)
    }

    /// A model with one extension more, from where it is without: that alone, and as the first explanation of all that is
    /// late.
    fn with(&self, from: &Fit, extension: Extension) -> Result<Fit> {
        let with: Vec<Extension> = from.with.iter().copied().chain([extension]).collect();
        let starts = |problem: &Arc<Problem>| {
            let motor = from.refined.parameters.to_array();
            let warm = warmed(problem, (&from.space, &from.refined.values))?;
            let anew = explained(problem, &[motor])?;
            Ok(std::iter::once(warm).chain(anew.into_iter().take(ANEW)).collect())
        };
        self.fitted(&with, starts)
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
            let less = self.fitted(&with, warm)?;
            if gain(&less, &best) > -GAIN || !is_smaller(&less, &best) {
                best = less;
            }
        }
        Ok(best)
    }

    fn fitted(&self, with: &[Extension], starts: impl Fn(&Arc<Problem>) -> Result<Vec<Vec<f64>>>) -> Result<Fit> {
        let Self { records, spec, space, motors } = *self;
        let motor = motors.first().copied().unwrap_or([1.0; 5]);
        let space = extended_space(records, spec, space, (with, &motor))?;
        let problem = Arc::new(Problem::new(records, spec.model, space.clone(), spec.criterion)?);
        let plain = fit_problem(records, &space, spec.model)?;
        let starts = starts(&problem)?;
        let rough = best_start(&plain, &starts, &deviations(records));
        let values = rough.map(|refined| refined.values).or_else(|| starts.into_iter().next()).unwrap_or_default();
        let refined = refine_on(&plain, &values, None)?;
        let independent = independent(&plain, &refined);
        Ok(Fit { with: with.to_vec(), space, refined, independent })
    }
}

/// Explanations that are tried anew for an extension.
const ANEW: usize = 2;

/// Extensions that could be next: not what the model has, nor what the recordings cannot show.
fn candidates(records: &[Record], model: &Fit) -> Vec<Extension> {
    let any = |of: &dyn Fn(f64) -> bool| records.iter().any(|record| record.input().iter().any(|v| of(*v)));
    let both_ways = any(&|v| v > 0.0) && any(&|v| v < 0.0);
    let measured = |channel: usize| records.iter().any(|record| record.measured()[channel].is_some());
    let by_current = is_driven_by_current(records);
    let can = |extension: &Extension| match extension {
        _ if by_current && !allows(*extension) => false,
        Extension::DirectionGain => both_ways,
        // Without a current the drop of the brushes is that of a deadband or of friction.
        Extension::BrushDrop => measured(0),
        _ => true,
    };
    let extent = model.space.extent();
    Extension::ALL.into_iter().filter(|e| !extent.has_any(e.parameters())).filter(can).collect()
}

/// How many independent samples the residuals of each recording and channel have.
fn independent(problem: &Problem, refined: &Refined) -> Vec<[f64; 2]> {
    let of = |(recording, initial): (usize, &[f64; 2])| {
        let signals = &problem.signals()[recording];
        let model = problem.simulate(&refined.values, recording, *initial);
        [0, 1].map(|channel| {
            if !signals.has(channel) {
                return 0.0;
            }
            let residuals: Vec<f64> = signals.measured(channel).zip(&model[channel]).map(|(y, x)| y - x).collect();
            let squares: f64 = residuals.iter().map(|e| e * e).sum();
            let products: f64 = residuals.windows(2).map(|e| e[0] * e[1]).sum();
            let correlation = if squares > 0.0 { (products / squares).clamp(0.0, 0.9999) } else { 0.0 };
            #[expect(clippy::cast_precision_loss, reason = "a count of samples is far below 2^53")]
            let count = signals.count(channel) as f64;
            count * (1.0 - correlation) / (1.0 + correlation)
        })
    };
    refined.initial.iter().enumerate().map(of).collect()
}

/// Schwarz's criterion of a model less that of the one that it was made from, with the independent samples of the richer
/// one.
fn gain(from: &Fit, to: &Fit) -> f64 {
    let mut gain = 0.0;
    let mut samples: f64 = 0.0;
    for ((before, after), count) in from.refined.sigmas.iter().zip(&to.refined.sigmas).zip(&to.independent) {
        for channel in 0..2 {
            if count[channel] > 0.0 {
                gain += 2.0 * count[channel] * (after[channel] / before[channel]).ln();
                samples += count[channel];
            }
        }
    }
    #[expect(clippy::cast_precision_loss, reason = "small")]
    let more = to.space.free().len() as f64 - from.space.free().len() as f64;
    gain + more * samples.max(std::f64::consts::E).ln()
}

/// Whether some channel's residuals become smaller by enough to matter.
fn is_smaller(from: &Fit, to: &Fit) -> bool {
    let pairs = from.refined.sigma.iter().zip(&to.refined.sigma);
    pairs.filter_map(|(before, after)| Some((*after)? / (*before)?)).any(|ratio| ratio < 1.0 - SMALLEST)
}

fn rung(records: &[Record], fit: &Fit, gain: Option<f64>, taken: bool) -> Rung {
    Rung {
        with: fit.with.clone(),
        free: fit.space.free().len(),
        fit_percent: super::super::fit::fit_percent(records, &fit.refined),
        gain,
        taken,
    }
}
