//! Population searches over a box, independent of the motor.
//!
//! The interface is ask/tell: `ask` returns the next population, `tell` takes its costs. [`minimize`] drives any number of
//! runs in lock step and evaluates all their candidates in one call. The random numbers of a run depend on (seed, run)
//! alone. A new search is a file with a rule, of which `gwo` is an example, and a row of [`SEARCHES`].

#![forbid(unsafe_code)]
// Counts are converted by the functions of `numeric`.
#![cfg_attr(not(test), warn(clippy::cast_precision_loss, clippy::cast_sign_loss))]

mod accepted;
mod bee_colony;
mod cmaes;
mod configured_search;
mod coordinates;
mod cuckoo;
mod differential_evolution;
mod generations;
mod genetic;
mod gwo;
mod jaya;
mod lshade;
mod minimize;
mod multistart;
mod numbers;
mod population;
mod pso;
mod random;
mod roulette;
mod rule;
mod run;
mod sample;
mod search_settings;
mod sobol;
mod table;
mod transformed_search;

use motorfit_core::limit::{Limit, limit, limit_of};

pub use bee_colony::BeeColonyOptions;
pub use cmaes::{CmaEsOptions, Restarts};
pub use configured_search::ConfiguredSearch;
pub use coordinates::Coordinates;
pub use cuckoo::CuckooOptions;
pub use differential_evolution::DifferentialEvolutionOptions;
pub use generations::Budget;
pub use genetic::GeneticOptions;
pub use gwo::GwoOptions;
pub use jaya::{JayaOptions, Sharing};
pub use lshade::LshadeOptions;
pub use minimize::{Evaluate, Observe, minimize};
pub use multistart::MultistartOptions;
pub use pso::{PsoOptions, Wall};
pub use run::{Best, LocalOptimum, LocalSearch, LocalSearches, Optimizer, Progress, Run, Stop};
pub use sample::{POINTS_MAX, Sample, Sampling};
pub use search_settings::SearchSettings;
pub use sobol::SOBOL_AXES_MAX;
pub use table::{Hyperparameter, Range, Search, SearchOptions, Values};

/// Size limits of searches and samples.
pub const LIMITS: [Limit; 2] = [
    limit_of("values of a population, candidates times free parameters", search_settings::VALUES_MAX, "refused"),
    limit("points of a sample", POINTS_MAX, "refused"),
];

/// The table of population searches, in the order in which they are listed.
pub const SEARCHES: [&Search; 11] = [
    &gwo::SEARCH,
    &jaya::SEARCH,
    &genetic::SEARCH,
    &pso::SEARCH,
    &differential_evolution::SEARCH,
    &lshade::SEARCH,
    &cmaes::SEARCH,
    &bee_colony::SEARCH,
    &cuckoo::SEARCH,
    &multistart::SEARCH,
    &random::SEARCH,
];

/// Runs the example of the README as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}
