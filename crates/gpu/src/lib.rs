//! The GPU evaluator: WGSL compute shaders simulate all candidates of a batch in parallel.
//!
//! Step maps are computed in f64 on the CPU and uploaded. Shaders step the states and accumulate weighted sums of errors per
//! channel, from which the CPU computes the criterion. In f64 the states are current and speed; in f32 they are deviations from
//! a reference trajectory, so that rounding errors are relative to the deviation.
//!
//! Motors with extensions are computed without deviations in f32 too, because deviations of motors with friction do not obey
//! linear equations. Some problems with extensions are evaluated on the CPU (see `constants`).
//!
//! A batch is one submission unless its groups need different shaders or it exceeds the budget; then it is divided, with two
//! submissions in flight. Callers can also overlap two batches: [`begin`](motorfit_evaluate::Evaluator::begin) the second before
//! [`finish`](motorfit_evaluate::Evaluator::finish) of the first.

#![forbid(unsafe_code)]
// Counts are converted by the functions of `numeric`.
#![cfg_attr(not(test), warn(clippy::cast_precision_loss, clippy::cast_sign_loss))]

mod binding;
#[cfg(feature = "gpu")]
mod check;
#[cfg(feature = "gpu")]
mod clock;
mod constants;
#[cfg(feature = "gpu")]
mod device;
#[cfg(feature = "gpu")]
mod evaluator;
mod features;
mod layout;
mod maps;
#[cfg(feature = "gpu")]
mod model;
#[cfg(feature = "gpu")]
mod model_evaluator;
#[cfg(feature = "gpu")]
mod parts;
#[cfg(feature = "gpu")]
mod pipelines;
mod reference;
#[cfg(feature = "gpu")]
mod set;
mod shader;
mod submission;
mod sums;
mod variant;
mod wide;

#[cfg(feature = "gpu")]
pub use device::{AdapterFacts, Selector, list};
#[cfg(feature = "gpu")]
pub use evaluator::Gpu;
pub use features::ShaderFeatures;
pub use shader::assemble;
pub use submission::{BufferBinding, BufferKind, Submission};
pub use variant::{Fetch, LANES, Precision, UNIFORM_BYTES, Variant};

/// Runs the example of the README as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}
