//! Search around the ends of descents that do not agree: a backlash has many optima close to each other, of which few random starts
//! reach the same. The lowest end and the next lowest elsewhere move on to the lowest optimum that descents from around them reach. A
//! start counts as one that reached the lowest optimum only if its own end moved there: descents from around one optimum that return
//! to it are no evidence.

use super::ends::{SearchPoint, descend};
use super::search::Search;
use motorfit_evaluate::model::ModelAxis;
use rand::{Rng, RngExt as _, SeedableRng as _};

/// Rounds at most, ends that move on in each, and descents from around each of them.
pub(super) const ROUNDS: usize = 4;
const ENDS: usize = 4;
const DESCENTS: usize = 6;
/// Distances of starts from an end, as fractions of the range of each coordinate: from some standard errors to where other random starts
/// are.
const DISTANCES: [f64; 2] = [3e-3, 0.1];

/// Moves the lowest ends on until enough of them are in the lowest optimum; returns true if `is_ended` ended the search after a round.
pub(super) fn search_around(search: &mut Search<'_>, is_ended: &mut dyn FnMut(usize) -> bool) -> bool {
    let mut numbers = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(search.seed ^ 0x5eed);
    for round in 0..ROUNDS {
        // Descents with friction that sticks end where the cost has kinks, and do not agree on what leaves more than noise.
        let has_kinks = |search: &Search<'_>| search.problem.model().reactions() > 0 && !search.explains();
        if search.ends.is_empty() || search.is_conclusive() || has_kinks(search) {
            break;
        }
        let moving = moving(search);
        let axes = &search.problem.space().free;
        let starts: Vec<SearchPoint> = moving
            .iter()
            .flat_map(|n| std::iter::repeat_n(&search.ends[*n].at, DESCENTS))
            .map(|end| around(end, axes, &mut numbers))
            .collect();
        // Descents from around different ends are compared at their own ends, so none stops early because of another.
        let (found, simulations) = descend(search.problem, &starts, false);
        search.evaluations += simulations;
        for (n, found) in moving.into_iter().zip(found.chunks(DESCENTS)) {
            let best = found.iter().flatten().min_by(|a, b| a.cost.total_cmp(&b.cost));
            if let Some(best) = best.filter(|best| best.cost < search.ends[n].cost) {
                search.ends[n] = best.clone();
            }
        }
        if is_ended(round + 1) {
            return true;
        }
    }
    false
}

/// Returns the numbers of the lowest end and of the lowest ones elsewhere.
fn moving(search: &Search<'_>) -> Vec<usize> {
    let mut order: Vec<usize> = (0..search.ends.len()).collect();
    order.sort_by(|a, b| search.ends[*a].cost.total_cmp(&search.ends[*b].cost));
    let Some(first) = order.first().copied() else { return order };
    order.retain(|n| *n == first || !search.is_same(&search.ends[*n], &search.ends[first]));
    order.truncate(ENDS);
    order
}

/// Returns a random start near an end.
fn around(
    SearchPoint { values, initial, is_given }: &SearchPoint,
    axes: &[ModelAxis],
    numbers: &mut impl Rng,
) -> SearchPoint {
    let distance = DISTANCES[0] * (DISTANCES[1] / DISTANCES[0]).powf(numbers.random::<f64>());
    let moved = |(axis, value): (&ModelAxis, &f64)| {
        let (axis, share) = (axis.range(), distance * (2.0 * numbers.random::<f64>() - 1.0));
        axis.value(axis.of(*value) + share * (axis.of(axis.max) - axis.of(axis.min)))
    };
    let values = axes.iter().zip(values).map(moved).collect();
    SearchPoint { values, initial: initial.clone(), is_given: *is_given }
}
