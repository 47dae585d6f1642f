//! Treatment of parameters that recordings do not identify. One parameter of each unidentifiable direction is fixed. Parameters
//! that move with it are unidentified too, and the intervals of the others are widened to the hull over its profile.

use super::estimates::side;
use super::null_space::next_unknown;
use super::open_groups::{Named, Unidentified};
use super::prepare::Prepared;
use super::profile::{FixedParameter, LIMIT, Points, QUANTILE, profile};
use super::refine::{Fit, refine_widening};
use crate::analysis::fit_percent;
use motorfit_core::Result;
use motorfit_estimate::{Refined, optima};
use motorfit_motor::{Parameter, Scope, Space};

/// Largest number of parameters that are fixed.
const FIXED_MAX: usize = 12;
/// Increase of the weighted sum of squares up to which a fit counts as equally good, before inflation by correlation.
const SAME: f64 = 1.0;
/// Largest number of restarts from a better optimum that a profile found.
const RESTARTS: usize = 3;
/// Smallest fit at which a channel counts as fitted \[%\].
const FITTED_PERCENT_MIN: f64 = 20.0;

/// Fixes parameters that the recordings do not identify. If no other parameter would be identifiable, the fit remains
/// unchanged. The parameters in `known` are fixed already.
///
/// # Errors
/// Propagates the errors of the refinement.
pub(super) fn fix_unidentified(prepared: &Prepared<'_>, fit: &mut Fit, known: Unidentified) -> Result<Unidentified> {
    if !prepared.spec.is_polished() {
        return Ok(known);
    }
    for _ in 0..RESTARTS {
        let (space, values) = (fit.space.clone(), fit.found.values.clone());
        let (unidentified, better) = fix_once(prepared, fit, known.clone())?;
        let Some(better) = better else { return Ok(unidentified) };
        fit.found.values = values;
        (fit.refined, fit.space) = refine_widening(&prepared.fitted(&space), &prepared.spec, &space, &better)?;
        fit.problem = prepared.searched(fit.space.clone());
    }
    Ok(fix_once(prepared, fit, known)?.0)
}

/// Fixes parameters that the recordings do not identify, and returns them together with the better point that a profile found,
/// one value per parameter that was free before.
fn fix_once(prepared: &Prepared<'_>, fit: &mut Fit, known: Unidentified) -> Result<(Unidentified, Option<Vec<f64>>)> {
    let (refined, space, values) = (fit.refined.clone(), fit.space.clone(), fit.found.values.clone());
    let mut unidentified = known.clone();
    let mut searched = Vec::new();
    while unidentified.fixed.len() < FIXED_MAX && fit.space.free().len() > 1 {
        let Some(unknown) = next_unknown(&prepared.spec, &fit.space, &fit.refined) else { break };
        let (axis, value) = (fit.space.free()[unknown.index], fit.refined.values[unknown.index]);
        if is_unfitted(prepared, fit) || is_doubtful(prepared, fit) {
            break;
        }
        let (value, (refined, space)) = fixed_near(prepared, fit, unknown.index, value)?;
        searched.push((axis, fit.found.values.remove(unknown.index)));
        (fit.refined, fit.space) = (refined, space);
        unidentified.fixed.push(FixedParameter { axis, value, others: unknown.others });
    }
    if unidentified.fixed.is_empty() {
        return Ok((unidentified, None));
    }
    let indices = 0..unidentified.fixed.len();
    let profiles = indices.map(|n| profile(prepared, fit, &unidentified.fixed, n)).collect::<Result<Vec<Points>>>()?;
    let better = unidentified.better(&profiles, &space, &fit.space);
    let narrow = unidentified.allow(fit, profiles, &prepared.spec.auto_bounds);
    unidentified.allow_for(fit, &others(prepared, &space, &refined)?);
    if fit.refined.uncertainty.std_error.iter().all(Option::is_none)
        || !fit.refined.uncertainty.unidentifiable.is_empty()
    {
        (fit.refined, fit.space, fit.found.values) = (refined, space, values);
        return Ok((known, better));
    }
    for (identified, range) in narrow {
        free(fit, &identified, range)?;
        fit.found.values.extend(searched.iter().find(|(axis, _)| *axis == identified.axis).map(|(_, value)| *value));
    }
    fit.problem = prepared.searched(fit.space.clone());
    Ok((unidentified, better))
}

