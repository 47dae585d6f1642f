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
//! submissions in flight. Callers can also overlap two batches: [`begin`](crate::evaluate::Evaluator::begin) the second before
//! [`finish`](crate::evaluate::Evaluator::finish) of the first.

mod binding;
mod check;
mod clock;
mod constants;
mod device;
mod evaluator;
mod features;
mod layout;
mod maps;
mod model;
mod parts;
mod pipelines;
mod reference;
mod set;
mod shader;
mod variant;
mod wide;

pub use device::{AdapterFacts, Selector, list};
pub use evaluator::Gpu;
pub use features::ShaderFeatures;
pub use model::ModelGpu;
pub use shader::assemble;
pub use variant::{Fetch, LANES, Precision, UNIFORM_BYTES, Variant};
