//! L-SHADE: differential evolution whose parameters adapt to success, with a population that shrinks linearly (R. Tanabe,
//! A. S. Fukunaga, IEEE CEC 2014; the adaptation is that of SHADE, IEEE CEC 2013).
//!
//! A mutant is `v = x + F (x_pbest − x) + F (x_a − x_b)`: x_pbest is one of the best candidates, x_b a candidate or a replaced parent
//! from an archive. CR is normal and F Cauchy distributed about a random entry of a memory; the memory takes the weighted Lehmer means
//! of those values that made a trial better than its parent. The population shrinks from its setting to four over the evaluations of
//! the budget.

use super::accepted::Accepted;
use super::differential_evolution::{cross, other};
use super::numbers::{Numbers, PIECE};
use super::population::{Population, each_piece};
use super::rule::Rule;
use super::table::{Range, search};
use motorfit_core::numeric::{count, whole};

search! {
    Lshade = "lshade", "L-SHADE";
    /// Settings of L-SHADE.
    pub struct LshadeOptions {
        /// Number of entries of the memory of successful parameters.
        memory: usize = 6, "memory" in Range::Count(1000);
        /// Size of the archive, relative to the population.
        archive: f64 = 2.6, "archive" in Range::Number(0.0, 100.0, false);
        /// Fraction of the population from which the best candidate of a mutation is drawn.
        best: f64 = 0.11, "best" in Range::Number(0.0, 1.0, true);
    }
}

/// Smallest population: a mutation needs four candidates.
const SMALLEST: usize = 4;
/// First value of each entry of the memory.
const MEMORY_START: f64 = 0.5;
/// Scale of the distributions of CR and F.
const SPREAD: f64 = 0.1;
/// Cost that stands for that of a candidate that diverged, in the weights of successes.
const DIVERGED: f64 = 1e30;

#[derive(Default)]
struct Lshade {
    options: LshadeOptions,
    accepted: Accepted,
    /// Values of replaced parents, row-major.
    archive: Vec<f64>,
    memory: Memory,
    /// The parameters of each trial of this generation.
    drawn: Vec<Drawn>,
    evaluations: usize,
}

/// Parameters of a mutation.
#[derive(Clone, Copy, Default)]
struct Drawn {
    f: f64,
    cr: f64,
}

/// The memory of successful parameters.
#[derive(Default)]
struct Memory {
    entries: Vec<Drawn>,
    next: usize,
}

/// A trial that was better than its parent.
struct Success {
    drawn: Drawn,
    gain: f64,
}

impl Memory {
    /// Draws the parameters of a trial about a random entry. A CR that became zero remains zero.
    fn draw(&self, numbers: &mut Numbers) -> Drawn {
        let about = self.entries[numbers.below(self.entries.len())];
        let cr = if about.cr < 0.0 { 0.0 } else { (about.cr + SPREAD * numbers.normal()).clamp(0.0, 1.0) };
        let f = loop {
            let f = about.f + SPREAD * numbers.cauchy();
            if f > 0.0 {
                break f.min(1.0);
            }
        };
        Drawn { f, cr }
    }

    /// Replaces an entry by the means of the successful parameters, weighted by their gains: Lehmer means `Σ w s² / Σ w s`.
    fn learn(&mut self, successes: &[Success]) {
        let total: f64 = successes.iter().map(|success| success.gain).sum();
        if successes.is_empty() || !total.is_finite() || total <= 0.0 {
            return;
        }
        let lehmer = |of: &dyn Fn(&Drawn) -> f64| {
            let sum = |power: i32| successes.iter().map(|s| s.gain / total * of(&s.drawn).powi(power)).sum::<f64>();
            let below = sum(1);
            if below > 0.0 { sum(2) / below } else { 0.0 }
        };
        let largest = successes.iter().map(|success| success.drawn.cr).fold(0.0, f64::max);
        let entry = &mut self.entries[self.next];
        // A negative CR marks the terminal value, from which an entry does not return.
        let cr = if entry.cr < 0.0 || largest <= 0.0 { -1.0 } else { lehmer(&|drawn| drawn.cr) };
        *entry = Drawn { f: lehmer(&|drawn| drawn.f), cr };
        self.next = (self.next + 1) % self.entries.len();
    }
}

impl Lshade {
    fn row(&self, index: usize, width: usize) -> &[f64] {
        let (rows, index) = match index.checked_sub(self.accepted.costs.len()) {
            Some(index) => (&self.archive, index),
            None => (&self.accepted.values, index),
        };
        &rows[index * width..(index + 1) * width]
    }

