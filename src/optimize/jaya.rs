//! Jaya (R. V. Rao, Int. J. Ind. Eng. Comput. 7 (2016); the paper's Eq. 12 with its primes put back).
//!
//! `x'_j = x_j + r₁ (best_j − |x_j|) − r₂ (worst_j − |x_j|)`, clamped to the box; the new agent replaces the old one
//! only if its cost is not higher. Best and worst are those of the present population.

use super::population::{Population, SearchSettings, ordered};
use super::table::{Hyperparameter, Range, SWITCH, Search, SettingValue, Values, search, setting_choice};
use super::{Best, Optimizer, SearchOptions as _};
use crate::Result;
use crate::candidates::Candidates;

/// For whom a draw of r₁ and r₂ (one pair per axis) holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sharing {
    /// All agents of a generation.
    #[default]
    Generation,
    /// One agent.
    Agent,
}

setting_choice!(Sharing: Sharing::Generation, Sharing::Agent);

search! {
    Jaya = "jaya", "Jaya";
    /// Settings of Jaya.
    pub struct JayaOptions {
        /// Who shares a draw of r₁ and r₂: all agents of a generation, or the axes of one agent.
        sharing: Sharing = Sharing::Generation, "sharing" in Range::Choice(&["generation", "agent"]);
        /// Whether a move that raises the cost is taken back (Rao's algorithm). Without it the search is not Jaya any
        /// more; it reproduces the paper's results.
        greedy: bool = true, "greedy" in SWITCH;
    }
}

/// A run of Jaya.
#[derive(Debug, Clone)]
pub struct Jaya {
    options: JayaOptions,
    /// What is evaluated next.
    trial: Population,
    /// The agents that were kept, and their costs.
    kept: Vec<f64>,
    costs: Vec<f64>,
    told: bool,
}

impl Jaya {
    /// A new run.
    ///
    /// # Errors
    /// `Usage` for an empty box or population.
    pub fn new(setup: SearchSettings, options: JayaOptions) -> Result<Self> {
        Ok(Self { options, trial: Population::new(setup)?, kept: Vec::new(), costs: Vec::new(), told: false })
    }

    /// Eq. 12 for every agent.
    fn move_agents(&mut self) {
        let width = self.trial.width();
        let by_cost = |a: &(usize, &f64), b: &(usize, &f64)| a.1.total_cmp(b.1);
        let row = |agent: Option<(usize, &f64)>| {
            let agent = agent.map_or(0, |(agent, _)| agent);
            self.kept[agent * width..(agent + 1) * width].to_vec()
        };
        let best = row(self.costs.iter().enumerate().min_by(by_cost));
        let worst = row(self.costs.iter().enumerate().max_by(by_cost));
        let Population { setup, numbers, values, .. } = &mut self.trial;
        let mut r: Vec<(f64, f64)> = (0..width).map(|_| numbers.pair()).collect();
        for (trial, kept) in values.chunks_exact_mut(width).zip(self.kept.chunks_exact(width)) {
            if self.options.sharing == Sharing::Agent {
                r.fill_with(|| numbers.pair());
            }
            for axis in 0..width {
                let (x, (r1, r2), (min, max)) = (kept[axis], r[axis], setup.bounds[axis]);
                let moved = x + r1 * (best[axis] - x.abs()) - r2 * (worst[axis] - x.abs()); // Eq. 12
                trial[axis] = moved.max(min).min(max);
            }
        }
    }
}

impl Optimizer for Jaya {
    fn ask(&mut self) -> Candidates<'_> {
        if self.told {
            self.move_agents();
            self.told = false;
        }
        self.trial.candidates()
    }

    fn tell(&mut self, costs: &[f64]) {
        let costs = ordered(costs);
        self.trial.note(&costs);
        if self.costs.is_empty() || !self.options.greedy {
            self.kept.clone_from(&self.trial.values);
            self.costs = costs;
        } else {
            let width = self.trial.width();
            for (agent, cost) in costs.into_iter().enumerate() {
                if cost <= self.costs[agent] {
                    self.costs[agent] = cost;
                    let row = agent * width..(agent + 1) * width;
                    self.kept[row.clone()].copy_from_slice(&self.trial.values[row]);
                }
            }
        }
        self.told = true;
    }

    fn best(&self) -> Option<Best<'_>> {
        self.trial.best()
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, clippy::cast_possible_truncation, reason = "exact equality is meant")]
mod tests {
    use super::*;

    #[test]
    fn one_move_is_equation_12_and_greedy() {
        let setup = SearchSettings { bounds: vec![(-100.0, 100.0)], population: 3, generations: 3, seed: 5, run: 0 };
        let mut jaya = Jaya::new(setup.clone(), JayaOptions::default()).unwrap();
        let first = jaya.ask().values().to_vec();
        jaya.tell(&[2.0, 1.0, 3.0]);
        let (r1, r2) = {
            let mut numbers = Population::new(setup).unwrap().numbers;
            numbers.pair()
        };
        let second = jaya.ask().values().to_vec();
        for (x, moved) in first.iter().zip(&second) {
            let expected = x + r1 * (first[1] - x.abs()) - r2 * (first[2] - x.abs());
            assert!((moved - expected.clamp(-100.0, 100.0)).abs() < 1e-12, "{moved} {expected}");
        }
        // The first agent gets worse and stays; the second stays as good and moves; the third improves and moves.
        jaya.tell(&[2.5, 1.0, 0.5]);
        assert_eq!(jaya.kept, [first[0], second[1], second[2]]);
        assert_eq!(jaya.costs, [2.0, 1.0, 0.5]);
    }
}
