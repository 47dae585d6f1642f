//! The accepted candidates of a search in which a trial replaces its parent only if its cost is not higher.

use super::population::Population;

/// The accepted candidates and their costs; none before the first population has been evaluated.
#[derive(Debug, Default)]
pub(super) struct Accepted {
    /// Values, row-major, shape `[population, axes]`.
    pub values: Vec<f64>,
    /// Costs, also the cutoffs of the next trials.
    pub costs: Vec<f64>,
}

impl Accepted {
    /// Takes all candidates of a population, whatever their costs.
    pub(super) fn replace(&mut self, population: &Population, costs: Vec<f64>) {
        self.values.clone_from(&population.values);
        self.costs = costs;
    }

    /// Takes each trial whose cost is not above that of its parent, and all of the first population.
    pub(super) fn take(&mut self, trials: &Population, costs: Vec<f64>) {
        if self.costs.is_empty() {
            return self.replace(trials, costs);
        }
        let width = trials.width();
        for (agent, cost) in costs.into_iter().enumerate() {
            if cost <= self.costs[agent] {
                self.costs[agent] = cost;
                self.values[agent * width..(agent + 1) * width].copy_from_slice(trials.row(agent));
            }
        }
    }

    /// Returns the values of an accepted candidate.
    #[inline]
    pub(super) fn row(&self, agent: usize, width: usize) -> &[f64] {
        &self.values[agent * width..(agent + 1) * width]
    }
}
