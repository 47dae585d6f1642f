//! Grey Wolf Optimizer (S. Mirjalili, S. M. Mirjalili, A. Lewis, Adv. Eng. Softw. 69 (2014); the paper's Eqs. 8–10).
//!
//! All agents move towards the three best ever seen (alpha, beta, delta), then all are evaluated. A new best pushes
//! the old alpha to beta and beta to delta. `A = 2a r₁ − a`, `C = 2 r₂`, with r₁, r₂ uniform in \[0, 1) for each leader,
//! axis and agent; a falls in equal steps from `a_start` towards `a_end` over the generations. Agents stay in the box.

use super::population::{Population, Setup, ordered, split};
use super::{Best, Optimizer};
use crate::candidates::Candidates;
use crate::{Error, Result};
use multiversion::multiversion;

/// Settings of the Grey Wolf Optimizer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GwoOptions {
    /// a at the first move; move g of G generations (g from 0) has `a_start + (a_end − a_start) g/G`.
    pub a_start: f64,
    /// What a falls towards.
    pub a_end: f64,
}

impl Default for GwoOptions {
    fn default() -> Self {
        Self { a_start: 2.0, a_end: 0.0 }
    }
}

#[derive(Debug, Clone)]
struct Leader {
    cost: f64,
    values: Vec<f64>,
}

/// A run of the Grey Wolf Optimizer.
#[derive(Debug, Clone)]
pub struct Gwo {
    options: GwoOptions,
    population: Population,
    /// Alpha, beta, delta: the best first.
    leaders: Vec<Leader>,
    generation: usize,
    told: bool,
}

impl Gwo {
    /// A new run.
    ///
    /// # Errors
    /// `Usage` for an empty box or population, or a that is negative or not finite.
    pub fn new(setup: Setup, options: GwoOptions) -> Result<Self> {
        if [options.a_start, options.a_end].iter().any(|a| !(a.is_finite() && *a >= 0.0)) {
            return Err(Error::usage(
                "a of the Grey Wolf Optimizer is negative or not finite",
                "Give a=2 or the like.",
            ));
        }
        Ok(Self { options, population: Population::new(setup)?, leaders: Vec::new(), generation: 0, told: false })
    }

    /// Alpha, beta and delta are the best three ever told.
    fn update_leaders(&mut self, costs: &[f64]) {
        for (agent, &cost) in costs.iter().enumerate() {
            let rank = self.leaders.partition_point(|leader| leader.cost <= cost);
            if rank < 3 {
                self.leaders.insert(rank, Leader { cost, values: self.population.row(agent).to_vec() });
                self.leaders.truncate(3);
            }
        }
    }

    /// Eq. 10 for every agent.
    fn hunt(&mut self) {
        let generations = self.population.setup.generations as f64;
        let GwoOptions { a_start, a_end } = self.options;
        let a = a_start + (a_end - a_start) * (self.generation as f64 / generations).min(1.0);
        let Population { setup, numbers, values, .. } = &mut self.population;
        let width = setup.bounds.len();
        // Fewer than three agents: the last leader stands in for those that are missing.
        let last = self.leaders.len() - 1;
        let gene = |axis: usize| Gene {
            bounds: setup.bounds[axis],
            leaders: [0, 1, 2].map(|rank: usize| self.leaders[rank.min(last)].values[axis]),
        };
        // The genes of a tile of agents, so that the loop over them is long enough to vectorize.
        let genes: Vec<Gene> = (0..TILE * width).map(|n| gene(n % width)).collect();
        let mut draws = vec![[0; 3]; TILE * width];
        for tile in values.chunks_mut(TILE * width) {
            let draws = &mut draws[..tile.len()];
            numbers.fill(draws.as_flattened_mut());
            move_towards_leaders(a, &genes, draws, tile);
        }
    }
}

/// Agents that move together.
const TILE: usize = 16;

/// One axis of an agent: where it may be and where the leaders are.
struct Gene {
    bounds: (f64, f64),
    leaders: [f64; 3],
}

/// Eqs. 9 and 10; the same to the last bit at every feature level, because nothing is fused.
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

impl Optimizer for Gwo {
    fn ask(&mut self) -> Candidates<'_> {
        if self.told {
            self.hunt();
            self.generation += 1;
            self.told = false;
        }
        self.population.candidates()
    }

    fn tell(&mut self, costs: &[f64]) {
        let costs = ordered(costs);
        self.update_leaders(&costs);
        self.population.note(&costs);
        self.told = true;
    }

    fn best(&self) -> Option<Best<'_>> {
        self.population.best()
    }
}
