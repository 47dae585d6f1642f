//! Random search: every population is uniform in the box. It is the baseline that other searches must beat.

use super::population::{Moving, Population, Rule};
use super::table::{Search, Values};

/// Table row of random search, which has no settings.
pub(super) const SEARCH: Search = Search {
    name: "random",
    text: "Random search",
    settings: &[],
    defaults: Values::default,
    begin: |setup, _| Ok(Box::new(Moving::new(Random, setup)?)),
    debug: |_| "Random".to_owned(),
};

struct Random;

impl Rule for Random {
    fn learn(&mut self, _: &Population, _: Vec<f64>) {}

    fn advance(&mut self, population: &mut Population) {
        population.scatter();
    }
}
