//! The GPU evaluator: WGSL integrates the motor for the whole batch in parallel.
//!
//! Step maps are made in f64 on the CPU and uploaded; shaders do indexing, recurrence and accumulation alone; weighted
//! sums per channel come back and the CPU forms the criterion. In f64 the states are computed as they are; in f32 as
//! deviations from a reference, so that rounding is relative to the deviation.
//!
//! Motors with extensions are computed as they are in f32 too, because deviations of motors with friction are not linear;
//! a few problems of them go to the CPU (`constants` says which).
//!
//! A batch is one submission unless it is larger than the budget; then it is cut, and two parts are in flight. Callers with two
//! batches can overlap them too: [`begin`](crate::evaluate::Evaluator::begin) the second before
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
mod parts;
mod pipelines;
mod reference;
mod set;
mod shader;
mod variant;

pub use device::{AdapterFacts, Selector, list};
pub use evaluator::Gpu;
pub use features::ShaderFeatures;
pub use shader::assemble;
pub use variant::{Fetch, LANES, Precision, UNIFORM_BYTES, Variant};
