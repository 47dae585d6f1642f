//! Grey Wolf Optimizer (S. Mirjalili, S. M. Mirjalili, A. Lewis, Adv. Eng. Softw. 69 (2014); Eqs. 8–10).
//!
//! All candidates move towards the three best ever evaluated (alpha, beta, delta), then all are evaluated. A new best
//! demotes the old alpha to beta and beta to delta. `A = 2a r₁ − a`, `C = 2 r₂`, with r₁, r₂ uniform in \[0, 1) for each
//! leader, axis and candidate; a decreases in equal steps from `a_start` towards `a_end` over the generations. Candidates
//! are clamped to the box.

use super::numbers::{PIECE, split};
use super::population::{Population, each_piece};
use super::rule::Rule;
use super::table::{NOT_NEGATIVE, search};
use motorfit_core::numeric::count;
use multiversion::multiversion;

search! {
    Gwo = "gwo", "Grey Wolf Optimizer";
    /// Settings of the Grey Wolf Optimizer.
    pub struct GwoOptions {
        /// Initial value of the coefficient a: move g of G generations (g from 0) has `a_start + (a_end − a_start) g/G`.
        a_start: f64 = 2.0, "a-start" in NOT_NEGATIVE;
        /// Final value of the coefficient a, approached at the last generation.
        a_end: f64 = 0.0, "a-end" in NOT_NEGATIVE;
    }
}

/// One of the best candidates ever evaluated.
struct Leader {
    cost: f64,
    values: Vec<f64>,
}

#[derive(Default)]
struct Gwo {
    options: GwoOptions,
    /// Alpha, beta, delta: the three best candidates ever evaluated, the best first.
    leaders: Vec<Leader>,
    /// Delta's cost for each candidate, once there are three leaders.
    cutoffs: Vec<f64>,
    generation: usize,
}

impl Rule for Gwo {
    fn learn(&mut self, population: &Population, costs: Vec<f64>) {
        for (agent, cost) in costs.into_iter().enumerate() {
            let rank = self.leaders.partition_point(|leader| leader.cost <= cost);
            if rank < 3 {
                self.leaders.insert(rank, Leader { cost, values: population.row(agent).to_vec() });
                self.leaders.truncate(3);
            }
        }
        if let [_, _, delta] = &self.leaders[..] {
            self.cutoffs.clear();
            self.cutoffs.resize(population.setup.population, delta.cost);
        }
    }

    /// A candidate replaces a leader only if its cost is below delta's.
    fn cutoffs(&self) -> &[f64] {
        &self.cutoffs
    }

    /// Moves every candidate by Eq. 10.
    fn advance(&mut self, population: &mut Population) {
        let Population { setup, numbers, values, .. } = population;
        let GwoOptions { a_start, a_end } = self.options;
        let a = a_start + (a_end - a_start) * (count(self.generation) / count(setup.generations)).min(1.0);
        let width = setup.bounds.len();
        // With fewer than three candidates the last leader takes the missing ranks.
        let last = self.leaders.len() - 1;
        let gene = |axis: usize| Gene {
            bounds: setup.bounds[axis],
            leaders: [0, 1, 2].map(|rank: usize| self.leaders[rank.min(last)].values[axis]),
        };
        // The axes of a tile of candidates, so that the inner loop is long enough to vectorize.
        let genes: Vec<Gene> = (0..TILE * width).map(|n| gene(n % width)).collect();
        each_piece(values.chunks_mut(PIECE * width).zip(numbers), |(values, numbers)| {
            let mut draws = vec![[0; 3]; TILE * width];
            for tile in values.chunks_mut(TILE * width) {
                let draws = &mut draws[..tile.len()];
                numbers.fill(draws.as_flattened_mut());
                move_towards_leaders(a, &genes, draws, tile);
            }
        });
        self.generation += 1;
    }
}

/// Number of candidates that move in one call; a piece has a whole number of tiles.
const TILE: usize = 16;

/// Bounds of one axis of a candidate and the values of the leaders there.
struct Gene {
    bounds: (f64, f64),
    leaders: [f64; 3],
}

/// Moves candidates by Eqs. 9 and 10. The results are equal to the last bit at every feature level, because no operations
/// are fused.
#[multiversion(targets("x86_64+avx2+fma"))]
fn move_towards_leaders(a: f64, genes: &[Gene], draws: &[[u64; 3]], values: &mut [f64]) {
    for ((x, gene), draws) in values.iter_mut().zip(genes).zip(draws) {
        let mut sum = 0.0;
        for (leader, draw) in gene.leaders.iter().zip(draws) {
            let (r1, r2) = split(*draw);
            let big_a = 2.0 * a * r1 - a; // Eq. 9
            let c = 2.0 * r2;
            let d = (c * leader - *x).abs(); // Eq. 10a
            sum += leader - big_a * d; // Eq. 10b
        }
        *x = (sum / 3.0).max(gene.bounds.0).min(gene.bounds.1); // Eq. 10c
    }
}

#[allow(clippy::float_cmp, clippy::cast_possible_truncation, reason = "exact equality is meant")]
#[cfg(test)]
mod tests {
    use super::*;
    use crate::rule::Moving;
    use crate::{Optimizer as _, SearchSettings};

    /// Returns the bits of a draw whose pair is (r1, r2), multiples of 2^-32.
    fn draw(r1: f64, r2: f64) -> u64 {
        let bits = |r: f64| (r * 4_294_967_296.0) as u64;
        bits(r1) << 32 | bits(r2)
    }

    #[test]
    fn one_move_is_equation_10() {
        // By hand, a = 1.5, X = 2, leaders 1, 3, 4. r = (0.75, 0.25): A = 0.75, C = 0.5, D = |0.5 − 2| = 1.5,
        // X1 = 1 − 1.125. r = (0.25, 0.5): A = −0.75, C = 1, D = |3 − 2| = 1, X2 = 3 + 0.75. r = (0.5, 0.75): A = 0,
        // X3 = 4. The mean of −0.125, 3.75 and 4.
        let gene = |max| Gene { bounds: (-10.0, max), leaders: [1.0, 3.0, 4.0] };
        let draws = [[draw(0.75, 0.25), draw(0.25, 0.5), draw(0.5, 0.75)]; 2];
        let mut values = [2.0, 2.0];
        move_towards_leaders(1.5, &[gene(10.0), gene(2.25)], &draws, &mut values);
        assert!((values[0] - 7.625 / 3.0).abs() < 1e-15, "{values:?}");
        assert!((values[1] - 2.25).abs() < 1e-15, "clamped to the box");
    }

    #[test]
    fn leaders_demote() {
        let setup = SearchSettings {
            bounds: vec![(0.0, 1.0)],
            population: 4,
            generations: 2,
            seed: 1,
            ..SearchSettings::default()
        };
        let mut gwo = Moving::new(Gwo::default(), setup).unwrap();
        gwo.tell(&[4.0, 2.0, 3.0, 9.0]);
        let costs = |gwo: &Moving<Gwo>| gwo.rule.leaders.iter().map(|l| l.cost as i32).collect::<Vec<_>>();
        assert_eq!(costs(&gwo), [2, 3, 4]);
        gwo.ask();
        gwo.tell(&[f64::NAN, 1.0, 8.0, 8.0]);
        assert_eq!(costs(&gwo), [1, 2, 3], "a new best pushes alpha to beta and beta to delta");
    }
}
