//! Tests of motors, models and the evaluators of the CPU, against oracles.

mod contract;
mod delays;
mod extensions;
mod generic_terms;
mod model_starts;
mod models;
mod motor;
mod optional_terms;
mod sampled_laws;
mod search_problems;
#[path = "../support/mod.rs"]
mod support;
mod two_links;
