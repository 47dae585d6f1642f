//! Set-valued reactions at the end of a step.
//!
//! A unit of a reaction that is constant over a step changes the states by its gain g. The reaction takes the value within ±limit
//! that brings its own state to zero: it subtracts `δ = clamp(x, −limit |g_own|, limit |g_own|)` from its own state and
//! `(g_other/g_own) δ` from the others, so that a state at rest is exactly zero. Reactions act in the order of their states.

use super::runge_kutta::right_hand_sides;
use crate::model::Model;
use crate::model::graph::{Binary, Graph, Id, Unary};

/// Returns the states after the reactions. `begin` are states and inputs at the start of the step, at which limits are computed,
/// `free` the states at its end without reactions.
pub(super) fn react(
    graph: &mut Graph,
    model: &Model,
    begin: (&[Id], &[Id]),
    mut free: Vec<Id>,
    gains: &[Vec<Id>],
) -> Vec<Id> {
    let mut order: Vec<usize> = (0..model.reactions.len()).collect();
    order.sort_by_key(|n| model.reactions[*n].state);
    for n in order {
        let (reaction, gain) = (&model.reactions[n], &gains[n]);
        let own = gain[reaction.state];
        let limit = right_hand_sides(graph, &[reaction.limit], begin.0, begin.1)[0];
        let size = graph.unary(Unary::Abs, own);
        let most = graph.multiply(limit, size);
        let least = graph.negative(most);
        let above = graph.binary(Binary::Max, free[reaction.state], least);
        let taken = graph.binary(Binary::Min, above, most);
        for (state, x) in free.iter_mut().enumerate() {
            let part = match state == reaction.state {
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
