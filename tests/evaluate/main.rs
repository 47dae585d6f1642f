//! Tests of motors, models and the evaluators of the CPU, against oracles.

mod contract;
mod extensions;
mod model_starts;
mod models;
mod motor;
#[path = "../support/mod.rs"]
mod support;
