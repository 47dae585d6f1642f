//! Making of nodes, with simplification.
//!
//! Constants are folded; zeros, ones and signs are removed. Factors of parameters alone are collected in front of a product, and
//! division by a parameter becomes multiplication by its reciprocal, so that both are computed once for a candidate. Signs move out
//! of products and into sums, never back: each rule makes nodes from operands only, so that no sequence of rules can repeat.

use super::evaluate::{binary, unary};
use super::node::{Binary, Comparison, Id, Leaf, Node, Unary};
use super::store::Graph;

/// Largest integer exponent that is computed by products.
const PRODUCT_MAX: f64 = 16.0;

impl Graph {
    /// Returns the constant with a value; −0 and 0 are one node.
    pub fn constant(&mut self, value: f64) -> Id {
        // −0 and 0 are one constant.
        self.add_node(Node::Constant((value + 0.0).to_bits()))
    }

    /// Returns the node of a leaf.
    pub fn leaf(&mut self, leaf: Leaf) -> Id {
        self.add_node(Node::Leaf(leaf))
    }

    /// Returns true if a node is the constant with a value.
    pub fn is_constant(&self, id: Id, value: f64) -> bool {
        self.value(id).is_some_and(|own| own.to_bits() == value.to_bits())
    }

    fn negated(&self, id: Id) -> Option<Id> {
        match self.node(id) {
            Node::Unary(Unary::Negative, inner) => Some(inner),
            _ => None,
        }
    }

    /// Returns the sum `a + b`.
    pub fn add(&mut self, a: Id, b: Id) -> Id {
        if let (Some(x), Some(y)) = (self.value(a), self.value(b)) {
            return self.constant(x + y);
        }
        if self.is_constant(a, 0.0) {
            return b;
        }
        if self.is_constant(b, 0.0) {
            return a;
        }
        match (self.negated(a), self.negated(b)) {
            (_, Some(b)) => self.subtract(a, b),
            (Some(a), None) => self.subtract(b, a),
            _ => self.add_node(Node::Binary(Binary::Add, a.min(b), a.max(b))),
        }
    }

    /// Returns the difference `a − b`.
    pub fn subtract(&mut self, a: Id, b: Id) -> Id {
        if let (Some(x), Some(y)) = (self.value(a), self.value(b)) {
            return self.constant(x - y);
        }
        if self.is_constant(b, 0.0) {
            return a;
        }
        if a == b {
            return self.constant(0.0);
        }
        if self.is_constant(a, 0.0) {
            return self.negative(b);
        }
        match self.negated(b) {
            Some(b) => self.add(a, b),
            None => self.add_node(Node::Binary(Binary::Subtract, a, b)),
        }
    }

    /// Returns `−a`.
    pub fn negative(&mut self, a: Id) -> Id {
        if let Some(x) = self.value(a) {
            return self.constant(-x);
        }
        match self.node(a) {
            Node::Unary(Unary::Negative, inner) => inner,
            Node::Binary(Binary::Subtract, x, y) => self.subtract(y, x),
            _ => self.add_node(Node::Unary(Unary::Negative, a)),
        }
    }

    /// Returns the factor of parameters alone and the other factor of a product, where the node has them.
    fn factors(&self, id: Id) -> (Option<Id>, Option<Id>) {
        if self.is_fixed(id) {
            return (Some(id), None);
        }
        match self.node(id) {
            Node::Binary(Binary::Multiply, x, y) if self.is_fixed(x) => (Some(x), Some(y)),
            Node::Binary(Binary::Multiply, x, y) if self.is_fixed(y) => (Some(y), Some(x)),
            _ => (None, Some(id)),
        }
    }

    /// Returns the product `a b`; factors of parameters alone are collected in front.
    pub fn multiply(&mut self, a: Id, b: Id) -> Id {
        match (self.negated(a), self.negated(b)) {
            (Some(a), Some(b)) => return self.multiply(a, b),
            (Some(inner), None) => {
                let product = self.multiply(inner, b);
                return self.negative(product);
            }
            (None, Some(inner)) => {
                let product = self.multiply(a, inner);
                return self.negative(product);
            }
            (None, None) => {}
        }
        if self.is_fixed(a) && self.is_fixed(b) {
            return self.product(a, b);
        }
        let ((p, x), (q, y)) = (self.factors(a), self.factors(b));
        let join = |graph: &mut Self, a: Option<Id>, b: Option<Id>| match (a, b) {
            (Some(a), Some(b)) => Some(graph.product(a, b)),
            (one, other) => one.or(other),
        };
        match (join(self, p, q), join(self, x, y)) {
            (Some(factor), Some(rest)) => self.product(factor, rest),
            (one, other) => one.or(other).unwrap_or(a),
        }
    }

