//! The effect of a reaction on other states within a step, where the equations are not affine.
//!
//! A unit of a reaction that acts with Γ changes the states over a step by `h Γ + h²/2 J Γ`, up to the third order in h, with the Jacobian
//! J anywhere in the step. The affine part of J is in the gains to higher order; here is that of the other terms, at the start of the
//! step, with the inputs and Γ there: `h²/2 J Γ / (1 + h/2 max(0, −tr J))`. The denominator is of the next order, and exact for a stiff J of rank
//! one, such as damping in contact (J. Sherman, W. J. Morrison 1950), so that gains keep their sign.

use super::affine::Affine;
use super::right_hand_sides::{InputsAt, right_hand_sides};
use crate::graph::{Binary, Direction, Graph, Id, Leaf};

/// States and inputs at one end of a step.
#[derive(Clone, Copy)]
pub(super) struct StepEnd<'a> {
    pub states: &'a [Id],
    pub inputs: &'a InputsAt,
}

/// Adds to the gains of reactions, shape `[reactions, states]`, what terms that are not affine add over a step of length `step`. `begin`
/// are states and inputs at its start.
pub(super) fn add_coupling(graph: &mut Graph, affine: &Affine, begin: StepEnd<'_>, step: Id, gains: &mut [Vec<Id>]) {
    let half_value = graph.constant(0.5);
    let half = graph.multiply(half_value, step);
    let mut damping = None;
    for (gain, reaction) in gains.iter_mut().zip(&affine.reactions) {
        let change = along(graph, &affine.rest, |n| reaction.get(n).copied());
        if change.iter().all(|change| graph.is_constant(*change, 0.0)) {
            continue;
        }
        let bound = *damping.get_or_insert_with(|| denominator(graph, affine, begin, half));
        let change = right_hand_sides(graph, &change, begin.states, begin.inputs);
        let area = graph.multiply(half, step);
        for (gain, change) in gain.iter_mut().zip(change) {
            let change = graph.multiply(area, change);
            let change = graph.divide(change, bound);
            *gain = graph.add(*gain, change);
        }
    }
}

/// Returns `1 + h/2 max(0, −tr J)` at the start of a step.
fn denominator(graph: &mut Graph, affine: &Affine, begin: StepEnd<'_>, half: Id) -> Id {
    let [zero, one] = [0.0, 1.0].map(|value| graph.constant(value));
    let mut trace = zero;
    for (state, rest) in affine.rest.iter().enumerate() {
        let own = along(graph, &[*rest], |n| (n == state).then_some(one));
        trace = graph.add(trace, own[0]);
    }
    let trace = right_hand_sides(graph, &[trace], begin.states, begin.inputs)[0];
    let damping = graph.negative(trace);
    let damping = graph.binary(Binary::Max, damping, zero);
    let damping = graph.multiply(half, damping);
    graph.add(one, damping)
}

/// Returns the derivatives of nodes in the direction in which each state changes at the given rate.
fn along(graph: &mut Graph, of: &[Id], rate: impl Fn(usize) -> Option<Id>) -> Vec<Id> {
    let mut direction = Direction::new(|leaf| match leaf {
        Leaf::State(n) => rate(usize::from(n)),
        _ => None,
    });
    of.iter().map(|node| direction.derivative(graph, *node)).collect()
}
