//! Parameters that recordings do not identify. One of each unknown direction is held, so that the others stay; what
//! changes with the choice is open too, and the intervals of the rest allow for it.

use super::null_space::{neutral, next_unknown};
use super::prepare::Prepared;
use super::profile::{Held, Moved, Points, QUANTILE, profile, widen};
use super::refine::{Fit, refine_widening};
use super::result::side;
use crate::Result;
use crate::analysis::{fit_percent, variance_inflation};
use crate::estimate::{Refined, Uncertainty};
use crate::motor::{Axis, Parameter, Scope, Space};
use crate::setting::text;
use crate::warning::Warning;

/// Parameters that may be held, one after the other.
const HELD_MAX: usize = 12;
/// A weighted sum of squares that rises by less than this stays the same.
const SAME: f64 = 1.0;
/// Better optima that are followed.
const RESTARTS: usize = 3;
/// Residuals of more σ than these of the noise are not noise.
const FAR: f64 = 2.0;
/// A channel that is fitted worse than this may belong to a wrong optimum \[%\].
const DOUBTFUL_PERCENT: f64 = 80.0;

/// The parameters that recordings do not identify.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Unidentified {
    held: Vec<Held>,
    /// Groups of parameters of which only combinations are known; one that is unknown for itself is a group.
    groups: Vec<Vec<(Parameter, Scope)>>,
}

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
        if unknown.at_bound && is_doubtful(prepared, fit) {
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
    let profiles: Vec<Points> =
        unidentified.held.iter().map(|held| profile(prepared, fit, held)).collect::<Result<_>>()?;
    let better = unidentified.better(&profiles, &space, &fit.space);
    let narrow = unidentified.allow(fit, profiles);
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

/// Returns whether a fit may be a wrong optimum: the residuals of a channel are far above its noise, and the channel is not
/// fitted well. A parameter that runs to a bound there is no finding.
fn is_doubtful(prepared: &Prepared<'_>, fit: &Fit) -> bool {
    let percent = fit_percent(prepared.records, &fit.refined);
    let is_far = |channel: usize| {
        let signals = fit.problem.signals().iter().zip(&fit.refined.sigmas);
        let mut measured = signals.filter(|(signals, _)| signals.has(channel));
        measured.any(|(signals, sigma)| sigma[channel] > FAR * signals.noise(channel))
    };
    (0..2).any(|channel| percent[channel].is_some_and(|percent| percent < DOUBTFUL_PERCENT) && is_far(channel))
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
    if let Some(neutral) = neutral(&fit.space.free()[place])
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

impl Unidentified {
    /// Lets the intervals of a fit allow for what is held, and finds what changes with it. Returns, with their values within
    /// the limit, those that are identified after all.
    fn allow(&mut self, fit: &mut Fit, profiles: Vec<Points>) -> Vec<(Held, [f64; 2])> {
        let axes = fit.space.free().to_vec();
        let name = |n: usize| (axes[n].parameter, axes[n].scope);
        let all: Vec<(Held, Points)> = self.held.drain(..).zip(profiles).collect();
        let (narrow, wide): (Vec<_>, Vec<_>) = all.into_iter().partition(|(held, points)| points.is_narrow(&held.axis));
        self.held = wide.iter().map(|(held, _)| held.clone()).collect();
        self.groups.clear();
        for (held, points) in &wide {
            let mut group = vec![held.name()];
            group.extend(self.held.iter().map(Held::name).filter(|other| held.others.contains(other)));
            for (n, axis) in axes.iter().enumerate() {
                let takes_part = held.others.contains(&name(n));
                match widen(&mut fit.refined, n, axis, &points.fits) {
                    Moved::Lost => group.push(name(n)),
                    Moved::Beyond if takes_part => group.push(name(n)),
                    _ => {}
                }
            }
            join(&mut self.groups, group);
        }
        for (held, points) in &narrow {
            axes.iter().enumerate().for_each(|(n, axis)| _ = widen(&mut fit.refined, n, axis, &points.fits));
            debug_assert!(!self.contains(held.name()));
        }
        for (n, _) in axes.iter().enumerate().filter(|(n, _)| self.contains(name(*n))) {
            forget(&mut fit.refined.uncertainty, n);
        }
        narrow.into_iter().map(|(held, points)| (held, points.range)).collect()
    }

    /// Returns where a profile fits better, with a value for each free axis of `space`; `rest` is what is free beside those
    /// that are held.
    fn better(&self, profiles: &[Points], space: &Space, rest: &Space) -> Option<Vec<f64>> {
        let (moved, (at, values)) = self.held.iter().zip(profiles).find_map(|(h, p)| Some((h, p.better.as_ref()?)))?;
        let value = |axis: &Axis| {
            let name = (axis.parameter, axis.scope);
            let own = rest.free().iter().position(|a| (a.parameter, a.scope) == name);
            let held = || self.held.iter().find(|held| held.name() == name).map(|held| held.value);
            if moved.name() == name { Some(*at) } else { own.map(|n| values[n]).or_else(held) }
        };
        space.free().iter().map(value).collect()
    }

    fn contains(&self, parameter: (Parameter, Scope)) -> bool {
        self.groups.iter().flatten().any(|open| *open == parameter)
    }

    /// Returns all of them.
    pub(super) fn all(&self) -> impl Iterator<Item = (Parameter, Scope)> {
        self.groups.iter().flatten().copied()
    }

    /// Returns a warning for each group.
    pub(super) fn warnings(&self) -> Vec<Warning> {
        let held = |of: &(Parameter, Scope)| self.held.iter().any(|held| held.name() == *of);
        let warning = |group: &Vec<(Parameter, Scope)>| warning(group, group.iter().filter(|p| !held(p)).count());
        self.groups.iter().map(warning).collect()
    }
}

/// Adds a group to those that share none of its parameters; others become one with it.
fn join(groups: &mut Vec<Vec<(Parameter, Scope)>>, mut group: Vec<(Parameter, Scope)>) {
    let (shared, mut apart): (Vec<_>, Vec<_>) =
        groups.drain(..).partition(|of: &Vec<_>| of.iter().any(|p| group.contains(p)));
    group.extend(shared.into_iter().flatten());
    group.sort_by_key(|(parameter, scope)| scope.order(*parameter));
    group.dedup();
    apart.push(group);
    *groups = apart;
}

/// Removes a parameter from an uncertainty, whose size stays.
fn forget(uncertainty: &mut Uncertainty, place: usize) {
    (uncertainty.std_error[place], uncertainty.ci95[place]) = (None, None);
    uncertainty.correlation[place].fill(None);
    uncertainty.correlation.iter_mut().for_each(|row| row[place] = None);
}

/// Returns the warning for a group of parameters of which so many combinations are known.
fn warning(group: &[(Parameter, Scope)], known: usize) -> Warning {
    let allowed = "the intervals of the others allow for it";
    let remedy = "record faster, or under a voltage that changes more";
    if let [(parameter, scope)] = group {
        let (symbol, name) = (scope.name(*parameter), parameter.name());
        let message = format!("the recordings do not tell {symbol}, the {name}; {allowed}; {remedy}");
        return Warning::new("not_identifiable", message);
    }
    let mut names: Vec<String> = group.iter().map(|(parameter, scope)| scope.name(*parameter)).collect();
    let last = names.pop().unwrap_or_default();
    let list = format!("{} and {last}", names.join(", "));
    let what = match known {
        0 => format!("the recordings do not tell {list}"),
        1 => format!("only a combination of {list} is identifiable"),
        _ => format!("only {known} combinations of {list} are identifiable"),
    };
    Warning::new("not_identifiable", text!("{what}; {allowed}; hold one with " [Fix] ", or {remedy}"))
}
