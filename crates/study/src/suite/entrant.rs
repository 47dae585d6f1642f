//! Searches that take part in a suite.

use crate::compare::CompareSettings;
use motorfit_core::Result;
use motorfit_core::numeric::index;
use motorfit_identify::Method;
use motorfit_optimize::Coordinates;

/// Largest population that an entrant without one has.
pub(super) const POPULATION: u64 = 100;

/// A search that takes part in a suite.
#[derive(Debug, Clone, PartialEq)]
pub struct Entrant {
    /// The search with its hyperparameters.
    pub method: Method,
    /// Coordinates in which it moves its candidates.
    pub coordinates: Coordinates,
    /// Candidates per generation; `None` for the largest divisor of the budget up to its root and up to 100.
    pub population: Option<usize>,
}

impl Entrant {
    /// Returns the population and the number of generations for a budget of evaluations.
    #[must_use]
    pub fn shape(&self, budget: u64) -> [usize; 2] {
        let divides = |n: &u64| n.saturating_mul(*n) <= budget && budget.is_multiple_of(*n);
        let usual = || (1..=POPULATION).rev().find(divides).unwrap_or(1);
        let population = self.population.map_or_else(usual, |population| population as u64).clamp(1, budget.max(1));
        [index(population), index(budget.max(1) / population)]
    }

    /// Returns an entrant for each combination of methods, hyperparameters, coordinates and populations; without populations each
    /// entrant has the usual one. Steiglitz–McBride is left out.
    ///
    /// # Errors
    /// Returns a `Usage` error for invalid or repeated values.
    pub fn all(settings: &CompareSettings) -> Result<Vec<Self>> {
        let usual = settings.population.is_empty();
        let population = if usual { vec![1] } else { settings.population.clone() };
        let (criteria, generations) = (vec!["nrmse".to_owned()], vec![1]);
        let mut entrants: Vec<Self> = Vec::new();
        for setting in (CompareSettings { criteria, generations, population, ..settings.clone() }).settings()? {
            let population = (!usual).then_some(setting.population);
            for method in setting.methods {
                let entrant = Self { method, coordinates: setting.coordinates, population };
                if !entrants.contains(&entrant) {
                    entrants.push(entrant);
                }
            }
        }
        Ok(entrants)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn populations_divide_the_budget() {
        let entrant = |population| Entrant { method: Method::default(), coordinates: Coordinates::None, population };
        let shapes = [100, 1000, 10_000, 100_000, 7, 1].map(|budget| entrant(None).shape(budget));
        assert_eq!(shapes, [[10, 10], [25, 40], [100, 100], [100, 1000], [1, 7], [1, 1]]);
        assert_eq!([100, 1000].map(|budget| entrant(Some(300)).shape(budget)), [[100, 1], [300, 3]]);
    }
}
