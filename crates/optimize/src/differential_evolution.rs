//! Differential evolution rand/1/bin (R. Storn, K. Price, J. Global Optim. 11 (1997), Eqs. 2 to 5).
//!
//! A mutant is `v = x_a + F (x_b − x_c)` of three other candidates; a trial takes each value from the mutant with probability CR,
//! at least one, and otherwise from its parent, which it replaces if its cost is not higher. A value outside of the box is placed
//! half-way between the parent and the bound. The search does not depend on the origin, the direction or the scale of an axis.

use super::accepted::Accepted;
use super::numbers::{Numbers, PIECE};
use super::population::{Population, each_piece};
use super::rule::Rule;
use super::table::{PROBABILITY, Range, search};

search! {
    DifferentialEvolution = "de", "Differential evolution rand/1/bin";
    /// Settings of differential evolution.
    pub struct DifferentialEvolutionOptions {
        /// Factor of the difference of two candidates.
        f: f64 = 0.5, "f" in Range::Number(0.0, 2.0, true);
        /// Probability that a value is taken from the mutant.
        cr: f64 = 0.9, "cr" in PROBABILITY;
    }
}

#[derive(Default)]
struct DifferentialEvolution {
    options: DifferentialEvolutionOptions,
    accepted: Accepted,
}

/// Returns an index below `count` that is none of `taken`, which differ from each other; any index if there are too few.
#[inline]
pub(super) fn other(numbers: &mut Numbers, count: usize, taken: &[usize]) -> usize {
    loop {
        let index = numbers.below(count);
        if count <= taken.len() || !taken.contains(&index) {
            return index;
        }
    }
}

/// Writes a trial by binomial crossover: each value is that of the mutant with probability `cr`, moved back into its bounds, and otherwise
/// that of the parent; one value is certainly that of the mutant.
#[inline]
pub(super) fn cross(
    numbers: &mut Numbers,
    cr: f64,
    (parent, bounds): (&[f64], &[(f64, f64)]),
    trial: &mut [f64],
    mutant: impl Fn(usize) -> f64,
) {
    let certain = numbers.below(trial.len());
    for (axis, value) in trial.iter_mut().enumerate() {
        let is_crossed = numbers.unit() < cr || axis == certain;
        *value = if is_crossed { back_inside(mutant(axis), parent[axis], bounds[axis]) } else { parent[axis] };
    }
}

/// Returns a value, or if it is outside of the bounds the mean of the parent and the bound that it exceeds (J. Zhang,
/// A. C. Sanderson, IEEE Trans. Evol. Comput. 13 (2009)).
#[inline]
fn back_inside(value: f64, parent: f64, (min, max): (f64, f64)) -> f64 {
    if value < min {
        0.5 * (parent + min)
    } else if value > max {
        0.5 * (parent + max)
    } else {
        value
    }
}

impl Rule for DifferentialEvolution {
    fn learn(&mut self, trials: &Population, costs: Vec<f64>) {
        self.accepted.take(trials, costs);
    }

    fn cutoffs(&self) -> &[f64] {
        &self.accepted.costs
    }

    fn advance(&mut self, trials: &mut Population) {
        let Population { setup, numbers, values, .. } = trials;
        let (width, DifferentialEvolutionOptions { f, cr }) = (setup.bounds.len(), self.options);
        let (accepted, count) = (&self.accepted, self.accepted.costs.len());
        each_piece(values.chunks_mut(PIECE * width).zip(numbers).enumerate(), |(piece, (values, numbers))| {
            for (agent, trial) in (piece * PIECE..).zip(values.chunks_exact_mut(width)) {
                let mut drawn = [agent; 4];
                for n in 1..4 {
                    drawn[n] = other(numbers, count, &drawn[..n]);
                }
                let [parent, a, b, c] = drawn.map(|index| accepted.row(index, width));
                let mutant = |axis: usize| a[axis] + f * (b[axis] - c[axis]);
                cross(numbers, cr, (parent, &setup.bounds), trial, mutant);
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rule::Moving;
    use crate::{Optimizer as _, SearchSettings};

    fn setup(population: usize) -> SearchSettings {
        let bounds = vec![(-1.0, 3.0), (10.0, 20.0), (0.0, 1.0)];
        SearchSettings { bounds, population, generations: 4, seed: 5, run: 2, ..SearchSettings::default() }
    }

    /// Compares generations with the formula evaluated candidate by candidate from the same random numbers.
    #[test]
    fn generations_are_the_formula() {
        let options = DifferentialEvolutionOptions { f: 0.8, cr: 0.4 };
        let mut search =
            Moving::new(DifferentialEvolution { options, ..DifferentialEvolution::default() }, setup(7)).unwrap();
        let numbers = &mut Population::new(setup(7)).unwrap().numbers[0];
        let mut kept: Vec<[f64; 3]> = search.ask().values().chunks(3).map(|row| [row[0], row[1], row[2]]).collect();
        let mut trials = kept.clone();
        let mut lowest = [f64::INFINITY; 7];
        let (mut replaced, mut repaired) = (0, 0);
        for _ in 0..30 {
            let costs: Vec<f64> = trials.iter().map(|[a, b, c]| (a - 2.9).powi(2) + (b - 10.1).abs() + c).collect();
            search.tell(&costs);
            for n in 0..7 {
                if costs[n] <= lowest[n] {
                    (lowest[n], kept[n]) = (costs[n], trials[n]);
                    replaced += 1;
                }
            }
            for n in 0..7 {
                let mut drawn = Vec::new();
                while drawn.len() < 3 {
                    let index = numbers.below(7);
                    if index != n && !drawn.contains(&index) {
                        drawn.push(index);
                    }
                }
                let certain = numbers.below(3);
                for (axis, (min, max)) in setup(7).bounds.into_iter().enumerate() {
                    let mut mutant = kept[drawn[0]][axis] + 0.8 * (kept[drawn[1]][axis] - kept[drawn[2]][axis]);
                    if mutant < min || mutant > max {
                        mutant = (kept[n][axis] + if mutant < min { min } else { max }) / 2.0;
                        repaired += 1;
                    }
                    let is_crossed = numbers.unit() < 0.4 || axis == certain;
                    trials[n][axis] = if is_crossed { mutant } else { kept[n][axis] };
                }
            }
            for (found, expected) in search.ask().values().iter().zip(trials.as_flattened()) {
                assert!((found - expected).abs() < 1e-12, "{found} {expected}");
            }
        }
        assert!(replaced > 20 && repaired > 20, "{replaced} {repaired}");
    }

    #[test]
    fn small_populations_draw_what_there_is() {
        let numbers = &mut Population::new(setup(1)).unwrap().numbers[0];
        for _ in 0..100 {
            assert_eq!(other(numbers, 3, &[0, 2]), 1);
            assert!(other(numbers, 2, &[0, 1, 1]) < 2);
        }
    }
}