    /// Removes the worst candidates above the size that the evaluations so far leave, and random parents from the archive.
    fn shrink(&mut self, population: &mut Population) {
        let (full, width) = (population.setup.population, population.width());
        let spent = count(self.evaluations) / (count(full) * count(population.setup.generations));
        let size = whole((count(full) - (count(full) - count(SMALLEST)) * spent).round()).max(SMALLEST);
        if size < self.accepted.costs.len() {
            let mut order = self.lowest(size);
            order.sort_unstable();
            for (place, &agent) in order.iter().enumerate() {
                self.accepted.values.copy_within(agent * width..(agent + 1) * width, place * width);
                self.accepted.costs[place] = self.accepted.costs[agent];
            }
            self.accepted.values.truncate(size * width);
            self.accepted.costs.truncate(size);
        }
        population.values.truncate(self.accepted.values.len());
        let largest = whole((self.options.archive * count(self.accepted.costs.len())).round());
        while self.archive.len() > largest * width {
            let (last, out) = (self.archive.len() - width, population.numbers[0].below(self.archive.len() / width));
            self.archive.copy_within(last.., out * width);
            self.archive.truncate(last);
        }
    }

    /// Returns the indices of the candidates of lowest cost from which a mutation draws, at least two.
    fn best(&self) -> Vec<usize> {
        self.lowest(whole((self.options.best * count(self.accepted.costs.len())).round()).max(2))
    }

    /// Returns the indices of the `size` candidates of lowest cost, in no particular order.
    fn lowest(&self, size: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.accepted.costs.len()).collect();
        if size < order.len() {
            order.select_nth_unstable_by(size, |a, b| self.accepted.costs[*a].total_cmp(&self.accepted.costs[*b]));
            order.truncate(size);
        }
        order
    }
}

impl Rule for Lshade {
    fn learn(&mut self, trials: &Population, costs: Vec<f64>) {
        self.evaluations += costs.len();
        if self.memory.entries.is_empty() {
            self.memory.entries = vec![Drawn { f: MEMORY_START, cr: MEMORY_START }; self.options.memory.max(1)];
        }
        let (archive, drawn, mut successes) = (&mut self.archive, &self.drawn, Vec::new());
        self.accepted.take_after(trials, costs, |agent, parent, [own, cost]| {
            if cost < own {
                archive.extend_from_slice(parent);
                successes.push(Success { drawn: drawn[agent], gain: own.min(DIVERGED) - cost.min(DIVERGED) });
            }
        });
        self.memory.learn(&successes);
    }

    fn cutoffs(&self) -> &[f64] {
        &self.accepted.costs
    }

    fn changes_size(&self) -> bool {
        true
    }

    fn advance(&mut self, trials: &mut Population) {
        self.shrink(trials);
        let best = self.best();
        let mut drawn = std::mem::take(&mut self.drawn);
        drawn.clear();
        drawn.resize(self.accepted.costs.len(), Drawn::default());
        let Population { setup, numbers, values, .. } = trials;
        let width = setup.bounds.len();
        let (agents, all) = (self.accepted.costs.len(), self.accepted.costs.len() + self.archive.len() / width);
        let pieces = values.chunks_mut(PIECE * width).zip(drawn.chunks_mut(PIECE)).zip(numbers).enumerate();
        each_piece(pieces, |(piece, ((values, drawn), numbers))| {
            for ((agent, trial), drawn) in (piece * PIECE..).zip(values.chunks_exact_mut(width)).zip(drawn) {
                *drawn = self.memory.draw(numbers);
                let leader = self.row(best[numbers.below(best.len())], width);
                let a = other(numbers, agents, &[agent]);
                let b = other(numbers, all, &[agent, a]);
                let (a, b, parent) = (self.row(a, width), self.row(b, width), self.row(agent, width));
                let f = drawn.f;
                let mutant = |axis: usize| parent[axis] + f * (leader[axis] - parent[axis]) + f * (a[axis] - b[axis]);
                cross(numbers, drawn.cr, (parent, &setup.bounds), trial, mutant);
            }
        });
        self.drawn = drawn;
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
        SearchSettings { bounds, population: 20, generations: 10, seed: 5, ..SearchSettings::default() }
    }

    #[test]
    fn the_memory_takes_weighted_lehmer_means() {
        let start = Drawn { f: 0.5, cr: 0.5 };
        let mut memory = Memory { entries: vec![start; 2], next: 0 };
        let success = |f: f64, cr: f64, gain: f64| Success { drawn: Drawn { f, cr }, gain };
        // By hand, weights 1/4 and 3/4. F: (0.25/4 + 3·0.81/4) / (0.5/4 + 3·0.9/4) = 0.67/0.8; CR: 0.28/0.5.
        memory.learn(&[success(0.5, 0.2, 1.0), success(0.9, 0.6, 3.0)]);
        assert!((memory.entries[0].f - 0.8375).abs() < 1e-15 && (memory.entries[0].cr - 0.56).abs() < 1e-15);
        assert_eq!((memory.entries[1].f, memory.next), (0.5, 1));
        memory.learn(&[]);
        assert_eq!(memory.next, 1, "nothing is learnt without success");
        // A CR of zero in all successes is terminal.
        memory.learn(&[success(0.7, 0.0, 1.0)]);
        memory.learn(&[success(0.5, 0.5, 1.0)]);
        memory.learn(&[success(0.5, 0.5, 1.0)]);
        assert!(memory.entries[1].cr < 0.0 && memory.entries[0].cr == 0.5);
    }

