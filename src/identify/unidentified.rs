//! Parameters that recordings do not identify. One of each unknown direction is held, so that the others stay; what
//! changes with the choice is open too, and the intervals of the rest allow for it.

use super::null_space::next_unknown;
use super::open_groups::{Named, Unidentified};
use super::prepare::Prepared;
use super::profile::{Held, LIMIT, Points, QUANTILE, profile};
use super::refine::{Fit, refine_widening};
use super::result::side;
use crate::Result;
use crate::analysis::{fit_percent, variance_inflation};
use crate::estimate::{Refined, optima};
use crate::motor::{Parameter, Scope, Space};

/// Parameters that may be held, one after the other.
const HELD_MAX: usize = 12;
/// A weighted sum of squares that rises by less than this stays the same.
const SAME: f64 = 1.0;
/// Better optima that are followed.
const RESTARTS: usize = 3;
/// A channel that is fitted worse than this is not explained \[%\].
const NOTHING_PERCENT: f64 = 20.0;

/// Holds parameters that the recordings do not identify: what else there is stays. Where nothing else would be known the
/// fit is left as it is. Those that are `known` to be unidentified are held already.
///
/// # Errors
/// As a refinement.
pub(super) fn fix_unidentified(prepared: &Prepared<'_>, fit: &mut Fit, known: Unidentified) -> Result<Unidentified> {
    if !prepared.spec.is_polished() {
        return Ok(known);
    }
    for _ in 0..RESTARTS {
        let (space, values) = (fit.space.clone(), fit.found.values.clone());
        let (unidentified, better) = held(prepared, fit, known.clone())?;
        let Some(better) = better else { return Ok(unidentified) };
        // The profile leads to a better optimum.
        fit.found.values = values;
        (fit.refined, fit.space) = refine_widening(&prepared.fitted(&space), &prepared.spec, &space, &better)?;
        fit.problem = prepared.searched(fit.space.clone());
    }
    Ok(held(prepared, fit, known)?.0)
}

/// Holds parameters that the recordings do not identify, and returns them with values of all that were free where a profile
/// fits better.
fn held(prepared: &Prepared<'_>, fit: &mut Fit, known: Unidentified) -> Result<(Unidentified, Option<Vec<f64>>)> {
    let (refined, space, values) = (fit.refined.clone(), fit.space.clone(), fit.found.values.clone());
    let mut unidentified = known.clone();
    let mut searched = Vec::new();
    while unidentified.held.len() < HELD_MAX && fit.space.free().len() > 1 {
        let Some(unknown) = next_unknown(&prepared.spec, &fit.space, &fit.refined) else { break };
        let (axis, value) = (fit.space.free()[unknown.place], fit.refined.values[unknown.place]);
        if is_nothing(prepared, fit) || is_doubtful(prepared, fit) {
            break;
        }
        let (value, (refined, space)) = held_at(prepared, fit, unknown.place, value)?;
        searched.push((axis, fit.found.values.remove(unknown.place)));
        (fit.refined, fit.space) = (refined, space);
        unidentified.held.push(Held { axis, value, others: unknown.others });
    }
    if unidentified.held.is_empty() {
        return Ok((unidentified, None));
    }
    let places = 0..unidentified.held.len();
    let profiles = places.map(|n| profile(prepared, fit, &unidentified.held, n)).collect::<Result<Vec<Points>>>()?;
    let better = unidentified.better(&profiles, &space, &fit.space);
    let narrow = unidentified.allow(fit, profiles, &prepared.spec.auto_bounds);
    unidentified.allow_for(fit, &others(prepared, &space, &refined)?);
    if fit.refined.uncertainty.std_error.iter().all(Option::is_none) || !fit.refined.uncertainty.unknown.is_empty() {
        (fit.refined, fit.space, fit.found.values) = (refined, space, values);
        return Ok((known, better));
    }
    for (held, range) in narrow {
        free(fit, &held, range)?;
        fit.found.values.extend(searched.iter().find(|(axis, _)| *axis == held.axis).map(|(_, value)| *value));
    }
    fit.problem = prepared.searched(fit.space.clone());
    Ok((unidentified, better))
}

