//! Groups of parameters of which recordings identify at most some combinations, not each parameter.

use super::estimates::side;
use super::hull::{Moved, shift, widen};
use super::profile::{FixedParameter, Points};
use super::refine::Fit;
use motorfit_core::setting::text;
use motorfit_motor::{Axis, Parameter, Scope, Space};
use motorfit_record::warning::Warning;

/// Parameters with their values.
pub(super) type Named = Vec<((Parameter, Scope), f64)>;

/// The parameters that recordings do not identify.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Unidentified {
    /// One fixed parameter for each unidentifiable direction.
    pub fixed: Vec<FixedParameter>,
    /// Groups of parameters of which only combinations are identifiable; a parameter that is unidentifiable alone is a group
    /// of one.
    groups: Vec<Vec<(Parameter, Scope)>>,
}

impl Unidentified {
    /// Widens the intervals of a fit to the hull over the profiles of the fixed parameters, and groups the parameters that move
    /// with them. Returns the fixed parameters that their profiles identify after all, with the limits of the profiles.
    /// `automatic` are the parameters with automatic bounds.
    pub(super) fn allow(
        &mut self,
        fit: &mut Fit,
        profiles: Vec<Points>,
        automatic: &[Parameter],
    ) -> Vec<(FixedParameter, [f64; 2])> {
        let axes = fit.space.free().to_vec();
        let name = |n: usize| (axes[n].parameter, axes[n].scope);
        let all: Vec<(FixedParameter, Points)> = self.fixed.drain(..).zip(profiles).collect();
        let (narrow, wide): (Vec<_>, Vec<_>) =
            all.into_iter().partition(|(fixed, points)| points.is_narrow(&fixed.axis));
        self.fixed = wide.iter().map(|(fixed, _)| fixed.clone()).collect();
        self.groups.clear();
        for (fixed, points) in &wide {
            let mut group = vec![fixed.name()];
            group.extend(self.fixed.iter().map(FixedParameter::name).filter(|other| fixed.others.contains(other)));
            for (n, axis) in axes.iter().enumerate() {
                let takes_part = fixed.others.contains(&name(n));
                match widen(&mut fit.refined, n, axis, &points.fits) {
                    Moved::Lost => group.push(name(n)),
                    Moved::Beyond if takes_part => group.push(name(n)),
                    _ => {}
                }
            }
            join(&mut self.groups, group);
        }
        for (fixed, points) in &narrow {
            axes.iter().enumerate().for_each(|(n, axis)| _ = widen(&mut fit.refined, n, axis, &points.fits));
            debug_assert!(!self.contains(fixed.name()));
        }
        // While other parameters are unidentified, a value at an automatic bound depends on that bound alone.
        let rests = |n: &usize| {
            automatic.contains(&axes[*n].parameter)
                && side([axes[*n].min, axes[*n].max], fit.refined.values[*n]).is_some()
                && !wide.is_empty()
        };
        let resting: Vec<usize> = (0..axes.len()).filter(rests).collect();
        resting.into_iter().for_each(|n| join(&mut self.groups, vec![name(n)]));
        for (n, _) in axes.iter().enumerate().filter(|(n, _)| self.contains(name(*n))) {
            fit.refined.uncertainty.forget(n);
        }
        narrow.into_iter().map(|(fixed, points)| (fixed, points.range)).collect()
    }

    /// Widens the intervals of a fit to the hull over other optima that fit as well, which a profile does not reach because it
    /// proceeds from point to point.
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

    /// Returns the better point that a profile found, one value per free axis of `space`; `None` if no profile found one.
    /// `rest` is the space in which the unidentified parameters are fixed.
    pub(super) fn better(&self, profiles: &[Points], space: &Space, rest: &Space) -> Option<Vec<f64>> {
        let (moved, point) = self.fixed.iter().zip(profiles).find_map(|(f, p)| Some((f.name(), p.better.as_ref()?)))?;
        let released =
            || self.fixed.iter().map(FixedParameter::name).filter(|name| *name != moved).zip(&point.released);
        let value = |axis: &Axis| {
            let name = (axis.parameter, axis.scope);
            let own = rest.free().iter().position(|a| (a.parameter, a.scope) == name);
            match own {
                _ if moved == name => Some(point.value),
                Some(n) => Some(point.refined.values[n]),
                None => released().find(|(other, _)| *other == name).map(|(_, value)| *value),
            }
        };
        space.free().iter().map(value).collect()
    }

    fn contains(&self, parameter: (Parameter, Scope)) -> bool {
        self.groups.iter().flatten().any(|open| *open == parameter)
    }

    /// Returns the parameters of all groups.
    pub(super) fn all(&self) -> impl Iterator<Item = (Parameter, Scope)> {
        self.groups.iter().flatten().copied()
    }

    /// Returns a warning for each group.
    pub(super) fn warnings(&self) -> Vec<Warning> {
        let is_fixed = |of: &(Parameter, Scope)| self.fixed.iter().any(|fixed| fixed.name() == *of);
        let warning = |group: &Vec<(Parameter, Scope)>| warning(group, group.iter().filter(|p| !is_fixed(p)).count());
        self.groups.iter().map(warning).collect()
    }
}

/// Adds a group and merges it with the groups that share a parameter with it.
fn join(groups: &mut Vec<Vec<(Parameter, Scope)>>, mut group: Vec<(Parameter, Scope)>) {
    let (shared, mut apart): (Vec<_>, Vec<_>) =
        groups.drain(..).partition(|of: &Vec<_>| of.iter().any(|p| group.contains(p)));
    group.extend(shared.into_iter().flatten());
    group.sort_by_key(|(parameter, scope)| scope.order(*parameter));
    group.dedup();
    apart.push(group);
    *groups = apart;
}

/// Returns the warning for a group of parameters of which `known` combinations are identifiable.
fn warning(group: &[(Parameter, Scope)], known: usize) -> Warning {
    let allowed = "the intervals of the other parameters allow for it";
    let remedy = "record faster, or under a voltage that changes more";
    if let [(parameter, scope)] = group {
        let (symbol, name) = (scope.name(*parameter), parameter.name());
        let message = format!("the recordings do not identify {symbol}, the {name}; {allowed}; {remedy}");
        return Warning::new("not_identifiable", message);
    }
    let mut names: Vec<String> = group.iter().map(|(parameter, scope)| scope.name(*parameter)).collect();
    let last = names.pop().unwrap_or_default();
    let list = format!("{} and {last}", names.join(", "));
    let what = match known {
        0 => format!("the recordings do not identify {list}"),
        1 => format!("only a combination of {list} is identifiable"),
        _ => format!("only {known} combinations of {list} are identifiable"),
    };
    Warning::new("not_identifiable", text!("{what}; {allowed}; fix one with " [Fix] ", or {remedy}"))
}
