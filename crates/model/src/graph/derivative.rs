//! Derivatives of nodes in a direction.
//!
//! At a kink (`abs`, `min`, `select`, …) the derivative is that of the branch which the value takes. Where a derivative is not
//! finite (`sqrt` at 0) it is taken as zero if the direction is zero there.

use super::node::{Binary, Comparison, Id, Leaf, Node, Unary};
use super::store::Graph;
use std::collections::HashMap;

/// Derivatives in the direction in which each leaf changes at the given rate; nodes are differentiated once.
pub struct Direction<F: Fn(Leaf) -> Option<Id>> {
    /// Returns the rate of a leaf; `None` if it is constant.
    rate: F,
    known: HashMap<Id, Id>,
}

impl<F: Fn(Leaf) -> Option<Id>> Direction<F> {
    /// Creates a direction from the rate of each leaf; `None` for a constant leaf.
    pub fn new(rate: F) -> Self {
        Self { rate, known: HashMap::new() }
    }

    /// Returns the derivative of a node.
    pub fn derivative(&mut self, graph: &mut Graph, root: Id) -> Id {
        for id in graph.needed(&[root]) {
            if !self.known.contains_key(&id) {
                let derivative = self.of_node(graph, id);
                self.known.insert(id, derivative);
            }
        }
        self.known[&root]
    }

    fn of_node(&self, graph: &mut Graph, id: Id) -> Id {
        let zero = graph.constant(0.0);
        let of = |id: Id| self.known[&id];
        match graph.node(id) {
            Node::Constant(_) => zero,
            Node::Leaf(leaf) => (self.rate)(leaf).unwrap_or(zero),
            Node::Unary(_, a) if of(a) == zero => zero,
            Node::Unary(operator, a) => unary(graph, operator, [id, a], of(a)),
            Node::Binary(_, a, b) if of(a) == zero && of(b) == zero => zero,
            Node::Binary(operator, a, b) => binary(graph, operator, [id, a, b], [of(a), of(b)]),
            Node::Select(comparison, [a, b, then, otherwise]) => {
                graph.select(comparison, [a, b], [of(then), of(otherwise)])
            }
        }
    }
}

/// Returns the derivative of the node `id` with the operand `a`, which changes at the rate `rate`.
fn unary(graph: &mut Graph, operator: Unary, [id, a]: [Id; 2], rate: Id) -> Id {
    let [zero, one] = [0.0, 1.0].map(|value| graph.constant(value));
    let factor = match operator {
        Unary::Negative => return graph.negative(rate),
        Unary::Sign => return zero,
        Unary::Reciprocal => {
            let square = graph.multiply(id, id);
            graph.negative(square)
        }
        Unary::Sin => graph.unary(Unary::Cos, a),
        Unary::Cos => {
            let sine = graph.unary(Unary::Sin, a);
            graph.negative(sine)
        }
        Unary::Tan => {
            let square = graph.multiply(id, id);
            graph.add(one, square)
        }
        Unary::Exp => id,
        Unary::Log => graph.unary(Unary::Reciprocal, a),
        Unary::Sqrt => {
            let half = graph.constant(0.5);
            let factor = graph.divide(half, id);
            let product = graph.multiply(factor, rate);
            return graph.select(Comparison::Less, [zero, id], [product, zero]);
        }
        Unary::Abs => graph.unary(Unary::Sign, a),
        Unary::Tanh => {
            let square = graph.multiply(id, id);
            graph.subtract(one, square)
        }
        Unary::Atan => {
            let square = graph.multiply(a, a);
            let sum = graph.add(one, square);
            graph.unary(Unary::Reciprocal, sum)
        }
    };
    graph.multiply(factor, rate)
}

/// Returns the derivative of the node `id` with the operands `a` and `b`, which change at the given rates.
fn binary(graph: &mut Graph, operator: Binary, [id, a, b]: [Id; 3], [of_a, of_b]: [Id; 2]) -> Id {
    let zero = graph.constant(0.0);
    match operator {
        Binary::Add => graph.add(of_a, of_b),
        Binary::Subtract => graph.subtract(of_a, of_b),
        Binary::Multiply => {
            let (first, second) = (graph.multiply(of_a, b), graph.multiply(a, of_b));
            graph.add(first, second)
        }
        Binary::Divide => {
            let change = graph.multiply(id, of_b);
            let change = graph.subtract(of_a, change);
            graph.divide(change, b)
        }
        Binary::Min => graph.select(Comparison::Less, [a, b], [of_a, of_b]),
        Binary::Max => graph.select(Comparison::Less, [b, a], [of_a, of_b]),
        Binary::Atan2 => {
            let (first, second) = (graph.multiply(b, of_a), graph.multiply(a, of_b));
            let change = graph.subtract(first, second);
            let (first, second) = (graph.multiply(a, a), graph.multiply(b, b));
            let square = graph.add(first, second);
            let quotient = graph.divide(change, square);
            graph.select(Comparison::Less, [zero, square], [quotient, zero])
        }
        Binary::Power => {
            // d(a^b) = a^b (b a'/a + b' log a), where a is positive.
            let relative = graph.divide(of_a, a);
            let mut sum = graph.multiply(b, relative);
            if of_b != zero {
                let logarithm = graph.unary(Unary::Log, a);
                let more = graph.multiply(logarithm, of_b);
                sum = graph.add(sum, more);
            }
            let derivative = graph.multiply(id, sum);
            graph.select(Comparison::Less, [zero, a], [derivative, zero])
        }
    }
}
