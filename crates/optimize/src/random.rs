//! Random search: every population is uniform in the box. It is the baseline that other searches must beat.

use super::population::Population;
use super::rule::{Moving, Rule};
use super::table::{Search, Values};

/// Table row of random search, which has no settings.
pub(super) const SEARCH: Search = Search {
    name: "random",
    text: "Random search",
    settings: &[],
    defaults: Values::default,
    begin: |setup, _| Ok(Box::new(Moving::new(Random::default(), setup)?)),
    debug: |_| "Random".to_owned(),
};

#[derive(Default)]
struct Random {
    /// The lowest cost for each candidate.
    cutoffs: Vec<f64>,
}

impl Rule for Random {
    fn learn(&mut self, population: &Population, costs: Vec<f64>) {
        self.cutoffs.clear();
        self.cutoffs.resize(costs.len(), population.lowest());
    }

    /// Only the best candidate counts.
    fn cutoffs(&self) -> &[f64] {
        &self.cutoffs
    }

    fn advance(&mut self, population: &mut Population) {
        population.scatter();
    }
}
