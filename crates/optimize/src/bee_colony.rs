//! Artificial bee colony (D. Karaboga, B. Basturk, J. Global Optim. 39 (2007)).
//!
//! Candidates are food sources. In every other generation each source has a trial `v_j = x_j + φ (x_j − x_kj)` on one random axis j,
//! with another source k and φ uniform in \[−1, 1); in the generations between, the trials belong to sources drawn with probability
//! proportional to their fitness, 1/(1 + cost). A trial replaces its source if its cost is lower. A source without success in
//! more trials than the limit is abandoned, one in each cycle, for a point uniform in the box.

use super::differential_evolution::other;
use super::numbers::PIECE;
use super::population::{Population, each_piece};
use super::roulette::Roulette;
use super::rule::Rule;
use super::table::{Range, search};

search! {
    BeeColony = "abc", "Artificial bee colony";
    /// Settings of the artificial bee colony.
    pub struct BeeColonyOptions {
        /// Number of trials without success above which a source is abandoned; 0 for the number of sources times that of axes.
        limit: usize = 0, "limit" in Range::Count(u32::MAX);
    }
}

/// Number of failures that marks a source as abandoned: its next trial is accepted at any cost.
const ABANDONED: usize = usize::MAX;

#[derive(Default)]
struct BeeColony {
    options: BeeColonyOptions,
    /// Values of the sources, row-major, and their costs.
    sources: Vec<f64>,
    costs: Vec<f64>,
    /// Trials of each source without success.
    failures: Vec<usize>,
    /// The source of each trial, and its cost; +∞ for one that was abandoned.
    owners: Vec<usize>,
    cutoffs: Vec<f64>,
    /// True if the trials belong to sources drawn by their fitness.
    is_drawn: bool,
}

/// Returns the fitness of a cost.
fn fitness(cost: f64) -> f64 {
    if cost >= 0.0 { 1.0 / (1.0 + cost) } else { 1.0 - cost }
}

impl BeeColony {
    /// Returns the source to be abandoned: that with the most failures if they exceed the limit.
    fn scout(&self, width: usize) -> Option<usize> {
        let limit = if self.options.limit == 0 { self.costs.len() * width } else { self.options.limit };
        let worst = (0..self.failures.len()).max_by_key(|source| self.failures[*source])?;
        (self.failures[worst] > limit).then_some(worst)
    }

    /// Draws a source for each trial with probability proportional to the fitness.
    fn draw(&mut self, population: &mut Population) {
        let wheel = Roulette::new(self.costs.iter().map(|cost| fitness(*cost)));
        self.owners.fill_with(|| wheel.draw(&mut population.numbers[0]));
    }
}

impl Rule for BeeColony {
    fn learn(&mut self, trials: &Population, costs: Vec<f64>) {
        if self.costs.is_empty() {
            self.sources.clone_from(&trials.values);
            self.failures = vec![0; costs.len()];
            self.owners = (0..costs.len()).collect();
            // The first cycle begins with a trial of each source.
            (self.costs, self.is_drawn) = (costs, true);
            return;
        }
        let width = trials.width();
        for (trial, cost) in costs.into_iter().enumerate() {
            let owner = self.owners[trial];
            let is_abandoned = self.failures[owner] == ABANDONED;
            if is_abandoned || cost < self.costs[owner] {
                self.costs[owner] = cost;
                self.failures[owner] = 0;
                self.sources[owner * width..(owner + 1) * width].copy_from_slice(trials.row(trial));
            } else {
                self.failures[owner] += 1;
            }
        }
    }

    fn cutoffs(&self) -> &[f64] {
        &self.cutoffs
    }

    fn advance(&mut self, trials: &mut Population) {
        let width = trials.width();
        self.is_drawn = !self.is_drawn;
        let mut abandoned = None;
        if self.is_drawn {
            self.draw(trials);
        } else {
            abandoned = self.scout(width);
            self.owners.iter_mut().enumerate().for_each(|(trial, owner)| *owner = trial);
        }
        self.cutoffs.clear();
        self.cutoffs.extend(self.owners.iter().map(|owner| self.costs[*owner]));
        let Population { setup, numbers, values, .. } = trials;
        let (owners, sources) = (&self.owners, &self.sources);
        let row = |source: usize| &sources[source * width..(source + 1) * width];
        each_piece(
            values.chunks_mut(PIECE * width).zip(numbers.iter_mut()).enumerate(),
            |(piece, (values, numbers))| {
                for (owner, trial) in owners[piece * PIECE..].iter().zip(values.chunks_exact_mut(width)) {
                    let other = other(numbers, owners.len(), &[*owner]);
                    let (axis, phi) = (numbers.below(width), 2.0 * numbers.unit() - 1.0);
                    trial.copy_from_slice(row(*owner));
                    let ((min, max), x) = (setup.bounds[axis], trial[axis]);
                    trial[axis] = (x + phi * (x - row(other)[axis])).max(min).min(max);
                }
            },
        );
        if let Some(source) = abandoned {
            for (x, (min, max)) in values[source * width..(source + 1) * width].iter_mut().zip(&setup.bounds) {
                *x = (min + (max - min) * numbers[0].unit()).clamp(*min, *max);
            }
            (self.cutoffs[source], self.failures[source]) = (f64::INFINITY, ABANDONED);
        }
    }
}

