//! Evaluation of nodes for one candidate: the meaning of each operation, from which the other back ends are checked.

use super::node::{Binary, Comparison, Id, Leaf, Node, Unary};
use super::store::Graph;

impl Comparison {
    pub fn holds(self, a: f64, b: f64) -> bool {
        match self {
            Self::Less => a < b,
            Self::LessEqual => a <= b,
        }
    }
}

/// Returns the value of an operation with one operand.
pub(super) fn unary(operator: Unary, x: f64) -> f64 {
    match operator {
        Unary::Negative => -x,
        Unary::Reciprocal => 1.0 / x,
        Unary::Sin => libm::sin(x),
        Unary::Cos => libm::cos(x),
        Unary::Tan => libm::tan(x),
        Unary::Exp => libm::exp(x),
        Unary::Log => libm::log(x),
        Unary::Sqrt => x.sqrt(),
        Unary::Abs => x.abs(),
        Unary::Sign if x > 0.0 => 1.0,
        Unary::Sign if x < 0.0 => -1.0,
        Unary::Sign => x * 0.0,
        Unary::Tanh => libm::tanh(x),
        Unary::Atan => libm::atan(x),
    }
}

/// Returns the value of an operation with two operands. Like those of shaders, minimum and maximum return the second operand if
/// the first is NaN.
pub(super) fn binary(operator: Binary, x: f64, y: f64) -> f64 {
    match operator {
        Binary::Add => x + y,
        Binary::Subtract => x - y,
        Binary::Multiply => x * y,
        Binary::Divide => x / y,
        Binary::Power => libm::pow(x, y),
        Binary::Min => {
            if x < y {
                x
            } else {
                y
            }
        }
        Binary::Max => {
            if x > y {
                x
            } else {
                y
            }
        }
        Binary::Atan2 => libm::atan2(x, y),
    }
}

/// Returns the values of `roots`; `leaf` gives those of the leaves. `values` is working memory.
pub fn evaluate(graph: &Graph, roots: &[Id], values: &mut Vec<f64>, leaf: &impl Fn(Leaf) -> f64) -> Vec<f64> {
    let end = roots.iter().max().map_or(0, |last| *last as usize + 1);
    values.clear();
    for node in &graph.nodes[..end] {
        let at = |id: Id| values[id as usize];
        let value = match *node {
            Node::Constant(bits) => f64::from_bits(bits),
            Node::Leaf(of) => leaf(of),
            Node::Unary(operator, a) => unary(operator, at(a)),
            Node::Binary(operator, a, b) => binary(operator, at(a), at(b)),
            Node::Select(comparison, [a, b, then, otherwise]) => {
                at(if comparison.holds(at(a), at(b)) { then } else { otherwise })
            }
        };
        values.push(value);
    }
    roots.iter().map(|root| values[*root as usize]).collect()
}
