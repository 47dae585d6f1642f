//! The tables of one recording: cells, built when candidates first come there, and dropped when there are too many.

use super::block::{Scratch, TableBlock};
use super::bounded::Bounded;
use super::cell::Cell;
use super::cells::Cells;
use super::geometry::Key;
use super::lanes::CANDIDATES;
use super::series::Series;
use crate::cpu::Level;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, PoisonError, RwLock};

/// Fewest candidates that a thread evaluates: 0.1 ms.
const BLOCK: usize = 1024;
/// Number of blocks for each thread, so that threads end together.
const PER_THREAD: usize = 4;

/// The tables of a recording.
#[derive(Debug)]
pub(super) struct Tables {
    series: Series,
    level: Level,
    /// No lock is held while blocks are evaluated: a thread that waits for others may do work that takes the lock.
    cells: RwLock<Arc<Cells>>,
    batches: AtomicU64,
    last_use: AtomicU64,
}

impl Tables {
    pub fn new(series: Series, level: Level) -> Self {
        Self { series, level, cells: RwLock::default(), batches: AtomicU64::new(0), last_use: AtomicU64::new(0) }
    }

    /// Computes the sums of squared errors of current and speed of candidates, with bounds of their errors; infinite ones for candidates
    /// that are in no cell. `rows` writes R, L, K, B and J of candidates from a number on, and `put` takes the sums of one.
    pub fn sums<T: Send>(
        &self,
        rows: impl Fn(usize, &mut [[f64; 5]]) + Sync,
        put: impl Fn(&mut T, [Bounded; 2]) + Sync,
        results: &mut [T],
    ) {
        let batch = self.batches.fetch_add(1, Ordering::Relaxed);
        let size = results.len().div_ceil(PER_THREAD * rayon::current_num_threads());
        let size = size.max(BLOCK).next_multiple_of(CANDIDATES);
        let block = |(n, results)| Block::new(n * size, results);
        let mut blocks: Vec<Block<'_, T>> = results.chunks_mut(size).enumerate().map(block).collect();
        loop {
            let cells = self.cells.read().unwrap_or_else(PoisonError::into_inner).clone();
            let of = TableBlock { series: &self.series, cells: &cells, level: self.level, batch };
            each(&mut blocks, |block| block.evaluate(&of, &rows, &put));
            let mut missing: Vec<Key> = blocks.iter_mut().flat_map(|block| block.missing.drain(..)).collect();
            if missing.is_empty() {
                break;
            }
            drop(cells);
            missing.sort_unstable_by_key(|key| key.0);
            missing.dedup();
            self.build(&missing, batch);
        }
    }

    fn build(&self, missing: &[Key], batch: u64) {
        let build = |key: &Key| Cell::new(&self.series, *key, self.level);
        let built: Vec<Cell> = match missing {
            [one] => vec![build(one)],
            _ => missing.par_iter().map(build).collect(),
        };
        let mut cells = self.cells.write().unwrap_or_else(PoisonError::into_inner);
        Arc::make_mut(&mut cells).add(built, batch);
    }

    /// Changes the first coefficient of every polynomial by a part of it.
    #[cfg(test)]
    pub fn corrupt(&self, part: f64) {
        let mut cells = self.cells.write().unwrap_or_else(PoisonError::into_inner);
        for cell in &mut Arc::make_mut(&mut cells).all {
            let polynomials = Arc::get_mut(cell).map(|cell| &mut cell.forced);
            polynomials.into_iter().flat_map(|rows| &mut rows[0]).for_each(|value| *value *= 1.0 + part);
        }
    }

    /// Returns the memory \[bytes\].
    pub fn bytes(&self) -> usize {
        let cells = self.cells.read().unwrap_or_else(PoisonError::into_inner).all.len();
        self.series.bytes() + cells * self.series.sets.len() * size_of::<Cell>()
    }

    /// Notes the number of the last use.
    pub fn note_use(&self, number: u64) {
        self.last_use.store(number, Ordering::Relaxed);
    }

    pub fn last_use(&self) -> u64 {
        self.last_use.load(Ordering::Relaxed)
    }
}

/// Candidates that a thread evaluates.
struct Block<'a, T> {
    /// Number of the first candidate.
    first: usize,
    results: &'a mut [T],
    /// Numbers of the first candidates of groups that wait for cells.
    pending: Vec<usize>,
    /// Cells that the tables lack.
    missing: Vec<Key>,
}

impl<'a, T> Block<'a, T> {
    fn new(first: usize, results: &'a mut [T]) -> Self {
        let pending = (0..results.len()).step_by(CANDIDATES).collect();
        Self { first, results, pending, missing: Vec::new() }
    }

    /// Evaluates the candidates whose cells are there.
    fn evaluate(
        &mut self,
        of: &TableBlock<'_>,
        rows: &impl Fn(usize, &mut [[f64; 5]]),
        put: &impl Fn(&mut T, [Bounded; 2]),
    ) {
        let mut scratch = Scratch::default();
        let Self { first, results, pending, missing } = self;
        pending.retain(|at| {
            let results = &mut results[*at..];
            let count = results.len().min(CANDIDATES);
            let (own, padding) = scratch.rows.split_at_mut(count);
            rows(*first + at, own);
            // Lanes without a candidate repeat the last one.
            padding.fill(own[count - 1]);
            let Some(sums) = of.evaluate(count, &mut scratch, missing) else { return true };
            results.iter_mut().zip(sums).for_each(|(result, sums)| put(result, sums));
            false
        });
        of.mark(&scratch);
    }
}

/// Works on blocks, in parallel if there are several.
fn each<T: Send>(blocks: &mut [T], work: impl Fn(&mut T) + Send + Sync) {
    match blocks {
        [one] => work(one),
        _ => blocks.par_iter_mut().for_each(work),
    }
}
