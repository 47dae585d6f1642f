//! Tests of comparisons, sweeps and searches.

#[cfg(feature = "cli")]
mod compare;
#[cfg(feature = "cli")]
mod compare_models;
mod optimizers;
#[cfg(feature = "cli")]
mod suite;
#[path = "../support/mod.rs"]
mod support;
mod sweep;
