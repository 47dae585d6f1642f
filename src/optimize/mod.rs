//! Population searches. They know no motor: a box and costs.
//!
//! `ask` gives a population, `tell` takes its costs; [`minimize`] drives any number of runs in lock step, all of
//! their candidates evaluated in one call. A run's random numbers depend on (seed, run) alone.

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
mod tuned;

use crate::limit::{Limit, limit, limit_of};

pub use genetic::GeneticOptions;
pub use gwo::GwoOptions;
pub use jaya::{JayaOptions, Sharing};
pub use minimize::{Budget, Evaluate, Observe, minimize};
pub use population::SearchSettings;
pub use pso::{PsoOptions, Wall};
pub use run::{Best, Optimizer, Progress, Run, Stop};
pub use sample::{POINTS_MAX, Sample, Sampling};
pub use table::{Hyperparameter, Range, Search, SearchOptions, Values};
pub use tuned::Tuned;

/// The limits of searches and samples.
pub const LIMITS: [Limit; 2] = [
    limit_of("numbers of a population, candidates times free parameters", population::VALUES_MAX, "refused"),
    limit("points of a sample", POINTS_MAX, "refused"),
];

/// The table of population searches, in the order in which they are listed. The first one serves where none is asked for.
pub const SEARCHES: [&Search; 5] = [&gwo::SEARCH, &jaya::SEARCH, &genetic::SEARCH, &pso::SEARCH, &random::SEARCH];
