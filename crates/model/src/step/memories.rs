//! Operations with a memory of earlier samples, and leaves of graphs by their numbers.

use crate::graph::{Graph, Id, Leaf};

/// An operation with a memory of earlier samples.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Memory {
    /// The operation.
    pub kind: MemoryKind,
    /// True for the derivative of the operation.
    pub is_rate: bool,
    /// The operands; for a derivative they alternate with their derivatives.
    pub operands: Vec<Id>,
    /// The part of the step for which it is computed.
    pub substep: Substep,
    /// Number of the operation whose memory it uses; `None` for its own.
    pub shared: Option<usize>,
}

impl Memory {
    /// Returns an operation over the whole step.
    pub(crate) fn whole(kind: MemoryKind, operands: Vec<Id>) -> Self {
        Self { kind, is_rate: false, operands, substep: Substep::WHOLE, shared: None }
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
    /// The same of a signal that is linear over each step; its value at the end of the step is the last operand.
    LinearDelay,
    /// The moving average of a signal over a number of samples.
    Average,
    /// The value that a sensor shows at the start of a step, of a signal with a filter and a delay. Its past is that of the operations
    /// `Track` or `SmoothTrack`, which share its memory.
    Sensor,
    /// Adds a substep to the past of a sensor: the signal at its start and end, between which it is linear, and the filter. It has no value.
    Track,
    /// The same of a signal that is quadratic over the substep, by its value and slope at the start and its value at the end.
    SmoothTrack,
}

impl MemoryKind {
    /// Returns the number of operands, without their derivatives.
    pub(crate) fn operands(self) -> usize {
        match self {
            Self::Average => 2,
            Self::Delay | Self::Sensor | Self::Track => 3,
            Self::LinearDelay | Self::SmoothTrack => 4,
        }
    }
}

/// Returns the leaf of an operation with a memory.
pub(super) fn memory(graph: &mut Graph, number: usize) -> Id {
    graph.leaf(Leaf::Memory(u16::try_from(number).unwrap_or(u16::MAX)))
}

/// Returns a leaf for the parameter with a number.
pub(super) fn parameter(graph: &mut Graph, number: usize) -> Id {
    graph.leaf(Leaf::Parameter(u16::try_from(number).unwrap_or(u16::MAX)))
}
