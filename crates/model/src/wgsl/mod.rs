//! WGSL shaders of models: one invocation simulates one candidate with the instructions of the model's program.
//!
//! Shaders use the built-in functions that drivers compute right in f32 and f64: arithmetic, `abs`, `sqrt`, `floor`, `round`, `min`,
//! `max`, `clamp`, `fma`, `ldexp`, `select`. The others are computed from them (`shaders/elementary`), without loops. Infinity and NaN are
//! not reliable in shaders, so a candidate whose values exceed a bound is marked.

mod elementary;
mod emit;
mod layout;
mod of_model;
mod precision;
pub mod shader;

pub use layout::{HEAD, Layout};
pub use precision::ShaderPrecision;
pub use shader::{ShaderSettings, shader};
