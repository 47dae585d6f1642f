//! Programs: straight-line instructions on registers, each of which holds a value for every lane.
//!
//! A lane is a candidate, or a direction of a derivative. What depends on parameters alone is computed once (`setup`); what depends
//! on inputs alone is computed once per sample for all lanes (`uniforms`), and instructions read it as scalars; the rest is the
//! `body`, executed for each sample. Sums of products become fused instructions.

mod allocate;
mod compile;
mod compiled;
mod instruction;
mod sums;

pub use compile::{Roots, compile};
pub use compiled::{Program, Uniforms};
pub use instruction::{Instruction, Operation};
