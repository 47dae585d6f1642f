//! The directions in which recordings leave parameters unknown, as one space: which parameter is held so that the
//! others become known, and which others take part in its direction.

use super::checks::running;
use super::spec::IdentifySpec;
use crate::estimate::Refined;
use crate::motor::{Parameter, Scope, Space};

/// A parameter takes part in a direction when its step is more than this part of that of the parameter that is held.
const TAKES_PART: f64 = 0.05;
/// A parameter whose own axis lies in the space by this much is unknown for itself.
const WHOLLY: f64 = 0.9;
/// A parameter is held only if the space contains at least this part of its axis.
const HOLDABLE: f64 = 0.05;

/// A parameter that recordings do not identify, with those that change together with it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Unknown {
    /// The place of the parameter among the free ones.
    pub place: usize,
    /// The others that take part in its direction.
    pub others: Vec<(Parameter, Scope)>,
    /// True where it runs to a bound that nobody gave.
    pub at_bound: bool,
}

/// Finds the next parameter to hold; `None` where all are known.
pub(super) fn next_unknown(spec: &IdentifySpec, space: &Space, refined: &Refined) -> Option<Unknown> {
    let (axes, directions) = (space.free(), &refined.uncertainty.unknown);
    if directions.is_empty() {
        let (parameter, _) = running(spec, space, refined)?;
        let place = axes.iter().zip(&refined.at_bound).position(|(a, side)| a.parameter == parameter && side.is_some());
        return place.map(|place| Unknown { place, others: Vec::new(), at_bound: true });
    }
    // The projector on the space: it does not depend on the directions that span it.
    let entry = |a: usize, b: usize| directions.iter().map(|direction| direction[a] * direction[b]).sum::<f64>();
    let others = |place: usize| -> Vec<usize> {
        let part = |n: usize| (entry(place, n) / entry(place, place)).abs() > TAKES_PART;
        (0..axes.len()).filter(|n| *n != place && part(*n)).collect()
    };
    let is_alone = |n: usize| entry(n, n) > WHOLLY && others(n).is_empty();
    let largest = |among: &dyn Fn(usize) -> bool| {
        (0..axes.len()).filter(|n| among(*n)).max_by(|a, b| entry(*a, *a).total_cmp(&entry(*b, *b)))
    };
    let extension = |n: usize| axes[n].parameter.is_extension() && entry(n, n) > HOLDABLE;
    let place = largest(&is_alone).or_else(|| largest(&extension)).or_else(|| largest(&|_| true))?;
    let name = |n: usize| (axes[n].parameter, axes[n].scope);
    Some(Unknown { place, others: others(place).into_iter().map(name).collect(), at_bound: false })
}
