//! Instructions: what they compute, where to, and from which registers and scalars.

use crate::graph::Unary;
use crate::step::{MemoryKind, Substep};

/// Largest number of registers of a program; ids of scalars begin there while a program is compiled.
pub(crate) const REGISTERS_MAX: usize = 0x7fff;

/// An operation. `Linear` adds scalars times registers to a register, `Products` adds products of registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operation {
    /// a
    Copy,
    /// A scalar for all lanes.
    Broadcast,
    /// a + b
    Add,
    /// a − b
    Subtract,
    /// a b
    Multiply,
    /// a / b
    Divide,
    /// 1 / a
    Reciprocal,
    /// −a
    Negative,
    /// The smaller of a and b.
    Min,
    /// The larger of a and b.
    Max,
    /// c if a < b, else d.
    SelectLess,
    /// c if a ≤ b, else d.
    SelectLessEqual,
    /// a to the power b.
    Power,
    /// The angle of the point (b, a) \[rad\].
    Atan2,
    /// A function of a.
    Function(Unary),
    /// a b + c d
    Products2,
    /// a b + c d + e f
    Products3,
    /// a + b c
    AddProduct,
    /// a + b c + d e
    AddProducts2,
    /// a + b c + d e + f g
    AddProducts3,
    /// a − b c
    SubtractProduct,
    /// a + k b
    Linear1,
    /// a + k b + l c
    Linear2,
    /// a + k b + l c + m d
    Linear3,
    /// a + k b + l c + m d + n e
    Linear4,
    /// k + l a
    Affine1,
    /// k + l a + m b
    Affine2,
    /// k a
    Scale1,
    /// k a + l b
    Scale2,
    /// Output number `target` has the value a.
    Output,
    /// An operation with a memory. It has the number of its memory, the place of its substep and the number of substeps in the place of
    /// scalars.
    Memory(MemoryKind),
    /// The derivative of an operation with a memory; operands and their derivatives alternate.
    MemoryRate(MemoryKind),
}

impl Operation {
    /// Returns true if the operation has a memory of earlier samples.
    pub fn has_memory(self) -> bool {
        matches!(self, Self::Memory(_) | Self::MemoryRate(_))
    }

    /// Returns the number of registers that are read.
    pub fn registers(self) -> usize {
        match self {
            Self::Broadcast => 0,
            Self::Copy
            | Self::Reciprocal
            | Self::Negative
            | Self::Function(_)
            | Self::Affine1
            | Self::Scale1
            | Self::Output => 1,
            Self::Add
            | Self::Subtract
            | Self::Multiply
            | Self::Divide
            | Self::Min
            | Self::Max
            | Self::Power
            | Self::Atan2
            | Self::Linear1
            | Self::Affine2
            | Self::Scale2 => 2,
            Self::AddProduct | Self::SubtractProduct | Self::Linear2 => 3,
            Self::SelectLess | Self::SelectLessEqual | Self::Products2 | Self::Linear3 => 4,
            Self::AddProducts2 | Self::Linear4 => 5,
            Self::Products3 => 6,
            Self::AddProducts3 => 7,
            Self::Memory(kind) => kind.operands(),
            Self::MemoryRate(kind) => 2 * kind.operands(),
        }
    }

    /// Returns the number of operations per lane, a fused one as one; functions count as the operations of their polynomials.
    pub fn work(self) -> usize {
        match self {
            Self::Copy | Self::Broadcast => 0,
            Self::Products2 | Self::AddProducts2 | Self::Linear2 | Self::Affine2 | Self::Scale2 => 2,
            Self::SelectLess | Self::SelectLessEqual | Self::Output => 2,
            Self::Products3 | Self::AddProducts3 | Self::Linear3 => 3,
            Self::Linear4 => 4,
            Self::Function(Unary::Sin | Unary::Cos | Unary::Tanh | Unary::Log) => 24,
            Self::Function(Unary::Exp) => 20,
            Self::Function(Unary::Tan | Unary::Atan) | Self::Power | Self::Atan2 => 50,
            _ => 1,
        }
    }
}

/// An instruction: what it computes, where to, and from which registers and scalars.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Instruction {
    /// The operation.
    pub operation: Operation,
    /// The register of the result, or the number of the output.
    pub target: u16,
    /// The registers that are read, as many as the operation has; the others are 0.
    pub registers: [u16; 8],
    /// The numbers of the scalars that are read; the others are 0.
    pub scalars: [u16; 4],
}

impl Instruction {
    /// Returns the number of the memory of an operation that has one, and the part of the step that it is for.
    pub fn memory(&self) -> (usize, Substep) {
        let [number, place, of, _] = self.scalars;
        (usize::from(number), Substep { place, of })
    }

    /// Returns the registers that are read.
    pub fn read(&self) -> &[u16] {
        &self.registers[..self.operation.registers()]
    }

    pub(crate) fn read_mut(&mut self) -> &mut [u16] {
        &mut self.registers[..self.operation.registers()]
    }

    /// Returns true if `target` is a register.
    pub(crate) fn writes(&self) -> bool {
        self.operation != Operation::Output
    }
}
