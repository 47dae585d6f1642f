//! Cells of a recording and where they are.

use super::cell::Cell;
use super::geometry::Key;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// Cells of a recording, 2 kB each, or 4 kB with a free motion: above this number those that were not used for longest are dropped, but
/// none that the present batch uses, at most two for each candidate.
const CELLS_MAX: usize = 1 << 14;

/// Cells of a recording. Copies share them.
#[derive(Debug, Clone, Default)]
pub(super) struct Cells {
    pub all: Vec<Arc<Cell>>,
    /// Number of each cell plus one, `[octave][row]`; 0 where there is none.
    index: Vec<Vec<u32>>,
}

impl Cells {
    /// Returns the number of a cell.
    #[inline(always)]
    pub fn find(&self, key: Key) -> Option<usize> {
        let number = *self.index.get(key.octave())?.get(key.row())?;
        (number as usize).checked_sub(1)
    }

    /// Adds cells that a batch uses. Where there are too many, the half that was used last is kept, and all that the batch uses.
    pub fn add(&mut self, cells: Vec<Cell>, batch: u64) {
        if self.all.len() + cells.len() > CELLS_MAX {
            let mut all = std::mem::take(self).all;
            let used = |cell: &Arc<Cell>| cell.used.load(Ordering::Relaxed);
            all.sort_by_key(|cell| std::cmp::Reverse(used(cell)));
            let kept = all.into_iter().enumerate().filter(|(n, cell)| *n < CELLS_MAX / 2 || used(cell) == batch);
            kept.for_each(|(_, cell)| self.insert(cell));
        }
        for cell in cells {
            cell.used.store(batch, Ordering::Relaxed);
            // Another thread may have built it meanwhile.
            if self.find(cell.key).is_none() {
                self.insert(Arc::new(cell));
            }
        }
    }

    fn insert(&mut self, cell: Arc<Cell>) {
        let (octave, row) = (cell.key.octave(), cell.key.row());
        if self.index.len() <= octave {
            self.index.resize(octave + 1, Vec::new());
        }
        let rows = &mut self.index[octave];
        if rows.len() <= row {
            rows.resize(row + 1, 0);
        }
        self.all.push(cell);
        rows[row] = u32::try_from(self.all.len()).unwrap_or(0);
    }
}
