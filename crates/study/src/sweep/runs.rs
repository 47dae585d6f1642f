//! Numbering of the runs of a sweep. Runs are computed from their numbers and not listed, so that memory does not grow
//! with them.

use super::study::{FACTORS, Factors, Study};
use motorfit_core::numeric::index;
use motorfit_identify::TrustLevel;

/// A run: a motor with a level of each factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Job {
    /// Number of the run, from 0.
    pub id: u64,
    /// Index of the motor in the manifest.
    pub motor: usize,
    /// Levels of the factors.
    pub factors: Factors,
}

/// Indices of the levels of all factors except motor and seed, from the slowest to the fastest.
pub(super) type Levels = [u64; FACTORS];
/// Index of the noise in [`Levels`].
pub(super) const NOISE: usize = FACTORS - 1;

/// Numbering of the runs: the motor changes slowest, then method, polish, machine, population, generations, criterion,
/// scale, noise; the seed fastest.
#[derive(Debug, Clone)]
pub(super) struct Runs {
    study: Study,
    motors: usize,
}

impl Runs {
    pub(super) fn new(study: Study, motors: usize) -> Self {
        Self { study, motors }
    }

    /// Returns the study.
    pub(super) fn study(&self) -> &Study {
        &self.study
    }

    /// Returns the number of levels of each factor, from the slowest to the fastest.
    fn levels(&self) -> Levels {
        self.study.levels().map(|(_, count)| count as u64)
    }

    /// Returns the number of runs per motor.
    pub(super) fn per_motor(&self) -> u64 {
        self.levels().iter().fold(self.study.seeds.count(), |product, levels| product.saturating_mul(*levels))
    }

    /// Returns the number of runs.
    pub(super) fn count(&self) -> u64 {
        self.per_motor().saturating_mul(self.motors as u64)
    }

    /// Returns the run with a number.
    pub(super) fn job(&self, id: u64) -> Job {
        let s = &self.study;
        let seeds = s.seeds.count();
        let (places, rest) = self.places(id / seeds);
        let [method, polish, machine, population, generations, criterion, scale, noise] = places.map(index);
        let factors = Factors {
            method: s.methods[method],
            polish: s.polish[polish],
            machine,
            population: s.population[population],
            generations: s.generations[generations],
            criterion: s.criterion[criterion],
            scale: s.scale[scale],
            noise,
            seed: s.seeds.at(id % seeds),
        };
        Job { id, motor: index(rest), factors }
    }

    /// Splits a number into level indices and the remaining quotient, the index of the motor.
    fn places(&self, mut rest: u64) -> (Levels, u64) {
        let mut places = [0; FACTORS];
        for (place, levels) in places.iter_mut().zip(self.levels()).rev() {
            *place = rest % levels;
            rest /= levels;
        }
        (places, rest)
    }

    /// Returns the number of the run of a motor with the given level indices and index of the seed.
    pub(super) fn id(&self, motor: usize, places: &Levels, seed: u64) -> u64 {
        let above = self.levels().iter().zip(places).fold(motor as u64, |id, (levels, place)| id * levels + place);
        above * self.study.seeds.count() + seed
    }

    /// Returns the level indices of each combination of all factors except motor and seed.
    pub(super) fn combinations(&self) -> Vec<Levels> {
        (0..self.levels().iter().product()).map(|n| self.places(n).0).collect()
    }
}

/// Set of runs, one bit per run.
pub(super) struct Bits {
    words: Vec<u64>,
    size: u64,
}

impl Bits {
    pub(super) fn new(size: u64) -> Self {
        let words = usize::try_from(size.div_ceil(64)).unwrap_or(usize::MAX);
        Self { words: vec![0; words], size }
    }

    fn place(id: u64) -> (usize, u64) {
        (usize::try_from(id / 64).unwrap_or(usize::MAX), 1 << (id % 64))
    }

    pub(super) fn get(&self, id: u64) -> bool {
        let (word, bit) = Self::place(id);
        id < self.size && self.words[word] & bit != 0
    }

    /// Returns the number of set bits.
    pub(super) fn count(&self) -> u64 {
        self.words.iter().map(|word| u64::from(word.count_ones())).sum()
    }

    pub(super) fn set(&mut self, id: u64, value: bool) {
        if id < self.size {
            let (word, bit) = Self::place(id);
            if value {
                self.words[word] |= bit;
            } else {
                self.words[word] &= !bit;
            }
        }
    }
}

/// Levels of trust in the results of the runs, two bits each.
pub(super) struct TrustLevels([Bits; 2]);

impl TrustLevels {
    pub(super) fn new(size: u64) -> Self {
        Self([Bits::new(size), Bits::new(size)])
    }

    pub(super) fn get(&self, id: u64) -> Option<TrustLevel> {
        match [self.0[0].get(id), self.0[1].get(id)] {
            [false, false] => None,
            [true, false] => Some(TrustLevel::Good),
            [false, true] => Some(TrustLevel::Check),
            [true, true] => Some(TrustLevel::Poor),
        }
    }

    pub(super) fn set(&mut self, id: u64, level: Option<TrustLevel>) {
        self.0[0].set(id, matches!(level, Some(TrustLevel::Good | TrustLevel::Poor)));
        self.0[1].set(id, matches!(level, Some(TrustLevel::Check | TrustLevel::Poor)));
    }
}
