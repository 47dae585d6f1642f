//! Kernel for models whose equations are affine: exact steps of one or two states, with reactions that clip them, for candidates side by
//! side. What does not fit runs as a program.
//!
//! Cost per candidate and step with N states and M outputs: N² multiply–adds for the states, 2 M operations for the errors; with a
//! reaction N and four more. The gain of the inputs is computed once where they are constant over several steps.

mod coefficients;
mod kernel;
mod rows;
mod run;

pub(crate) use coefficients::AffineProgram;
pub(crate) use rows::AffineRows;
pub(crate) use run::AffineJob;
