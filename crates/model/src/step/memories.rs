//! Operations with a memory of earlier samples, and leaves of graphs by their numbers.

use crate::graph::{Graph, Id, Leaf};

/// An operation with a memory of earlier samples.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Memory {
    /// The operation.
    pub kind: MemoryKind,
    /// The operands; for a derivative they alternate with their derivatives.
    pub operands: Vec<Id>,
    /// The part of the step for which it is computed.
    pub substep: Substep,
}

impl Memory {
    /// Returns an operation over the whole step.
    pub(crate) fn whole(kind: MemoryKind, operands: Vec<Id>) -> Self {
        Self { kind, operands, substep: Substep::WHOLE }
    }
}

/// A part of a step: its place among equal parts, and their number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Substep {
    /// Place of the part, from 0.
    pub place: u16,
    /// Number of equal parts of the step.
    pub of: u16,
}

impl Substep {
    /// The whole step.
    pub const WHOLE: Self = Self { place: 0, of: 1 };

    /// Returns a part of a step that has no more than 2¹⁶ of them.
    pub fn new(place: usize, of: usize) -> Self {
        let [place, of] = [place, of].map(|number| u16::try_from(number).unwrap_or(u16::MAX));
        Self { place, of }
    }
}

/// A kind of operation with a memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MemoryKind {
    /// The mean over a substep of a signal with a delay and a latency.
    Delay,
    /// The derivative of a delay.
    DelayRate,
    /// The moving average of a signal over a number of samples.
    Average,
    /// The derivative of a moving average.
    AverageRate,
}

/// Returns the leaf of an operation with a memory.
pub(super) fn memory(graph: &mut Graph, number: usize) -> Id {
    graph.leaf(Leaf::Memory(u16::try_from(number).unwrap_or(u16::MAX)))
}

/// Returns a leaf for the parameter with a number.
pub(super) fn parameter(graph: &mut Graph, number: usize) -> Id {
    graph.leaf(Leaf::Parameter(u16::try_from(number).unwrap_or(u16::MAX)))
}