/// Returns the other optima of a refinement that its data do not exclude, each with its parameters.
fn others(prepared: &Prepared<'_>, space: &Space, refined: &Refined) -> Result<Vec<Named>> {
    let limit = refined.weighted(&refined.weights) + LIMIT * variance_inflation(&refined.uncertainty);
    let ends = optima(&prepared.fitted(space), &refined.weights, limit)?;
    let named = |end: &Refined| {
        let values = space.free().iter().zip(&end.values);
        values.map(|(axis, value)| ((axis.parameter, axis.scope), *value)).collect()
    };
    Ok(ends.iter().map(named).collect())
}

/// Returns whether a fit explains no channel: there is no part of an answer then.
fn is_nothing(prepared: &Prepared<'_>, fit: &Fit) -> bool {
    fit_percent(prepared.records, &fit.refined).iter().flatten().all(|percent| *percent < NOTHING_PERCENT)
}

/// Returns whether a fit may be a wrong optimum: next to nothing of a channel is fitted, and its residuals are far above its
/// noise. What is unknown there is no finding.
fn is_doubtful(prepared: &Prepared<'_>, fit: &Fit) -> bool {
    let percent = fit_percent(prepared.records, &fit.refined);
    let is_far = |channel: usize| {
        let mut signals = fit.problem.signals().iter().zip(&fit.refined.sigmas);
        signals.any(|(signals, sigma)| signals.is_above_noise(channel, sigma[channel]))
    };
    (0..2).any(|channel| percent[channel].is_some_and(|percent| percent < NOTHING_PERCENT) && is_far(channel))
}

/// Frees a parameter that its profile identifies, between the values of the profile.
fn free(fit: &mut Fit, held: &Held, range: [f64; 2]) -> Result<()> {
    let Held { axis, value, .. } = held;
    let is_other = |(p, scope, _): &&(Parameter, Scope, f64)| (*p, *scope) != (axis.parameter, axis.scope);
    let fixed = fit.space.fixed().iter().filter(is_other).copied().collect();
    fit.space = Space::new(fit.space.free().iter().copied().chain([*axis]).collect(), fixed)?;
    let refined = &mut fit.refined;
    let side = side(axis, *value);
    refined.values.push(*value);
    refined.at_bound.push(side);
    let uncertainty = &mut refined.uncertainty;
    let is_known = side.is_none();
    uncertainty.std_error.push(is_known.then(|| (range[1] - value).max(value - range[0]) / QUANTILE));
    uncertainty.ci95.push(is_known.then_some(range));
    let size = uncertainty.correlation.len() + 1;
    uncertainty.correlation.iter_mut().for_each(|row| row.push(None));
    uncertainty.correlation.push(vec![None; size]);
    Ok(())
}

/// Holds a parameter where it changes nothing, if the fit stays the same, or else where it is. Returns its value with the
/// refinement of the others.
fn held_at(prepared: &Prepared<'_>, fit: &Fit, place: usize, value: f64) -> Result<(f64, (Refined, Space))> {
    let sigma = &fit.refined.sigmas;
    let limit = fit.refined.weighted(sigma) + SAME * variance_inflation(&fit.refined.uncertainty);
    if let Some(neutral) = fit.space.free()[place].neutral()
        && let Ok(held) = fixed_at(prepared, fit, place, neutral)
        && held.0.weighted(sigma) <= limit
    {
        return Ok((neutral, held));
    }
    Ok((value, fixed_at(prepared, fit, place, value)?))
}

/// Refines the others with one parameter held at a value.
fn fixed_at(prepared: &Prepared<'_>, fit: &Fit, place: usize, value: f64) -> Result<(Refined, Space)> {
    let (mut free, mut fixed) = (fit.space.free().to_vec(), fit.space.fixed().to_vec());
    let mut values = fit.refined.values.clone();
    let axis = free.remove(place);
    values.remove(place);
    fixed.push((axis.parameter, axis.scope, value));
    let space = Space::new(free, fixed)?;
    refine_widening(&prepared.fitted(&space), &prepared.spec, &space, &values)
}