    /// Returns the product of two nodes as they are.
    fn product(&mut self, a: Id, b: Id) -> Id {
        if let (Some(x), Some(y)) = (self.value(a), self.value(b)) {
            return self.constant(x * y);
        }
        for (x, y) in [(a, b), (b, a)] {
            if self.is_constant(x, 0.0) || self.is_constant(y, 1.0) {
                return x;
            }
            if self.is_constant(y, -1.0) {
                return self.negative(x);
            }
        }
        self.add_node(Node::Binary(Binary::Multiply, a.min(b), a.max(b)))
    }

    /// Returns the quotient `a / b`.
    pub fn divide(&mut self, a: Id, b: Id) -> Id {
        if let (Some(x), Some(y)) = (self.value(a), self.value(b)) {
            return self.constant(x / y);
        }
        if self.is_constant(a, 0.0) || self.is_constant(b, 1.0) {
            return a;
        }
        if let Some(inner) = self.negated(a) {
            let quotient = self.divide(inner, b);
            return self.negative(quotient);
        }
        if self.is_constant(a, 1.0) || (self.is_fixed(b) && !self.is_fixed(a)) || self.value(b).is_some() {
            let reciprocal = self.unary(Unary::Reciprocal, b);
            return self.multiply(a, reciprocal);
        }
        self.add_node(Node::Binary(Binary::Divide, a, b))
    }

    /// Returns an operator of one operand applied to `a`.
    pub fn unary(&mut self, operator: Unary, a: Id) -> Id {
        if operator == Unary::Negative {
            return self.negative(a);
        }
        if let Some(x) = self.value(a) {
            return self.constant(unary(operator, x));
        }
        match (operator, self.node(a)) {
            (Unary::Reciprocal, Node::Unary(Unary::Reciprocal, inner)) => inner,
            _ => self.add_node(Node::Unary(operator, a)),
        }
    }

    /// Returns an operator of two operands applied to `a` and `b`.
    pub(crate) fn binary(&mut self, operator: Binary, a: Id, b: Id) -> Id {
        match operator {
            Binary::Add => self.add(a, b),
            Binary::Subtract => self.subtract(a, b),
            Binary::Multiply => self.multiply(a, b),
            Binary::Divide => self.divide(a, b),
            Binary::Power => self.power(a, b),
            Binary::Min | Binary::Max | Binary::Atan2 => match (self.value(a), self.value(b)) {
                (Some(x), Some(y)) => self.constant(binary(operator, x, y)),
                _ if a == b && operator != Binary::Atan2 => a,
                _ => self.add_node(Node::Binary(operator, a, b)),
            },
        }
    }

    /// Returns a power; small integer exponents become products.
    pub fn power(&mut self, base: Id, exponent: Id) -> Id {
        if let (Some(x), Some(y)) = (self.value(base), self.value(exponent)) {
            return self.constant(binary(Binary::Power, x, y));
        }
        match self.value(exponent) {
            Some(0.5) => self.unary(Unary::Sqrt, base),
            Some(exponent) if exponent.fract() == 0.0 && exponent.abs() <= PRODUCT_MAX => {
                let power = self.integer_power(base, motorfit_core::numeric::whole(exponent.abs()));
                if exponent < 0.0 { self.unary(Unary::Reciprocal, power) } else { power }
            }
            _ => self.add_node(Node::Binary(Binary::Power, base, exponent)),
        }
    }

    fn integer_power(&mut self, base: Id, exponent: usize) -> Id {
        match exponent {
            0 => self.constant(1.0),
            1 => base,
            _ => {
                let half = self.integer_power(base, exponent / 2);
                let square = self.multiply(half, half);
                if exponent % 2 == 1 { self.multiply(square, base) } else { square }
            }
        }
    }

    /// Returns `then` if the comparison of `a` and `b` holds, else `otherwise`.
    pub(crate) fn select(&mut self, comparison: Comparison, [a, b]: [Id; 2], [then, otherwise]: [Id; 2]) -> Id {
        if let (Some(x), Some(y)) = (self.value(a), self.value(b)) {
            return if comparison.holds(x, y) { then } else { otherwise };
        }
        if then == otherwise {
            return then;
        }
        self.add_node(Node::Select(comparison, [a, b, then, otherwise]))
    }
}
