//! Cuckoo search (X.-S. Yang, S. Deb, NaBIC 2009; as in the program of X.-S. Yang, Nature-Inspired Metaheuristic Algorithms, 2010).
//!
//! Generations alternate. In the first, each nest moves by a Lévy flight relative to the best one, `x' = x + α L (x − best) n` for
//! each axis with n normal and L of Mantegna's algorithm: `u / |v|^(1/β)` with normal u of deviation σ(β) and v of 1. In the second,
//! a part pa of the values is kept and the others move by the difference of two permutations of the nests times one uniform number. A
//! trial replaces its nest if its cost is not higher.

use super::accepted::Accepted;
use super::numbers::{Numbers, PIECE};
use super::population::{Population, each_piece};
use super::rule::Rule;
use super::table::{NOT_NEGATIVE, PROBABILITY, Range, search};

search! {
    Cuckoo = "cuckoo", "Cuckoo search";
    /// Settings of the cuckoo search.
    pub struct CuckooOptions {
        /// Fraction of the values that remain when nests are abandoned.
        pa: f64 = 0.25, "pa" in PROBABILITY;
        /// Scale of the Lévy flights.
        alpha: f64 = 0.01, "alpha" in NOT_NEGATIVE;
        /// Exponent of the Lévy flights.
        beta: f64 = 1.5, "beta" in Range::Number(1.0, 1.99, true);
    }
}

#[derive(Default)]
struct Cuckoo {
    options: CuckooOptions,
    accepted: Accepted,
    /// True if the present trials are those of abandoned nests.
    is_abandoned: bool,
}

/// Returns the deviation of u in Mantegna's algorithm.
fn mantegna(beta: f64) -> f64 {
    let above = libm::tgamma(1.0 + beta) * libm::sin(std::f64::consts::FRAC_PI_2 * beta);
    let below = libm::tgamma(f64::midpoint(1.0, beta)) * beta * libm::exp2(0.5 * (beta - 1.0));
    libm::pow(above.max(0.0) / below, 1.0 / beta)
}

/// Returns a random permutation.
fn permutation(numbers: &mut Numbers, count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    for last in (1..count).rev() {
        order.swap(last, numbers.below(last + 1));
    }
    order
}

impl Cuckoo {
    fn fly(&self, trials: &mut Population) {
        let Population { setup, numbers, values, .. } = trials;
        let (width, CuckooOptions { alpha, beta, .. }) = (setup.bounds.len(), self.options);
        let (deviation, power) = (mantegna(beta), -1.0 / beta);
        let costs = self.accepted.costs.iter().enumerate();
        let best = costs.min_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(nest, _)| nest);
        let best = self.accepted.row(best, width);
        each_piece(values.chunks_mut(PIECE * width).zip(numbers).enumerate(), |(piece, (values, numbers))| {
            for (nest, trial) in (piece * PIECE..).zip(values.chunks_exact_mut(width)) {
                let own = self.accepted.row(nest, width);
                for axis in 0..width {
                    let ((min, max), x) = (setup.bounds[axis], own[axis]);
                    let flight = deviation * numbers.normal() * libm::pow(numbers.normal().abs(), power);
                    let moved = x + alpha * flight * (x - best[axis]) * numbers.normal();
                    // A flight of the best nest is 0 times a number that may be infinite.
                    trial[axis] = if moved.is_nan() { x } else { moved.max(min).min(max) };
                }
            }
        });
    }

    fn abandon(&self, trials: &mut Population) {
        let Population { setup, numbers, values, .. } = trials;
        let (width, count) = (setup.bounds.len(), self.accepted.costs.len());
        let [first, second] = [0; 2].map(|_| permutation(&mut numbers[0], count));
        let scale = numbers[0].unit();
        each_piece(values.chunks_mut(PIECE * width).zip(numbers).enumerate(), |(piece, (values, numbers))| {
            for (nest, trial) in (piece * PIECE..).zip(values.chunks_exact_mut(width)) {
                let [own, a, b] = [nest, first[nest], second[nest]].map(|nest| self.accepted.row(nest, width));
                for axis in 0..width {
                    let (min, max) = setup.bounds[axis];
                    let step = if numbers.unit() > self.options.pa { scale * (a[axis] - b[axis]) } else { 0.0 };
                    trial[axis] = (own[axis] + step).max(min).min(max);
                }
            }
        });
    }
}

