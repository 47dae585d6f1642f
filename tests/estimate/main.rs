//! Tests of estimates, their intervals and their judgement.

mod characteristics;
mod closed_loop;
mod current;
mod identifiability;
mod irregular;
mod judgement;
mod likelihood;
mod model_terms;
mod one_pipeline;
#[path = "../support/mod.rs"]
mod support;
mod validation;
