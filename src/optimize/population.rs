//! The parts shared by all searches: settings, random numbers, the population and its best candidate, and the run of a
//! [`Rule`].

use super::run::{Best, Optimizer};
use crate::candidates::Candidates;
use crate::numeric::count_u64;
use crate::setting::{Setting, text};
use crate::{Error, Result};
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

/// Largest number of values (candidates × axes) of one population: 1 GiB.
pub(super) const VALUES_MAX: usize = 1 << 27;

/// Settings common to all searches.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchSettings {
    /// Bounds `(min, max)` of each axis.
    pub bounds: Vec<(f64, f64)>,
    /// Number of candidates in the population.
    pub population: usize,
    /// Number of generations, the first population included.
    pub generations: usize,
    /// Seed of the study.
    pub seed: u64,
    /// Index of the run in the study; runs of one seed are independent of each other.
    pub run: u64,
}

impl SearchSettings {
    fn too_large(&self) -> Error {
        let message = format!("a population of {} candidates does not fit in memory", self.population);
        Error::usage(message, format!("Give at most {} candidates.", VALUES_MAX / self.bounds.len()))
    }

    /// Checks the settings.
    ///
    /// # Errors
    /// Returns `Usage` if the box is empty or not finite, the population or the number of generations is zero, or the
    /// population or the number of evaluations exceeds its limit.
    pub fn check(&self) -> Result<()> {
        let size = self.population.checked_mul(self.bounds.len());
        if self.bounds.is_empty() || self.bounds.iter().any(|&(a, b)| !(a.is_finite() && b.is_finite() && a <= b)) {
            return Err(Error::usage("the box of the search is empty", "Give finite bounds with min ≤ max."));
        }
        if self.population == 0 || self.generations == 0 {
            let which = if self.population == 0 { Setting::Population } else { Setting::Generations };
            return Err(Error::usage(format!("{} is 0", which.name()), text!("Give " {which} " at least 1.")));
        }
        if size.is_none_or(|size| size > VALUES_MAX) {
            return Err(self.too_large());
        }
        let evaluations = (self.population as u64).checked_mul(self.generations as u64);
        if evaluations.is_none_or(|count| count > 1 << 53) {
            let message = format!("population {} × generations {} overflows", self.population, self.generations);
            return Err(Error::usage(
                message,
                "Reduce one of them: the product may be at most 9007199254740992 evaluations.",
            ));
        }
        Ok(())
    }
}

/// Number of candidates that share a sequence of random numbers and move together. The pieces of a population move in parallel, and
/// where they move does not depend on the number of threads.
pub(super) const PIECE: usize = 128;
/// Number of pieces from which on a population moves in parallel: fewer take no longer than waking another thread.
const PARALLEL_MIN: usize = 4;

/// Random numbers of a piece of a population: xoshiro256++, whose state is drawn from `ChaCha8` with the seed as the key and the run
/// as the stream, so that the sequences of runs and of their pieces are independent.
#[derive(Debug, Clone)]
pub(super) struct Numbers(Xoshiro256PlusPlus);

const UNIT53: f64 = 1.0 / count_u64(1 << 53);

impl Numbers {
    /// Returns the sequences of the pieces of a population.
    fn of_pieces(setup: &SearchSettings) -> Vec<Self> {
        let mut key = ChaCha8Rng::seed_from_u64(setup.seed);
        key.set_stream(setup.run);
        let next = |_| Self(Xoshiro256PlusPlus::from_rng(&mut key));
        (0..setup.population.div_ceil(PIECE)).map(next).collect()
    }

    /// Returns a uniform number in \[0, 1) with 53 bits.
    #[inline]
    pub(super) fn unit(&mut self) -> f64 {
        count_u64(self.0.next_u64() >> 11) * UNIT53
    }

    /// Returns two uniform numbers in \[0, 1) of 32 bits each from one draw.
    #[inline]
    pub(super) fn pair(&mut self) -> (f64, f64) {
        split(self.0.next_u64())
    }

    /// Fills `draws` with random bits, which [`split`] converts to pairs of numbers.
    pub(super) fn fill(&mut self, draws: &mut [u64]) {
        draws.fill_with(|| self.0.next_u64());
    }

    /// Returns a uniform integer in 0..count.
    #[inline]
    #[expect(clippy::cast_possible_truncation, reason = "the result is below count")]
    pub(super) fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.0.next_u64()) * count as u128) >> 64) as usize
    }
}

/// Returns two uniform numbers in \[0, 1) of 32 bits each from one draw, enough for the random weights of a move. The bits
/// become the mantissa of a number in \[1, 2), which vectorizes where an integer conversion would not.
#[inline(always)]
pub(super) fn split(draw: u64) -> (f64, f64) {
    let unit = |bits: u64| f64::from_bits(0x3ff0_0000_0000_0000 | (bits << 20)) - 1.0;
    (unit(draw >> 32), unit(draw & 0xffff_ffff))
}

/// A population in its box with the best candidate ever evaluated.
#[derive(Debug, Clone)]
pub(super) struct Population {
    pub setup: SearchSettings,
    /// Random numbers of each piece; the first also serve what concerns the whole population.
    pub numbers: Vec<Numbers>,
    /// Values of the candidates, row-major, shape `[population, axes]`.
    pub values: Vec<f64>,
    best: Vec<f64>,
    best_cost: f64,
}

impl Population {
    /// Makes a population of candidates uniform in the box.
    pub(super) fn new(setup: SearchSettings) -> Result<Self> {
        setup.check()?;
        let (numbers, mut values) = (Numbers::of_pieces(&setup), Vec::new());
        let size = setup.population * setup.bounds.len();
        values.try_reserve_exact(size).map_err(|_| setup.too_large())?;
        values.resize(size, 0.0);
        let mut population = Self { setup, numbers, values, best: Vec::new(), best_cost: f64::INFINITY };
        population.scatter();
        Ok(population)
    }

