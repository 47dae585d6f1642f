//! The parameters that recordings do not identify, in groups of which only combinations are known.

use super::hull::{Moved, shift, widen};
use super::profile::{Held, Points};
use super::refine::Fit;
use super::result::side;
use crate::motor::{Axis, Parameter, Scope, Space};
use crate::setting::text;
use crate::warning::Warning;

/// Values of parameters.
pub(super) type Named = Vec<((Parameter, Scope), f64)>;

/// The parameters that recordings do not identify.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Unidentified {
    /// One parameter of each unknown direction, which is held.
    pub held: Vec<Held>,
    /// Groups of parameters of which only combinations are known; one that is unknown for itself is a group.
    groups: Vec<Vec<(Parameter, Scope)>>,
}

impl Unidentified {
    /// Lets the intervals of a fit allow for what is held, and finds what changes with it. Returns, with their values within
    /// the limit, those that are identified after all. Nobody gave the bounds of parameters that are `automatic`.
    pub(super) fn allow(
        &mut self,
        fit: &mut Fit,
        profiles: Vec<Points>,
        automatic: &[Parameter],
    ) -> Vec<(Held, [f64; 2])> {
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
        // A motor's parameter that ends at a bound nobody gave, while others are open, rests on that bound.
        let rests = |n: &usize| {
            automatic.contains(&axes[*n].parameter)
                && side(&axes[*n], fit.refined.values[*n]).is_some()
                && !wide.is_empty()
        };
        let resting: Vec<usize> = (0..axes.len()).filter(rests).collect();
        resting.into_iter().for_each(|n| join(&mut self.groups, vec![name(n)]));
        for (n, _) in axes.iter().enumerate().filter(|(n, _)| self.contains(name(*n))) {
            fit.refined.uncertainty.forget(n);
        }
        narrow.into_iter().map(|(held, points)| (held, points.range)).collect()
    }

    /// Lets the intervals of a fit allow for other optima that fit as well, each with the values of some parameters: a profile
    /// that goes from one point to the next does not reach them.
    pub(super) fn allow_for(&mut self, fit: &mut Fit, optima: &[Named]) {
        let axes = fit.space.free().to_vec();
        for (n, axis) in axes.iter().enumerate() {
            let name = (axis.parameter, axis.scope);
            let of =
                |all: &Vec<((Parameter, Scope), f64)>| all.iter().find(|(p, _)| *p == name).map(|(_, value)| *value);
            let values: Vec<f64> = optima.iter().filter_map(of).collect();
            if !self.contains(name) && shift(&mut fit.refined, n, axis, &values) == Moved::Lost {
                join(&mut self.groups, vec![name]);
                fit.refined.uncertainty.forget(n);
            }
        }
    }

    /// Returns where a profile fits better, with a value for each free axis of `space`; `rest` is what is free beside those
    /// that are held.
    pub(super) fn better(&self, profiles: &[Points], space: &Space, rest: &Space) -> Option<Vec<f64>> {
        let (moved, point) = self.held.iter().zip(profiles).find_map(|(h, p)| Some((h.name(), p.better.as_ref()?)))?;
        let loose = || self.held.iter().map(Held::name).filter(|name| *name != moved).zip(&point.loose);
        let value = |axis: &Axis| {
            let name = (axis.parameter, axis.scope);
            let own = rest.free().iter().position(|a| (a.parameter, a.scope) == name);
            match own {
                _ if moved == name => Some(point.value),
                Some(n) => Some(point.refined.values[n]),
                None => loose().find(|(other, _)| *other == name).map(|(_, value)| *value),
            }
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