/// Returns the optima within the 95 % limit of χ² that a multistart finds, each as its parameters with their values.
fn others(prepared: &Prepared<'_>, space: &Space, refined: &Refined) -> Result<Vec<Named>> {
    let limit = refined.weighted(&refined.weights) + LIMIT * refined.uncertainty.variance_inflation();
    let ends = optima(&prepared.fitted(space), &refined.weights, limit)?;
    let named = |end: &Refined| {
        let values = space.free().iter().zip(&end.values);
        values.map(|(axis, value)| ((axis.parameter, axis.scope), *value)).collect()
    };
    Ok(ends.iter().map(named).collect())
}

/// Returns true if no channel is fitted, so that there is no partial result.
fn is_unfitted(prepared: &Prepared<'_>, fit: &Fit) -> bool {
    fit_percent(prepared.records, &fit.refined).iter().flatten().all(|percent| *percent < FITTED_PERCENT_MIN)
}

/// Returns true if a fit may be a wrong optimum, where identifiability has no meaning: a channel is not fitted and its
/// residuals are far above its noise.
fn is_doubtful(prepared: &Prepared<'_>, fit: &Fit) -> bool {
    let percent = fit_percent(prepared.records, &fit.refined);
    let is_far = |channel: usize| {
        let mut signals = fit.problem.signals().iter().zip(&fit.refined.sigmas);
        signals.any(|(signals, sigma)| signals.is_above_noise(channel, sigma[channel]))
    };
    (0..2).any(|channel| percent[channel].is_some_and(|percent| percent < FITTED_PERCENT_MIN) && is_far(channel))
}

/// Frees a parameter that its profile identifies, with the limits of the profile as its interval.
fn free(fit: &mut Fit, identified: &FixedParameter, range: [f64; 2]) -> Result<()> {
    let FixedParameter { axis, value, .. } = identified;
    let is_other = |(p, scope, _): &&(Parameter, Scope, f64)| (*p, *scope) != (axis.parameter, axis.scope);
    let fixed = fit.space.fixed().iter().filter(is_other).copied().collect();
    fit.space = Space::new(fit.space.free().iter().copied().chain([*axis]).collect(), fixed)?;
    let refined = &mut fit.refined;
    let side = side([axis.min, axis.max], *value);
    refined.values.push(*value);
    refined.at_bound.push(side);
    let uncertainty = &mut refined.uncertainty;
    let is_known = side.is_none();
    uncertainty.std_error.push(is_known.then(|| (range[1] - value).max(value - range[0]) / QUANTILE));
    uncertainty.ci95.push(is_known.then_some(range));
    let size = uncertainty.correlation.len() + 1;
    uncertainty.correlation.iter_mut().for_each(|row| row.push(None));
    uncertainty.correlation.push(vec![None; size]);
    uncertainty.covariance.iter_mut().for_each(|row| row.push(0.0));
    uncertainty.covariance.push(vec![0.0; size]);
    uncertainty.open.push(false);
    Ok(())
}

/// Fixes a parameter at its neutral value if the fit is equally good there, otherwise at `value`. Returns the value with the
/// refinement of the other parameters.
fn fixed_near(prepared: &Prepared<'_>, fit: &Fit, index: usize, value: f64) -> Result<(f64, (Refined, Space))> {
    let sigma = &fit.refined.sigmas;
    let limit = fit.refined.weighted(sigma) + SAME * fit.refined.uncertainty.variance_inflation();
    if let Some(neutral) = fit.space.free()[index].neutral()
        && let Ok(refined) = fixed_at(prepared, fit, index, neutral)
        && refined.0.weighted(sigma) <= limit
    {
        return Ok((neutral, refined));
    }
    Ok((value, fixed_at(prepared, fit, index, value)?))
}

/// Refines the other parameters with one fixed at a value.
fn fixed_at(prepared: &Prepared<'_>, fit: &Fit, index: usize, value: f64) -> Result<(Refined, Space)> {
    let (mut free, mut fixed) = (fit.space.free().to_vec(), fit.space.fixed().to_vec());
    let mut values = fit.refined.values.clone();
    let axis = free.remove(index);
    values.remove(index);
    fixed.push((axis.parameter, axis.scope, value));
    let space = Space::new(free, fixed)?;
    refine_widening(&prepared.fitted(&space), &prepared.spec, &space, &values)
}
