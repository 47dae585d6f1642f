//! Nodes: constants, leaves and operations, and what they depend on.

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

/// An operator of one operand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Unary {
    /// The operand with the other sign.
    Negative,
    /// One over the operand.
    Reciprocal,
    /// The sine of an angle \[rad\].
    Sin,
    /// The cosine of an angle \[rad\].
    Cos,
    /// The tangent of an angle \[rad\].
    Tan,
    /// The exponential.
    Exp,
    /// The natural logarithm.
    Log,
    /// The square root.
    Sqrt,
    /// The magnitude.
    Abs,
    /// The sign: −1, 0 or 1; NaN stays NaN.
    Sign,
    /// The hyperbolic tangent.
    Tanh,
    /// The inverse tangent \[rad\].
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

    pub(crate) fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    pub(crate) fn of(leaf: Leaf) -> Self {
        match leaf {
            Leaf::Parameter(_) => Self::PARAMETERS,
            Leaf::Input(_) | Leaf::NextInput(_) => Self::INPUTS,
            Leaf::State(_) | Leaf::Reaction(_) | Leaf::Memory(_) => Self::STATES,
        }
    }
}
