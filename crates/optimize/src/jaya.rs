//! Jaya (R. V. Rao, Int. J. Ind. Eng. Comput. 7 (2016); Eq. 12, with the primes added that the paper omits).
//!
//! `x'_j = x_j + r₁ (best_j − |x_j|) − r₂ (worst_j − |x_j|)`, clamped to the box. The new candidate replaces the old one
//! only if its cost is not higher. Best and worst are those of the current population.

use super::accepted::Accepted;
use super::numbers::PIECE;
use super::population::{Population, each_piece};
use super::rule::Rule;
use super::table::{Range, SWITCH, search, setting_choice};

/// Sharing of a draw of r₁ and r₂ (one pair for each axis) among candidates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sharing {
    /// One draw for all candidates of a generation.
    #[default]
    Generation,
    /// One draw for each candidate.
    Agent,
}

setting_choice!(Sharing: Sharing::Generation, Sharing::Agent);

search! {
    Jaya = "jaya", "Jaya";
    /// Settings of Jaya.
    pub struct JayaOptions {
        /// Sharing of the random numbers r₁ and r₂: one draw for all candidates of a generation, or one for each.
        sharing: Sharing = Sharing::Generation, "sharing" in Range::Choice(&["generation", "agent"]);
        /// True if a move that increases the cost is rejected (Rao's algorithm); false gives costs of the
        /// magnitude of the paper's, but is not Jaya.
        greedy: bool = true, "greedy" in SWITCH;
    }
}

#[derive(Default)]
struct Jaya {
    options: JayaOptions,
    accepted: Accepted,
}

impl Rule for Jaya {
    fn learn(&mut self, trial: &Population, costs: Vec<f64>) {
        if self.options.greedy {
            self.accepted.take(trial, costs);
        } else {
            self.accepted.replace(trial, costs);
        }
    }

    /// A candidate is accepted only if its cost is not above that of the one it replaces.
    fn cutoffs(&self) -> &[f64] {
        if self.options.greedy { &self.accepted.costs } else { &[] }
    }

    /// Moves every candidate by Eq. 12.
    fn advance(&mut self, trial: &mut Population) {
        let Population { setup, numbers, values, .. } = trial;
        let width = setup.bounds.len();
        let by_cost = |a: &(usize, &f64), b: &(usize, &f64)| a.1.total_cmp(b.1);
        let Accepted { values: kept, costs } = &self.accepted;
        let row = |agent: Option<(usize, &f64)>| self.accepted.row(agent.map_or(0, |(agent, _)| agent), width);
        let best = row(costs.iter().enumerate().min_by(by_cost));
        let worst = row(costs.iter().enumerate().max_by(by_cost));
        let shared: Vec<(f64, f64)> = (0..width).map(|_| numbers[0].pair()).collect();
        let pieces = values.chunks_mut(PIECE * width).zip(kept.chunks(PIECE * width)).zip(numbers);
        each_piece(pieces, |((values, kept), numbers)| {
            let mut r = shared.clone();
            for (trial, kept) in values.chunks_exact_mut(width).zip(kept.chunks_exact(width)) {
                if self.options.sharing == Sharing::Agent {
                    r.fill_with(|| numbers.pair());
                }
                for axis in 0..width {
                    let (x, (r1, r2), (min, max)) = (kept[axis], r[axis], setup.bounds[axis]);
                    let moved = x + r1 * (best[axis] - x.abs()) - r2 * (worst[axis] - x.abs()); // Eq. 12
                    trial[axis] = moved.max(min).min(max);
                }
            }
        });
    }
}

#[allow(clippy::float_cmp, clippy::cast_possible_truncation, reason = "exact equality is meant")]
#[cfg(test)]
mod tests {
    use super::*;
    use crate::rule::Moving;
    use crate::{Optimizer as _, SearchSettings};

    #[test]
    fn one_move_is_equation_12_and_greedy() {
        let setup = SearchSettings {
            bounds: vec![(-100.0, 100.0)],
            population: 3,
            generations: 3,
            seed: 5,
            ..SearchSettings::default()
        };
        let mut jaya = Moving::new(Jaya::default(), setup.clone()).unwrap();
        let first = jaya.ask().values().to_vec();
        jaya.tell(&[2.0, 1.0, 3.0]);
        let (r1, r2) = {
            let mut numbers = Population::new(setup).unwrap().numbers;
            numbers[0].pair()
        };
        let second = jaya.ask().values().to_vec();
        for (x, moved) in first.iter().zip(&second) {
            let expected = x + r1 * (first[1] - x.abs()) - r2 * (first[2] - x.abs());
            assert!((moved - expected.clamp(-100.0, 100.0)).abs() < 1e-12, "{moved} {expected}");
        }
        // The first candidate's move is worse and rejected; the second's is equal and accepted; the third's is better and
        // accepted.
        jaya.tell(&[2.5, 1.0, 0.5]);
        assert_eq!(jaya.rule.accepted.values, [first[0], second[1], second[2]]);
        assert_eq!(jaya.rule.accepted.costs, [2.0, 1.0, 0.5]);
    }
}
