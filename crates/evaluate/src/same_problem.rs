//! Groups of a batch that have the same problem, which are evaluated as one.

use super::evaluator::Group;
use motorfit_core::Result;
use motorfit_core::candidates::Candidates;
use std::collections::BTreeMap;

/// A group of a batch with the costs of its candidates.
pub(super) type Costed<'b, 'g, P> = (&'b Group<'g, P>, &'b mut [f64]);

/// Returns the groups of a batch by their problems, with their parts of the costs.
pub(super) fn by_problem<'b, 'g, P>(
    groups: &'b [Group<'g, P>],
    mut costs: &'b mut [f64],
) -> Vec<Vec<Costed<'b, 'g, P>>> {
    let mut places = BTreeMap::new();
    let mut all: Vec<Vec<Costed<'b, 'g, P>>> = Vec::new();
    for group in groups {
        let (own, others) = costs.split_at_mut(group.candidates.count());
        costs = others;
        let place = *places.entry(std::ptr::from_ref(&**group.problem)).or_insert(all.len());
        if place == all.len() {
            all.push(Vec::new());
        }
        all[place].push((group, own));
    }
    all
}

/// Evaluates groups with the same problem as one group.
pub(super) fn as_one<P>(
    groups: Vec<Costed<'_, '_, P>>,
    evaluate: impl FnOnce(&Group<'_, P>, &mut [f64]) -> Result<()>,
) -> Result<()> {
    let mut groups = groups;
    if let [(group, costs)] = &mut groups[..] {
        return evaluate(group, costs);
    }
    let Some(&(first, _)) = groups.first() else { return Ok(()) };
    let all = || groups.iter().map(|(group, _)| group.candidates);
    let values: Vec<f64> = all().flat_map(|own| own.values()).copied().collect();
    let has_cutoffs = all().any(|own| !own.cutoffs().is_empty());
    // A candidate without a cutoff needs its cost.
    let of = |own: Candidates<'_>, n: usize| own.cutoffs().get(n).copied().unwrap_or(f64::INFINITY);
    let cutoffs: Vec<f64> = all().flat_map(|own| (0..own.count()).map(move |n| of(own, n))).collect();
    let merged = Candidates::new(&values, first.candidates.width());
    let candidates = if has_cutoffs { merged.with_cutoffs(&cutoffs) } else { merged };
    let mut found = vec![0.0; candidates.count()];
    evaluate(&Group { candidates, ..*first }, &mut found)?;
    let mut rest = &found[..];
    for (_, costs) in groups {
        let (own, others) = rest.split_at(costs.len());
        costs.copy_from_slice(own);
        rest = others;
    }
    Ok(())
}