#[allow(clippy::float_cmp, reason = "exact equality is meant")]
#[cfg(test)]
mod tests {
    use super::*;
    use crate::rule::Moving;
    use crate::{Optimizer as _, SearchSettings};

    fn setup() -> SearchSettings {
        let bounds = vec![(-1.0, 3.0), (10.0, 20.0)];
        SearchSettings { bounds, population: 6, seed: 5, ..SearchSettings::default() }
    }

    /// Compares generations with the formula evaluated source by source from the same random numbers.
    #[test]
    fn generations_are_the_formula() {
        let options = BeeColonyOptions { limit: 5 };
        let mut colony = Moving::new(BeeColony { options, ..BeeColony::default() }, setup()).unwrap();
        let numbers = &mut Population::new(setup()).unwrap().numbers[0];
        let mut sources: Vec<[f64; 2]> = colony.ask().values().chunks(2).map(|row| [row[0], row[1]]).collect();
        let cost = |x: &[f64]| (x[0] - 2.9).powi(2) + (x[1] - 10.1).abs();
        let mut costs: Vec<f64> = sources.iter().map(|x| cost(x)).collect();
        let (mut failures, mut scouts) = ([0; 6], 0);
        colony.tell(&costs);
        for generation in 0..60 {
            let is_drawn = generation % 2 == 1;
            let mut scout = None;
            let mut owners: Vec<usize> = (0..6).collect();
            if is_drawn {
                let fit: Vec<f64> = costs.iter().map(|cost| 1.0 / (1.0 + cost)).collect();
                let total: f64 = fit.iter().sum();
                for owner in &mut owners {
                    let at = numbers.unit() * total;
                    let mut sum = 0.0;
                    *owner = fit
                        .iter()
                        .position(|share| {
                            sum += share;
                            sum > at
                        })
                        .unwrap();
                }
            } else {
                let most = *failures.iter().max().unwrap();
                scout = failures.iter().rposition(|count| *count == most && most > 5);
            }
            let mut trials: Vec<[f64; 2]> = Vec::new();
            for owner in &owners {
                let other = loop {
                    let other = numbers.below(6);
                    if other != *owner {
                        break other;
                    }
                };
                let (axis, phi) = (numbers.below(2), 2.0 * numbers.unit() - 1.0);
                let mut trial = sources[*owner];
                let moved = trial[axis] + phi * (trial[axis] - sources[other][axis]);
                trial[axis] = moved.clamp(setup().bounds[axis].0, setup().bounds[axis].1);
                trials.push(trial);
            }
            if let Some(scout) = scout {
                trials[scout] = [-1.0 + 4.0 * numbers.unit(), 10.0 + 10.0 * numbers.unit()];
                scouts += 1;
            }
            let asked = colony.ask();
            for (found, expected) in asked.values().iter().zip(trials.as_flattened()) {
                assert!((found - expected).abs() < 1e-12, "generation {generation}: {found} {expected}");
            }
            for (trial, owner) in owners.iter().enumerate() {
                let limit = if scout == Some(trial) { f64::INFINITY } else { costs[*owner] };
                assert!((asked.cutoffs()[trial] - limit).abs() < 1e-12 || asked.cutoffs()[trial] == limit);
            }
            let found: Vec<f64> = trials.iter().map(|x| cost(x)).collect();
            colony.tell(&found);
            for (trial, owner) in owners.into_iter().enumerate() {
                if found[trial] < costs[owner] || scout == Some(trial) {
                    (costs[owner], sources[owner], failures[owner]) = (found[trial], trials[trial], 0);
                } else {
                    failures[owner] += 1;
                }
            }
        }
        assert!(scouts > 3, "{scouts}");
    }

    #[test]
    fn fitness_is_that_of_the_paper() {
        assert_eq!([0.0, 1.0, 3.0, -2.0].map(fitness), [1.0, 0.5, 0.25, 3.0]);
    }
}
