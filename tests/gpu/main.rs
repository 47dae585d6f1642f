//! Tests of the evaluators of the GPU, apart because they wait for a device.
#![cfg(feature = "gpu")]

mod gpu;
mod gpu_search;
mod shaders;
#[path = "../support/mod.rs"]
mod support;
