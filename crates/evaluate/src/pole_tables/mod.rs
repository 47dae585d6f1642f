//! Costs of the linear motor that do not grow with the recording.
//!
//! On an even clock the sum of squared errors of a motor follows from power series of the recording at the two poles of the motor
//! (`series.rs`). The series are analytic functions of a pole, which polynomials replace in cells of the plane of poles (`geometry.rs`,
//! `cell.rs`), computed where candidates come (`tables.rs`). From their values the sums follow exactly (`response.rs`), together with a
//! bound of their error; a cost that may be wrong by more than 1e-9 of it is left to the SIMD kernel (`evaluator.rs`).
//!
//! A candidate takes the same time whatever the length of the recording: 448 multiply–adds in the polynomials of four functions and
//! some 700 operations in the sums and their bounds. A cell takes as long as 20 to 50 candidates of
//! the kernel.

mod block;
mod bounded;
mod cell;
mod cells;
mod evaluator;
mod geometry;
mod lanes;
mod moments;
mod response;
mod sequences;
mod series;
mod shared;
mod tables;
#[cfg(test)]
mod tests;
mod transition;

pub use evaluator::PoleTables;
