//! The tables of one recording: cells, built when candidates first come there, and dropped when there are too many.

use super::block::{Scratch, TableBlock, UNSERVED};
use super::bounded::Bounded;
use super::cell::Cell;
use super::cells::Cells;
use super::geometry::Key;
use super::series::Series;
use crate::evaluate::cpu::Level;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, RwLock};

/// Candidates of a block: most cells have several of them, and their rows stay in the cache.
const BLOCK: usize = 8192;

/// The tables of a recording.
#[derive(Debug)]
pub(super) struct Tables {
    series: Series,
    level: Level,
    /// No lock is held while blocks are evaluated: a thread that waits for others may do work that takes the lock.
    cells: RwLock<Arc<Cells>>,
    batches: AtomicU64,
}

/// Memory of blocks that were evaluated.
static MEMORY: Mutex<Vec<Scratch>> = Mutex::new(Vec::new());

impl Tables {
    pub fn new(series: Series, level: Level) -> Self {
        Self { series, level, cells: RwLock::default(), batches: AtomicU64::new(0) }
    }

    /// Writes the sums of squared errors of current and speed of candidates, with bounds of their errors; infinite ones for candidates
    /// that are in no cell. `parameters` returns R, L, K, B and J of a candidate.
    pub fn sums(&self, parameters: impl Fn(usize) -> [f64; 5] + Send + Sync, sums: &mut [[Bounded; 2]]) {
        sums.fill(UNSERVED);
        let mut blocks: Vec<(Scratch, &mut [[Bounded; 2]])> = {
            let mut memory = MEMORY.lock().unwrap_or_else(PoisonError::into_inner);
            sums.chunks_mut(BLOCK).map(|own| (memory.pop().unwrap_or_default(), own)).collect()
        };
        blocks.iter_mut().for_each(|(scratch, _)| scratch.begin());
        let batch = self.batches.fetch_add(1, Ordering::Relaxed);
        loop {
            let cells = self.cells.read().unwrap_or_else(PoisonError::into_inner).clone();
            let block = TableBlock { series: &self.series, cells: &cells, level: self.level };
            // One block after the other, so that its rows are in the cache.
            each(&mut blocks, |(n, (scratch, own))| {
                let candidates = (n * BLOCK..n * BLOCK + own.len()).map(&parameters);
                block.evaluate(scratch, candidates, (own, batch));
            });
            let missing = blocks.iter().flat_map(|(scratch, _)| scratch.missing.iter().copied());
            let mut missing: Vec<Key> = missing.collect();
            if missing.is_empty() {
                break;
            }
            drop(cells);
            missing.sort_unstable_by_key(|key| key.0);
            missing.dedup();
            self.build(&missing, batch);
        }
        let mut memory = MEMORY.lock().unwrap_or_else(PoisonError::into_inner);
        memory.extend(blocks.into_iter().map(|(scratch, _)| scratch));
        memory.truncate(2 * rayon::current_num_threads());
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
            let polynomials = Arc::get_mut(cell).into_iter().flat_map(|cell| &mut cell.polynomials);
            polynomials.flat_map(|rows| &mut rows[0]).for_each(|value| *value *= 1.0 + part);
        }
    }

    /// Returns the number of cells.
    pub fn count(&self) -> usize {
        self.cells.read().unwrap_or_else(PoisonError::into_inner).all.len()
    }
}

/// Works on blocks, in parallel if there are several.
fn each<T: Send>(blocks: &mut [T], work: impl Fn((usize, &mut T)) + Send + Sync) {
    match blocks {
        [one] => work((0, one)),
        _ => blocks.par_iter_mut().enumerate().for_each(work),
    }
}
