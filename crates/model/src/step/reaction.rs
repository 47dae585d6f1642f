//! Set-valued reactions at the end of a step.
//!
//! A unit of a reaction that is constant over a step changes the states by its gain g (`coupling.rs`). The reaction takes the value within ±limit
//! that brings its own state to zero: it subtracts δ from its own state and `(g_other/g_own) δ` from the others, where δ is that
//! state, clipped to ±limit |g_own|, so that a state at rest is exactly zero. Where a state passes zero within the step the reaction
//! changes its sign there; formulas: `motor/friction.rs`. Reactions act in the order of their states.
//!
//! A limit that varies is the mean of those at both ends of the step: reactions with the limits at its start lead to the states at
//! its end, at which limits are computed again.

use super::right_hand_sides::{InputsAt, right_hand_sides};
use crate::definition::Model;
use crate::graph::{Binary, Comparison, Graph, Id, Unary};

/// States and inputs at one end of a step.
#[derive(Clone, Copy)]
pub(super) struct StepEnd<'a> {
    pub states: &'a [Id],
    pub inputs: &'a InputsAt,
}

/// Returns the states after the reactions. `begin` are states and inputs at the start of the step, `end` those at its end without
/// reactions.
pub(super) fn react(
    graph: &mut Graph,
    model: &Model,
    begin: StepEnd<'_>,
    end: StepEnd<'_>,
    gains: &[Vec<Id>],
) -> Vec<Id> {
    let first = limits(graph, model, begin);
    let after = with_limits(graph, model, begin, end, (gains, &first));
    if first.iter().all(|limit| graph.is_fixed(*limit)) {
        return after;
    }
    let last = limits(graph, model, StepEnd { states: &after, ..end });
    let half = graph.constant(0.5);
    let mean = |(a, b): (&Id, &Id)| {
        let sum = graph.add(*a, *b);
        graph.multiply(half, sum)
    };
    let means: Vec<Id> = first.iter().zip(&last).map(mean).collect();
    with_limits(graph, model, begin, end, (gains, &means))
}

/// Returns the limit of each reaction at one end of a step.
fn limits(graph: &mut Graph, model: &Model, at: StepEnd<'_>) -> Vec<Id> {
    let of: Vec<Id> = model.reactions.iter().map(|reaction| reaction.limit).collect();
    right_hand_sides(graph, &of, at.states, at.inputs)
}

/// Returns the states after reactions with the given gains and limits.
fn with_limits(
    graph: &mut Graph,
    model: &Model,
    begin: StepEnd<'_>,
    end: StepEnd<'_>,
    (gains, limits): (&[Vec<Id>], &[Id]),
) -> Vec<Id> {
    let mut order: Vec<usize> = (0..model.reactions.len()).collect();
    order.sort_by_key(|n| model.reactions[*n].state);
    let mut free = end.states.to_vec();
    for n in order {
        let (of, gain) = (model.reactions[n].state, &gains[n]);
        let own = gain[of];
        let size = graph.unary(Unary::Abs, own);
        let most = graph.multiply(limits[n], size);
        let taken = taken(graph, begin.states[of], free[of], most);
        for (state, x) in free.iter_mut().enumerate() {
            let part = match state == of {
                true => taken,
                false => {
                    let ratio = graph.divide(gain[state], own);
                    graph.multiply(ratio, taken)
                }
            };
            *x = graph.subtract(*x, part);
        }
    }
    free
}

/// Returns what a reaction subtracts from its state, `before` at the start of the step and `x` at its end without the reaction.
fn taken(graph: &mut Graph, before: Id, x: Id, most: Id) -> Id {
    let least = graph.negative(most);
    let above = graph.binary(Binary::Max, x, least);
    let clipped = graph.binary(Binary::Min, above, most);
    let sign = graph.unary(Unary::Sign, before);
    let [size, along] = [before, x].map(|of| graph.multiply(sign, of));
    let pull = graph.subtract(size, along);
    let pulled = graph.subtract(size, most);
    let earliest = graph.binary(Binary::Min, pulled, most);
    let duration = graph.add(pull, most);
    let share = graph.divide(size, duration);
    let one = graph.constant(1.0);
    let left = graph.subtract(one, share);
    let excess = graph.subtract(pull, most);
    let beyond = graph.multiply(left, excess);
    let signed = graph.multiply(sign, beyond);
    let passed = graph.add(x, signed);
    graph.select(Comparison::Less, [along, earliest], [passed, clipped])
}
