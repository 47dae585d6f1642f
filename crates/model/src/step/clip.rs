//! One reaction over a step; formulas: `motor/friction.rs`.

use crate::graph::{Binary, Comparison, Graph, Id, Unary};

/// Returns a value within ±`most`.
pub(super) fn clip(graph: &mut Graph, x: Id, most: Id) -> Id {
    let least = graph.negative(most);
    let above = graph.binary(Binary::Max, x, least);
    graph.binary(Binary::Min, above, most)
}

/// Returns what a reaction subtracts from its state, `before` at the start of the step and `x` at its end without the reaction.
pub(super) fn taken(graph: &mut Graph, before: Id, x: Id, most: Id) -> Id {
    let clipped = clip(graph, x, most);
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
