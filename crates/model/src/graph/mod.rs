//! Computations as graphs of shared nodes.
//!
//! Nodes lie in the order of their making, so that operands precede the nodes that use them, and equal nodes are one node. The
//! right-hand sides of a model, a whole integration step and its derivatives are graphs; the interpreter and the shaders
//! are made from them.

mod build;
mod derivative;
mod evaluate;
mod substitute;
mod sums;

pub use derivative::Direction;
pub use evaluate::evaluate;
pub(crate) use substitute::Substitution;

use std::collections::HashMap;

/// Index of a node.
pub type Id = u32;

/// A value that a computation is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Leaf {
    /// A parameter, constant for a candidate.
    Parameter(u16),
    /// An input at the start of the step.
    Input(u16),
    /// An input at the end of the step.
    NextInput(u16),
    /// A state at the start of the step.
    State(u16),
    /// The reaction of a `stick`, constant over a step.
    Reaction(u16),
    /// The result of an operation with a memory: a delayed signal, a moving average, or the derivative of one.
    Memory(u16),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Unary {
    Negative,
    Reciprocal,
    Sin,
    Cos,
    Tan,
    Exp,
    Log,
    Sqrt,
    Abs,
    Sign,
    Tanh,
    Atan,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Min,
    Max,
    Atan2,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Comparison {
    Less,
    LessEqual,
}

/// A node; constants are kept by their bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Node {
    Constant(u64),
    Leaf(Leaf),
    Unary(Unary, Id),
    Binary(Binary, Id, Id),
    /// The third operand if the comparison of the first two holds, else the fourth.
    Select(Comparison, [Id; 4]),
}

/// Kinds of leaves that a node depends on, as bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Dependency(u8);

impl Dependency {
    pub const NONE: Self = Self(0);
    pub const PARAMETERS: Self = Self(1);
    pub const INPUTS: Self = Self(2);
    pub const STATES: Self = Self(4);

    pub fn has(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    fn of(leaf: Leaf) -> Self {
        match leaf {
            Leaf::Parameter(_) => Self::PARAMETERS,
            Leaf::Input(_) | Leaf::NextInput(_) => Self::INPUTS,
            Leaf::State(_) | Leaf::Reaction(_) | Leaf::Memory(_) => Self::STATES,
        }
    }
}

/// A graph of nodes.
#[derive(Debug, Clone, Default)]
pub struct Graph {
    nodes: Vec<Node>,
    dependencies: Vec<Dependency>,
    known: HashMap<Node, Id>,
}

impl Graph {
    /// Returns the number of nodes.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Returns a node.
    pub fn node(&self, id: Id) -> Node {
        self.nodes[id as usize]
    }

    /// Returns the kinds of leaves that a node depends on.
    pub fn dependency(&self, id: Id) -> Dependency {
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
    fn add_node(&mut self, node: Node) -> Id {
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
