//! A graph of nodes, stored in the order in which they were created.

use super::node::{Dependency, Id, Leaf, Node};
use std::collections::HashMap;

/// A graph of nodes.
#[derive(Debug, Clone, Default)]
pub struct Graph {
    pub(super) nodes: Vec<Node>,
    dependencies: Vec<Dependency>,
    known: HashMap<Node, Id>,
}

impl Graph {
    /// Returns the number of nodes.
    pub(crate) fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Returns a node.
    pub(crate) fn node(&self, id: Id) -> Node {
        self.nodes[id as usize]
    }

    /// Returns the kinds of leaves that a node depends on.
    pub(crate) fn dependency(&self, id: Id) -> Dependency {
        self.dependencies[id as usize]
    }

    /// Returns true if a node depends on parameters at most: it is computed once for a candidate.
    pub fn is_fixed(&self, id: Id) -> bool {
        !self.dependency(id).has(Dependency::INPUTS.with(Dependency::STATES))
    }

    /// Returns true if a node has another value for each candidate.
    pub fn is_of_candidate(&self, id: Id) -> bool {
        self.dependency(id).has(Dependency::PARAMETERS.with(Dependency::STATES))
    }

    /// Returns the value of a constant.
    pub fn value(&self, id: Id) -> Option<f64> {
        match self.node(id) {
            Node::Constant(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    /// Returns the operands of a node.
    pub fn operands(&self, id: Id) -> impl Iterator<Item = Id> + use<> {
        let (operands, count) = match self.node(id) {
            Node::Constant(_) | Node::Leaf(_) => ([0; 4], 0),
            Node::Unary(_, a) => ([a, 0, 0, 0], 1),
            Node::Binary(_, a, b) => ([a, b, 0, 0], 2),
            Node::Select(_, of) => (of, 4),
        };
        operands.into_iter().take(count)
    }

    /// Returns the nodes that the roots need, in increasing order.
    pub fn needed(&self, roots: &[Id]) -> Vec<Id> {
        let mut is_needed = vec![false; self.len()];
        let mut open: Vec<Id> = roots.to_vec();
        while let Some(id) = open.pop() {
            if !std::mem::replace(&mut is_needed[id as usize], true) {
                open.extend(self.operands(id));
            }
        }
        (0..).zip(is_needed).filter_map(|(id, is_needed)| is_needed.then_some(id)).collect()
    }

    /// Returns for each node how often the roots and the nodes that they need use it.
    pub fn uses(&self, roots: &[Id]) -> Vec<u32> {
        let mut uses = vec![0; self.len()];
        roots.iter().for_each(|root| uses[*root as usize] += 1);
        for id in self.needed(roots) {
            self.operands(id).for_each(|operand| uses[operand as usize] += 1);
        }
        uses
    }

    /// Returns the leaves that the roots need.
    pub fn leaves(&self, roots: &[Id]) -> Vec<Leaf> {
        let leaf = |id| match self.node(id) {
            Node::Leaf(leaf) => Some(leaf),
            _ => None,
        };
        self.needed(roots).into_iter().filter_map(leaf).collect()
    }

    /// Returns a graph of the nodes that the roots need, and the roots in it.
    pub fn extract(&self, roots: &[Id]) -> (Self, Vec<Id>) {
        let mut own = Self::default();
        let mut place: HashMap<Id, Id> = HashMap::new();
        for id in self.needed(roots) {
            let of = |id: Id| place[&id];
            let node = match self.node(id) {
                Node::Unary(operator, a) => Node::Unary(operator, of(a)),
                Node::Binary(operator, a, b) => Node::Binary(operator, of(a), of(b)),
                Node::Select(comparison, operands) => Node::Select(comparison, operands.map(of)),
                leaf => leaf,
            };
            let copied = own.add_node(node);
            place.insert(id, copied);
        }
        let roots = roots.iter().map(|id| place[id]).collect();
        (own, roots)
    }

    /// Returns the id of a node, which is added if it is new.
    pub(crate) fn add_node(&mut self, node: Node) -> Id {
        if let Some(id) = self.known.get(&node) {
            return *id;
        }
        // The limit of nodes of a model is far below that of an id.
        let id = Id::try_from(self.nodes.len()).unwrap_or(Id::MAX);
        self.nodes.push(node);
        let own = match node {
            Node::Leaf(leaf) => Dependency::of(leaf),
            _ => Dependency::NONE,
        };
        let dependency = self.operands(id).fold(own, |all, operand| all.with(self.dependency(operand)));
        self.dependencies.push(dependency);
        self.known.insert(node, id);
        id
    }
}
