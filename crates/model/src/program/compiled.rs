//! A compiled computation.

use super::instruction::Instruction;
use crate::graph::{Graph, Id};

/// A compiled computation.
#[derive(Debug, Clone, Default)]
pub struct Program {
    /// Registers that hold parameters, with the numbers of the parameters.
    pub parameters: Vec<(u16, u16)>,
    /// Executed once.
    pub setup: Vec<Instruction>,
    /// Executed for each sample, or once if there are no samples.
    pub body: Vec<Instruction>,
    /// Registers of the states, with those of their initial values.
    pub states: Vec<(u16, u16)>,
    /// Registers of results that are read after the setup.
    pub results: Vec<u16>,
    /// Number of registers.
    pub registers: usize,
    /// Number of outputs.
    pub outputs: usize,
    /// Number of memories.
    pub memories: usize,
    /// Scalars: first these constants, then the uniforms of the sample.
    pub constants: Vec<f64>,
    /// The computation of the uniforms from the inputs.
    pub uniforms: Uniforms,
}

impl Program {
    /// Returns the operations per lane and sample, a fused one as one.
    pub fn work(&self) -> usize {
        self.body.iter().map(|instruction| instruction.operation.work()).sum()
    }
}

/// Scalars that are computed from the inputs of a sample.
#[derive(Debug, Clone, Default)]
pub struct Uniforms {
    /// The computation, whose leaves are inputs.
    pub graph: Graph,
    /// The node of each scalar.
    pub roots: Vec<Id>,
}
