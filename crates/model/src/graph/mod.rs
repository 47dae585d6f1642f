//! Computations as graphs of shared nodes.
//!
//! Nodes lie in the order of their making, so that operands precede the nodes that use them, and equal nodes are one node. The
//! right-hand sides of a model, a whole integration step and its derivatives are graphs; the interpreter and the shaders
//! are made from them.

mod build;
mod derivative;
mod evaluate;
mod node;
mod store;
mod substitute;
mod sums;

pub use derivative::Direction;
pub use evaluate::evaluate;
pub(crate) use node::{Binary, Comparison, Node};
pub use node::{Id, Leaf, Unary};
pub use store::Graph;
pub(crate) use substitute::Substitution;