    #[test]
    fn parameters_have_their_distributions() {
        let numbers = &mut Population::new(setup()).unwrap().numbers[0];
        let memory = Memory { entries: vec![Drawn { f: 0.5, cr: 0.3 }], next: 0 };
        let drawn: Vec<Drawn> = (0..40_000).map(|_| memory.draw(numbers)).collect();
        let share = |is: &dyn Fn(&Drawn) -> bool| count(drawn.iter().filter(|one| is(one)).count()) / 40_000.0;
        // CR is normal with σ = 0.1: 0.8413 are below 0.4. F is Cauchy with scale 0.1, drawn again below 0: P(F > 0) = 1/2 + atan(5)/π
        // = 0.9372, P(F ≥ 1) = 0.0628 of all. The tolerance is four standard deviations of a share of 1/2 and less.
        assert!((share(&|one| one.cr < 0.4) - 0.8413).abs() < 0.01);
        assert!((share(&|one| one.f == 1.0) - 0.0628 / 0.9372).abs() < 0.01);
        assert!((share(&|one| one.f > 0.6) - 0.25 / 0.9372).abs() < 0.01);
        let never = Memory { entries: vec![Drawn { f: 0.5, cr: -1.0 }], next: 0 };
        assert!((0..100).all(|_| never.draw(numbers).cr == 0.0));
    }

    /// Compares generations with the formula evaluated candidate by candidate from the same random numbers.
    #[test]
    fn generations_are_the_formula_and_shrink_linearly() {
        let mut search = Moving::new(Lshade::default(), setup()).unwrap();
        let (mut evaluations, mut archived) = (0, 0);
        while search.ask().count() > 0 {
            let asked = search.ask();
            let costs: Vec<f64> =
                asked.values().chunks(2).map(|x| (x[0] - 2.9).powi(2) + (x[1] - 10.1).abs()).collect();
            evaluations += costs.len();
            search.tell(&costs);
            let mut mirror = search.population.numbers[0].clone();
            let (before, archive) = (search.rule.accepted.values.clone(), search.rule.archive.len() / 2);
            search.ask();
            let Moving { rule, population, .. } = &search;
            if evaluations == 200 {
                break;
            }
            let size = whole((20.0 - 16.0 * count(evaluations) / 200.0).round());
            assert_eq!((rule.accepted.costs.len(), population.values.len()), (size, 2 * size), "after {evaluations}");
            assert!(rule.archive.len() / 2 <= whole((2.6 * count(size)).round()));
            archived = archived.max(archive);
            if before.len() != rule.accepted.values.len() || archive != rule.archive.len() / 2 {
                continue;
            }
            let all = [&rule.accepted.values[..], &rule.archive[..]].concat();
            let mut order: Vec<usize> = (0..size).collect();
            order.sort_by(|a, b| rule.accepted.costs[*a].total_cmp(&rule.accepted.costs[*b]));
            order.truncate(whole((0.11 * count(size)).round()).max(2));
            for n in 0..size {
                let Drawn { f, cr } = rule.memory.draw(&mut mirror);
                // The set of the best is the same; its order is that of the selection.
                let leader = rule.best()[mirror.below(order.len())];
                assert!(order.contains(&leader));
                let mut draw = |count: usize, taken: &[usize]| loop {
                    let index = mirror.below(count);
                    if !taken.contains(&index) {
                        break index;
                    }
                };
                let a = draw(size, &[n]);
                let b = draw(all.len() / 2, &[n, a]);
                let certain = mirror.below(2);
                for (axis, (min, max)) in setup().bounds.into_iter().enumerate() {
                    let x = all[2 * n + axis];
                    let mut mutant = x + f * (all[2 * leader + axis] - x) + f * (all[2 * a + axis] - all[2 * b + axis]);
                    if mutant < min || mutant > max {
                        mutant = (x + if mutant < min { min } else { max }) / 2.0;
                    }
                    let is_crossed = mirror.unit() < cr || axis == certain;
                    let expected = if is_crossed { mutant } else { x };
                    assert!((population.values[2 * n + axis] - expected).abs() < 1e-12);
                }
            }
        }
        assert!(evaluations == 200 && archived > 10, "{evaluations} evaluations, an archive of {archived}");
    }
}
