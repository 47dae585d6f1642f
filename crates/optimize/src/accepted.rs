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
        self.take_after(trials, costs, |_, _, _| {});
    }

    /// Takes trials like [`Self::take`], and calls `before` with the index, the parent and both costs `[parent, trial]` of each before
    /// it replaces its parent.
    pub(super) fn take_after(
        &mut self,
        trials: &Population,
        costs: Vec<f64>,
        mut before: impl FnMut(usize, &[f64], [f64; 2]),
    ) {
        if self.costs.is_empty() {
            return self.replace(trials, costs);
        }
        let parents = self.values.chunks_exact_mut(trials.width()).zip(&mut self.costs);
        for ((agent, cost), (parent, own)) in costs.into_iter().enumerate().zip(parents) {
            if cost <= *own {
                before(agent, parent, [*own, cost]);
                *own = cost;
                parent.copy_from_slice(trials.row(agent));
            }
        }
    }

    /// Returns the values of an accepted candidate.
    #[inline]
    pub(super) fn row(&self, agent: usize, width: usize) -> &[f64] {
        &self.values[agent * width..(agent + 1) * width]
    }
}
