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

/// A part of a step: its place among equal parts, and their number; or the instant at its start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Substep {
    /// Place of the part, from 0.
    pub place: u16,
    /// Number of equal parts of the step; 0 for the instant at its start.
    pub of: u16,
}

impl Substep {
    /// The whole step.
    pub const WHOLE: Self = Self { place: 0, of: 1 };
    /// The instant at the start of the step.
    pub const INSTANT: Self = Self { place: 0, of: 0 };
    /// Part of a step, as its reciprocal, over which a zero-order hold moves from one value to the next where it is taken at an instant.
    ///
    /// It keeps the cost continuous in the delay, also in single precision. The move begins at the jump, so that a delay of whole steps
    /// has exactly its sample.
    pub const JUMP: u16 = 1000;

    /// Returns a part of a step that has no more than 2¹⁶ of them.
    pub fn new(place: usize, of: usize) -> Self {
        let [place, of] = [place, of].map(|number| u16::try_from(number).unwrap_or(u16::MAX));
        Self { place, of }
    }
}

/// A kind of operation with a memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MemoryKind {
    /// The mean over a substep, or the value at an instant, of a signal with a delay and a latency, which is constant over each step.
    Delay,
    /// The derivative of a delay.
    DelayRate,
    /// The same of a signal that is linear over each step; its value at the end of the step is the last operand.
    LinearDelay,
    /// The derivative of a delay of a signal that is linear over each step.
    LinearDelayRate,
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