    /// Redraws every candidate: `X_min + (X_max − X_min) r`.
    pub(super) fn scatter(&mut self) {
        let Self { setup, numbers, values, .. } = self;
        let (bounds, width) = (&setup.bounds, setup.bounds.len());
        each_piece(values.chunks_mut(PIECE * width).zip(numbers), |(values, numbers)| {
            for agent in values.chunks_exact_mut(width) {
                for (x, &(min, max)) in agent.iter_mut().zip(bounds) {
                    *x = min + (max - min) * numbers.unit();
                }
            }
        });
    }

    pub(super) fn width(&self) -> usize {
        self.setup.bounds.len()
    }

    pub(super) fn row(&self, agent: usize) -> &[f64] {
        &self.values[agent * self.width()..(agent + 1) * self.width()]
    }

    /// Returns the lowest cost of the candidates evaluated; +∞ before there is one.
    pub(super) fn lowest(&self) -> f64 {
        self.best_cost
    }

    fn note(&mut self, costs: &[f64]) {
        let Some((agent, &cost)) = costs.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1)) else { return };
        if cost < self.best_cost {
            self.best_cost = cost;
            self.best = self.row(agent).to_vec();
        }
    }
}

/// Calls `advance` for each piece of a population, in parallel if there are many.
pub(super) fn each_piece<T: Send>(pieces: impl Iterator<Item = T>, advance: impl Fn(T) + Send + Sync) {
    let pieces: Vec<T> = pieces.collect();
    if pieces.len() < PARALLEL_MIN {
        pieces.into_iter().for_each(advance);
    } else {
        pieces.into_par_iter().with_min_len(2).for_each(advance);
    }
}

/// The rule by which the candidates of a search move.
pub(super) trait Rule: Send {
    /// Checks combinations of settings, each of which is in its range.
    fn check(&self) -> Result<()> {
        Ok(())
    }

    /// Takes the costs of the population, none of which is NaN or −∞. A cost above its cutoff is a lower bound.
    fn learn(&mut self, population: &Population, costs: Vec<f64>);

    /// Returns for each candidate a cost above which `learn` ignores it, at least the lowest cost so far; empty if every cost is
    /// used.
    fn cutoffs(&self) -> &[f64] {
        &[]
    }

    /// Replaces the population by the next one.
    fn advance(&mut self, population: &mut Population);
}

/// A run of a search whose candidates move by a rule.
pub(super) struct Moving<R> {
    pub rule: R,
    pub population: Population,
    told: bool,
}

impl<R: Rule> Moving<R> {
    pub(super) fn new(rule: R, setup: SearchSettings) -> Result<Self> {
        rule.check()?;
        Ok(Self { rule, population: Population::new(setup)?, told: false })
    }
}

impl<R: Rule> Optimizer for Moving<R> {
    fn ask(&mut self) -> Candidates<'_> {
        if std::mem::take(&mut self.told) {
            self.rule.advance(&mut self.population);
        }
        let candidates = Candidates::new(&self.population.values, self.population.width());
        let cutoffs = self.rule.cutoffs();
        if cutoffs.len() == candidates.count() { candidates.with_cutoffs(cutoffs) } else { candidates }
    }

    fn tell(&mut self, costs: &[f64]) {
        // A cost of NaN or −∞ is invalid and counts as +∞.
        let ordered = |&cost: &f64| if cost > f64::NEG_INFINITY { cost } else { f64::INFINITY };
        let costs: Vec<f64> = costs.iter().map(ordered).collect();
        self.population.note(&costs);
        self.rule.learn(&self.population, costs);
        self.told = true;
    }

    fn best(&self) -> Option<Best<'_>> {
        let Population { best, best_cost, .. } = &self.population;
        best_cost.is_finite().then_some(Best { values: best, cost: *best_cost })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimize::SEARCHES;
    use rayon::ThreadPoolBuilder;

    fn setup(population: usize) -> SearchSettings {
        SearchSettings { bounds: vec![(0.0, 1.0), (-2.0, 3.0)], population, generations: 9, seed: 4, run: 2 }
    }

    #[test]
    fn where_candidates_move_does_not_depend_on_threads() {
        // More pieces than threads, the last one smaller.
        let size = PIECE * (PARALLEL_MIN + 2) + 5;
        for search in SEARCHES {
            let after = |threads: usize| {
                let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| {
                    let mut search = crate::optimize::ConfiguredSearch::from(search).begin(setup(size)).unwrap();
                    for _ in 0..4 {
                        let row = |row: &[f64]| (row[0] - 0.3).powi(2) + row[1].abs();
                        let costs: Vec<f64> = search.ask().values().chunks(2).map(row).collect();
                        search.tell(&costs);
                    }
                    search.ask().values().to_vec()
                })
            };
            assert_eq!(after(1), after(3), "{}", search.name);
        }
    }

    #[test]
    fn pieces_have_sequences_of_their_own() {
        // The first candidates of a larger population are those of a smaller one; no two of its pieces are alike.
        let values = |population: usize| Population::new(setup(population)).unwrap().values;
        let (one, many) = (values(PIECE), values(5 * PIECE));
        let pieces: Vec<&[f64]> = many.chunks(2 * PIECE).collect();
        assert_eq!(pieces[0], one);
        for (n, piece) in pieces.iter().enumerate() {
            assert!(
                pieces[..n].iter().all(|other| other.iter().zip(*piece).all(|(a, b)| a.to_bits() != b.to_bits())),
                "piece {n}"
            );
        }
    }
}
