//! Random search: every population uniform in the box. What a search must beat.

use super::population::{Population, SearchSettings, ordered};
use super::table::{Search, Values};
use super::{Best, Optimizer};
use crate::Result;
use crate::candidates::Candidates;

/// The row of random search, which has no settings.
pub(super) const SEARCH: Search = Search {
    name: "random",
    text: "Random search",
    settings: &[],
    usual: Values::default,
    begin: |setup, _| Ok(Box::new(Random::new(setup)?)),
    debug: |_| "Random".to_owned(),
};

/// A run of random search.
#[derive(Debug, Clone)]
pub struct Random {
    population: Population,
    told: bool,
}

impl Random {
    /// A new run.
    ///
    /// # Errors
    /// `Usage` for an empty box or population.
    pub fn new(setup: SearchSettings) -> Result<Self> {
        Ok(Self { population: Population::new(setup)?, told: false })
    }
}

impl Optimizer for Random {
    fn ask(&mut self) -> Candidates<'_> {
        if self.told {
            let Population { setup, numbers, values, .. } = &mut self.population;
            for agent in values.chunks_exact_mut(setup.bounds.len()) {
                for (x, &(min, max)) in agent.iter_mut().zip(&setup.bounds) {
                    *x = min + (max - min) * numbers.unit();
                }
            }
            self.told = false;
        }
        self.population.candidates()
    }

    fn tell(&mut self, costs: &[f64]) {
        self.population.note(&ordered(costs));
        self.told = true;
    }

    fn best(&self) -> Option<Best<'_>> {
        self.population.best()
    }
}
