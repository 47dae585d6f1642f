//! Genetic algorithm with the operators of the paper's Table 3.
//!
//! Fitness is 1/cost. Parents are drawn by roulette-wheel selection, `s_i = f_i/Σf`; the ratio of their number to the
//! population is the selection pressure ("biological pressure" in the paper). Two parents produce a child by
//! single-point crossover. Each gene of the child then mutates, with the mutation rate as probability, to a uniform
//! value of its range. The best candidates of a generation survive unchanged (elites).

use super::population::Population;
use super::roulette::Roulette;
use super::rule::Rule;
use super::table::{PROBABILITY, Range, search};
use motorfit_core::numeric::{count, whole};

search! {
    Genetic = "ga", "Genetic algorithm";
    /// Settings of the genetic algorithm.
    pub struct GeneticOptions {
        /// Probability that a gene mutates.
        mutation: f64 = 0.2, "mutation" in PROBABILITY;
        /// Fraction of the population that is drawn as parents.
        pressure: f64 = 0.3, "pressure" in Range::Number(0.0, 1.0, true);
        /// Probability that a child is a crossover of two parents; otherwise it copies one.
        crossover: f64 = 1.0, "crossover" in PROBABILITY;
        /// Number of the best candidates that survive unchanged.
        elites: usize = 1, "elites" in Range::Count(u32::MAX);
    }
}

#[derive(Default)]
struct Genetic {
    options: GeneticOptions,
    costs: Vec<f64>,
}

impl Genetic {
    /// Draws parents by roulette-wheel selection on fitness 1/cost, with replacement.
    fn parents(&self, population: &mut Population) -> Vec<f64> {
        // The lower limit keeps the fitness of a cost of zero finite.
        let wheel = Roulette::new(self.costs.iter().map(|cost| 1.0 / cost.max(1e-300)));
        let parent_count = whole((self.options.pressure * count(self.costs.len())).round()).max(1);
        let mut parents = Vec::with_capacity(parent_count * population.width());
        for _ in 0..parent_count {
            let agent = wheel.draw(&mut population.numbers[0]);
            parents.extend_from_slice(population.row(agent));
        }
        parents
    }
}

impl Rule for Genetic {
    fn learn(&mut self, _: &Population, costs: Vec<f64>) {
        self.costs = costs;
    }

    fn advance(&mut self, population: &mut Population) {
        let width = population.width();
        let parents = self.parents(population);
        let count = parents.len() / width;
        let mut order: Vec<usize> = (0..self.costs.len()).collect();
        let elites = self.options.elites.min(order.len());
        if elites > 0 && elites < order.len() {
            order.select_nth_unstable_by(elites - 1, |a, b| self.costs[*a].total_cmp(&self.costs[*b]));
        }
        let mut next = Vec::with_capacity(population.values.len());
        for &agent in &order[..elites] {
            next.extend_from_slice(population.row(agent));
        }
        let Population { setup, numbers, values, .. } = population;
        let numbers = &mut numbers[0];
        while next.len() < values.len() {
            let (first, second) = (numbers.below(count), numbers.below(count));
            let mix = width > 1 && numbers.unit() < self.options.crossover;
            // Genes before the point come from the first parent.
            let point = if mix { 1 + numbers.below(width - 1) } else { width };
            for (axis, &(min, max)) in setup.bounds.iter().enumerate() {
                let parent = if axis < point { first } else { second };
                let mutates = numbers.unit() < self.options.mutation;
                next.push(if mutates { min + (max - min) * numbers.unit() } else { parents[parent * width + axis] });
            }
        }
        *values = next;
    }
}

#[allow(clippy::float_cmp, clippy::cast_possible_truncation, reason = "exact equality is meant")]
#[cfg(test)]
mod tests {
    use super::*;
    use crate::rule::Moving;
    use crate::{Optimizer as _, SearchSettings};

    fn run(options: GeneticOptions) -> (Vec<f64>, Vec<f64>) {
        let setup = SearchSettings {
            bounds: vec![(0.0, 1.0); 4],
            population: 1000,
            generations: 3,
            seed: 5,
            ..SearchSettings::default()
        };
        let mut ga = Moving::new(Genetic { options, costs: Vec::new() }, setup).unwrap();
        let first = ga.ask().values().to_vec();
        // Candidate 7 is ten times as fit as each of the others.
        let costs: Vec<f64> = (0..1000).map(|n| if n == 7 { 0.1 } else { 1.0 }).collect();
        ga.tell(&costs);
        let second = ga.ask().values().to_vec();
        (first, second)
    }

    #[test]
    fn the_elite_survives_and_children_are_made_of_parents() {
        let (first, second) = run(GeneticOptions { mutation: 0.0, ..GeneticOptions::default() });
        assert_eq!(second[..4], first[28..32], "the best comes first, unchanged");
        let mut mixed = 0;
        for child in second[4..].chunks(4) {
            let parent = |axis: usize| first.chunks(4).position(|p| p[axis] == child[axis]).unwrap();
            let parents = [0, 1, 2, 3].map(parent);
            let changes = parents.windows(2).filter(|w| w[0] != w[1]).count();
            assert!(changes <= 1, "one crossover point: {parents:?}");
            mixed += changes;
        }
        assert!(mixed > 900, "all but the children of twice the same parent are mixed: {mixed}");
    }

    #[test]
    fn roulette_and_mutation_have_their_rates() {
        let (first, second) = run(GeneticOptions { crossover: 0.0, ..GeneticOptions::default() });
        let genes = second[4..].iter().zip(first.iter().cycle());
        let fresh = genes.filter(|(gene, _)| !first.contains(gene)).count() as f64 / (4.0 * 999.0);
        // Binomial: 0.2 ± 4 √(0.2·0.8/3996).
        assert!((fresh - 0.2).abs() < 0.026, "{fresh}");
        let favourite = second.chunks(4).filter(|c| (0..4).any(|axis| c[axis] == first[28 + axis])).count();
        // 300 draws for parents hit candidate 7 with probability 10/1009 each, three expected; a child has one of 300
        // parents. This is far more than the one in 1000 of uniform selection, and far fewer than all.
        assert!((2..60).contains(&favourite), "{favourite}");
    }
}
