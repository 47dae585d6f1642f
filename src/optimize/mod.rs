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
mod searches;
mod table;

pub use genetic::GeneticOptions;
pub use gwo::GwoOptions;
pub use jaya::{JayaOptions, Sharing};
pub use minimize::{Budget, Evaluate, Observe, minimize};
pub use population::SearchSettings;
pub use pso::{PsoOptions, Wall};
pub use run::{Best, Optimizer, Progress, Run, Stop};
pub use sample::{Sample, Sampling};
pub use searches::{SEARCHES, Tuned, unknown_setting};
pub use table::{Hyperparameter, Range, Search, SearchOptions, Values};
