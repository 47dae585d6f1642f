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

pub use genetic::{Genetic, GeneticOptions};
pub use gwo::{Gwo, GwoOptions};
pub use jaya::{Jaya, JayaOptions, Sharing};
pub use minimize::{Budget, Evaluate, Observe, minimize};
pub use population::SearchSettings;
pub use pso::{Pso, PsoOptions, Wall};
pub use random::Random;
pub use run::{Progress, Run, Stop};
pub use sample::{Sample, Sampling};
pub use table::{Hyperparameter, Range, Search, SearchOptions, Tuned, Values, unknown_setting};

use crate::candidates::Candidates;

/// The table of population searches, in the order in which they are listed. The first one serves where none is asked for.
pub const SEARCHES: [&Search; 5] = [&gwo::SEARCH, &jaya::SEARCH, &genetic::SEARCH, &pso::SEARCH, &random::SEARCH];

/// The best candidate so far.
#[derive(Debug, Clone, Copy)]
pub struct Best<'a> {
    /// Its values, one per axis.
    pub values: &'a [f64],
    /// Its cost.
    pub cost: f64,
}

/// A population search, driven from outside.
pub trait Optimizer: Send {
    /// The candidates to be evaluated next; the same ones until `tell`.
    fn ask(&mut self) -> Candidates<'_>;

    /// Takes the costs of the candidates of the last `ask`, in their order; +∞ for one that failed. A NaN counts
    /// as +∞.
    fn tell(&mut self, costs: &[f64]);

    /// The best so far; `None` before the first `tell` and while every cost was +∞.
    fn best(&self) -> Option<Best<'_>>;
}
