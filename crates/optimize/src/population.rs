//! The population of a search and its best candidate.

use super::numbers::{Numbers, PIECE};
use super::run::LocalOptimum;
use super::search_settings::SearchSettings;
use motorfit_core::Result;
use rayon::prelude::*;

/// Number of pieces from which on a population moves in parallel: fewer take no longer than waking another thread.
const PARALLEL_MIN: usize = 4;

/// A population in its box with the best candidate ever evaluated.
#[derive(Debug, Clone)]
pub(super) struct Population {
    pub setup: SearchSettings,
    /// Random numbers of each piece; the first also serve what concerns the whole population.
    pub numbers: Vec<Numbers>,
    /// Values of the candidates, row-major, shape `[candidates, axes]`.
    pub values: Vec<f64>,
    pub best: Vec<f64>,
    pub best_cost: f64,
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

    /// Returns the number of candidates.
    pub(super) fn count(&self) -> usize {
        self.values.len() / self.width()
    }

    /// Returns the lowest cost of the candidates evaluated; +∞ before there is one.
    pub(super) fn lowest(&self) -> f64 {
        self.best_cost
    }

    pub(super) fn note(&mut self, costs: &[f64]) {
        let Some((agent, &cost)) = costs.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1)) else { return };
        if cost < self.best_cost {
            self.best_cost = cost;
            self.best = self.row(agent).to_vec();
        }
    }

    pub(super) fn note_end(&mut self, end: &LocalOptimum) {
        if end.cost < self.best_cost {
            self.best_cost = end.cost;
            self.best.clone_from(&end.values);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ConfiguredSearch, SEARCHES};
    use rayon::ThreadPoolBuilder;

    fn setup(population: usize) -> SearchSettings {
        SearchSettings {
            bounds: vec![(0.0, 1.0), (-2.0, 3.0)],
            population,
            generations: 9,
            seed: 4,
            run: 2,
            ..SearchSettings::default()
        }
    }

    #[test]
    fn where_candidates_move_does_not_depend_on_threads() {
        // More pieces than threads, the last one smaller.
        let size = PIECE * (PARALLEL_MIN + 2) + 5;
        for search in SEARCHES.into_iter().filter(|search| search.name != "multistart") {
            let after = |threads: usize| {
                let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| {
                    let mut search = ConfiguredSearch::from(search).begin(setup(size)).unwrap();
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
