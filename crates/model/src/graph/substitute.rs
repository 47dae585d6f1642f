//! Substitution of leaves by nodes.

use super::node::{Id, Leaf, Node};
use super::store::Graph;
use std::collections::HashMap;

/// Replaces leaves by nodes in any number of computations, which keep sharing their nodes.
pub(crate) struct Substitution<F: Fn(Leaf) -> Option<Id>> {
    /// Returns the node that replaces a leaf; `None` keeps it.
    with: F,
    known: HashMap<Id, Id>,
}

impl<F: Fn(Leaf) -> Option<Id>> Substitution<F> {
    pub fn new(with: F) -> Self {
        Self { with, known: HashMap::new() }
    }

    /// Replaces a node in what is computed from now on.
    pub fn replace(&mut self, node: Id, by: Id) {
        self.known.insert(node, by);
    }

    /// Returns a node with its leaves replaced.
    pub fn apply(&mut self, graph: &mut Graph, root: Id) -> Id {
        // In the order of the ids, which is topological, so that no recursion is needed.
        for id in graph.needed(&[root]) {
            if !self.known.contains_key(&id) {
                let replaced = self.replaced(graph, id);
                self.known.insert(id, replaced);
            }
        }
        self.known[&root]
    }

    fn replaced(&self, graph: &mut Graph, id: Id) -> Id {
        let of = |id: Id| self.known[&id];
        match graph.node(id) {
            Node::Constant(_) => id,
            Node::Leaf(leaf) => (self.with)(leaf).unwrap_or(id),
            Node::Unary(operator, a) => graph.unary(operator, of(a)),
            Node::Binary(operator, a, b) => graph.binary(operator, of(a), of(b)),
            Node::Select(comparison, operands) => {
                let [a, b, then, otherwise] = operands.map(of);
                graph.select(comparison, [a, b], [then, otherwise])
            }
        }
    }
}
