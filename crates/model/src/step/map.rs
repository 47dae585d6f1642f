//! The one-step map of a model as a graph.

use super::extras::Extras;
use super::memories::Memory;
use crate::graph::{Graph, Id};

/// A step as a graph, with what the evaluation needs beside it.
#[derive(Debug, Clone)]
pub struct Step {
    /// The graph of all nodes below.
    pub graph: Graph,
    /// States at the end of the step.
    pub next: Vec<Id>,
    /// Intermediate states in the order in which they are computed.
    pub milestones: Vec<Id>,
    /// Outputs at the start of the step.
    pub outputs: Vec<Id>,
    /// Operations with a memory, by the numbers of their leaves.
    pub memories: Vec<Memory>,
    /// Initial values of the states.
    pub initial: Vec<Id>,
    /// Matrices whose exponentials are further parameters; `None` if the method has none.
    pub extras: Option<Extras>,
    /// Number of parameters of the model with its free initial states; those of `extras` follow.
    pub parameters: usize,
}
