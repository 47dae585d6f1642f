//! Population searches over a box, independent of the motor.
//!
//! The interface is ask/tell: `ask` returns the next population, `tell` takes its costs. [`minimize`] drives any number of
//! runs in lock step and evaluates all their candidates in one call. The random numbers of a run depend on (seed, run)
//! alone. A new search is a file with a rule, of which `gwo` is an example, and a row of [`SEARCHES`].

mod configured_search;
mod genetic;
mod gwo;
mod jaya;
mod minimize;
mod population;
mod pso;
mod random;
mod run;
mod sample;
mod table;

use crate::limit::{Limit, limit, limit_of};

pub use configured_search::ConfiguredSearch;
pub use genetic::GeneticOptions;
pub use gwo::GwoOptions;
pub use jaya::{JayaOptions, Sharing};
pub use minimize::{Budget, Evaluate, Observe, minimize};
pub use population::SearchSettings;
pub use pso::{PsoOptions, Wall};
pub use run::{Best, Optimizer, Progress, Run, Stop};
pub use sample::{POINTS_MAX, Sample, Sampling};
pub use table::{Hyperparameter, Range, Search, SearchOptions, Values};

/// Size limits of searches and samples.
pub const LIMITS: [Limit; 2] = [
    limit_of("values of a population, candidates times free parameters", population::VALUES_MAX, "refused"),
    limit("points of a sample", POINTS_MAX, "refused"),
];

/// The table of population searches, in the order in which they are listed. The first is the default.
pub const SEARCHES: [&Search; 5] = [&gwo::SEARCH, &jaya::SEARCH, &genetic::SEARCH, &pso::SEARCH, &random::SEARCH];