impl Rule for Cuckoo {
    fn learn(&mut self, trials: &Population, costs: Vec<f64>) {
        self.is_abandoned = !self.is_abandoned && !self.accepted.costs.is_empty();
        self.accepted.take(trials, costs);
    }

    fn cutoffs(&self) -> &[f64] {
        &self.accepted.costs
    }

    fn advance(&mut self, trials: &mut Population) {
        if self.is_abandoned { self.abandon(trials) } else { self.fly(trials) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rule::Moving;
    use crate::{Optimizer as _, SearchSettings};

    fn setup() -> SearchSettings {
        let bounds = vec![(-1.0, 3.0), (10.0, 20.0)];
        SearchSettings { bounds, population: 5, seed: 5, ..SearchSettings::default() }
    }

    #[test]
    fn the_deviation_of_mantegna() {
        // σ(1.5) = 0.696575 (R. N. Mantegna, Phys. Rev. E 49 (1994), table I). At 2 Mantegna's u is zero.
        assert!((mantegna(1.5) - 0.696_575).abs() < 1e-6, "{}", mantegna(1.5));
        assert!(mantegna(2.0) < 1e-7);
    }

    /// Compares generations with the formula evaluated nest by nest from the same random numbers.
    #[test]
    fn generations_are_the_formula() {
        let mut search = Moving::new(Cuckoo::default(), setup()).unwrap();
        let numbers = &mut Population::new(setup()).unwrap().numbers[0];
        let mut nests: Vec<[f64; 2]> = search.ask().values().chunks(2).map(|row| [row[0], row[1]]).collect();
        let cost = |x: &[f64]| (x[0] - 2.9).powi(2) + (x[1] - 10.1).abs();
        let mut costs: Vec<f64> = nests.iter().map(|x| cost(x)).collect();
        search.tell(&costs);
        let mut moved = [0; 2];
        for generation in 0..40 {
            let best = nests[(0..5).min_by(|a, b| costs[*a].total_cmp(&costs[*b])).unwrap()];
            let is_abandoned = generation % 2 == 1;
            let orders = if is_abandoned { [0; 2].map(|_| permutation(numbers, 5)) } else { [Vec::new(), Vec::new()] };
            let scale = if is_abandoned { numbers.unit() } else { 0.0 };
            let mut trials = nests.clone();
            for (n, trial) in trials.iter_mut().enumerate() {
                for (axis, (min, max)) in setup().bounds.into_iter().enumerate() {
                    let x = trial[axis];
                    let next = if is_abandoned {
                        let keeps = numbers.unit() <= 0.25;
                        let difference = nests[orders[0][n]][axis] - nests[orders[1][n]][axis];
                        if keeps { x } else { x + scale * difference }
                    } else {
                        let (u, v, normal) =
                            (0.696_574_502_557_696_1 * numbers.normal(), numbers.normal(), numbers.normal());
                        x + 0.01 * u / v.abs().powf(1.0 / 1.5) * (x - best[axis]) * normal
                    };
                    trial[axis] = next.clamp(min, max);
                }
            }
            for (found, expected) in search.ask().values().iter().zip(trials.as_flattened()) {
                assert!((found - expected).abs() < 1e-9, "generation {generation}: {found} {expected}");
            }
            let found: Vec<f64> = trials.iter().map(|x| cost(x)).collect();
            search.tell(&found);
            for n in 0..5 {
                if found[n] <= costs[n] {
                    moved[usize::from(is_abandoned)] += usize::from(found[n] < costs[n]);
                    (costs[n], nests[n]) = (found[n], trials[n]);
                }
            }
        }
        assert!(moved.iter().all(|moved| *moved > 3), "{moved:?}");
    }
}
