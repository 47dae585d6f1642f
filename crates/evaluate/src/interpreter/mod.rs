//! Interpreter of programs over lanes: the evaluator of models on the CPU.
//!
//! A register holds one value for each lane. With 64 lanes the dispatch of an instruction (3 ns) is small against its work, and the
//! registers of a typical step stay in the first-level cache. The limit is the loads: three to four for each fused operation. Derivatives
//! take a lane for each direction of a candidate.

mod clock;
mod execute;
mod functions;
mod lag;
mod memory;
mod normal;
mod register;
mod run;
mod sensor;

pub(crate) use clock::Clock;
pub(crate) use memory::Memory;
pub use normal::Directions;
pub(crate) use register::{Register, Vector, WIDTH};
pub(crate) use run::{Job, RunProgram, Work};
pub use run::{Loss, Rows};
