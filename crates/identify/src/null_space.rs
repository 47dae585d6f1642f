//! The null space of the information matrix: selects the parameter to fix so that the others become identifiable, and the
//! parameters with a component in the same direction.

use super::checks::running;
use super::spec::IdentifySpec;
use motorfit_estimate::Refined;
use motorfit_motor::{Parameter, Scope, Space};

/// Smallest `|P_ij/P_ii|` of the projector P onto the null space at which parameter j changes together with the fixed parameter
/// i.
const TAKES_PART: f64 = 0.05;
/// Smallest squared projection `P_ii` of a parameter's axis onto the null space at which the parameter is unidentifiable alone.
const WHOLLY: f64 = 0.9;
/// Smallest squared projection of the axis of an extension's parameter onto the null space at which it is fixed first.
const FIXABLE: f64 = 0.05;

/// A parameter that recordings do not identify, with those that change together with it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Unknown {
    /// Index of the parameter among the free axes.
    pub index: usize,
    /// Other parameters with a component in the same direction.
    pub others: Vec<(Parameter, Scope)>,
    /// True if the parameter ends at an automatic bound.
    pub at_bound: bool,
}

/// Finds the next parameter to fix; `None` if all are identifiable.
pub(super) fn next_unknown(spec: &IdentifySpec, space: &Space, refined: &Refined) -> Option<Unknown> {
    let (axes, directions) = (space.free(), &refined.uncertainty.unidentifiable);
    if directions.is_empty() {
        let (parameter, _) = running(spec, space, refined)?;
        let index = axes.iter().zip(&refined.at_bound).position(|(a, side)| a.parameter == parameter && side.is_some());
        return index.map(|index| Unknown { index, others: Vec::new(), at_bound: true });
    }
    // The projector onto the null space does not depend on the choice of its basis.
    let entry = |a: usize, b: usize| directions.iter().map(|direction| direction[a] * direction[b]).sum::<f64>();
    let others = |index: usize| -> Vec<usize> {
        let part = |n: usize| (entry(index, n) / entry(index, index)).abs() > TAKES_PART;
        (0..axes.len()).filter(|n| *n != index && part(*n)).collect()
    };
    let is_alone = |n: usize| entry(n, n) > WHOLLY && others(n).is_empty();
    let largest = |among: &dyn Fn(usize) -> bool| {
        (0..axes.len()).filter(|n| among(*n)).max_by(|a, b| entry(*a, *a).total_cmp(&entry(*b, *b)))
    };
    let extension = |n: usize| axes[n].parameter.is_extension() && entry(n, n) > FIXABLE;
    let index = largest(&is_alone).or_else(|| largest(&extension)).or_else(|| largest(&|_| true))?;
    let name = |n: usize| (axes[n].parameter, axes[n].scope);
    Some(Unknown { index, others: others(index).into_iter().map(name).collect(), at_bound: false })
}
