//! Tables that all searches of a process share, as long as the recording is in use.

use super::series::{Recorded, Series};
use super::tables::Tables;
use crate::evaluate::cpu::Level;
use crate::evaluate::problem::Problem;
use crate::evaluate::signals::Signals;
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Cells of all recordings together from which on the tables that were not used for longest are dropped when another
/// recording comes: some 200 MB.
const SHARED_CELLS_MAX: usize = 1 << 16;

struct Entry {
    signals: Weak<Signals>,
    is_first_order_hold: bool,
    level: Level,
    tables: Arc<Tables>,
}

/// The tables in use, the last used ones at the end.
static SHARED: Mutex<Vec<Entry>> = Mutex::new(Vec::new());

/// Returns the tables of a recording of a problem.
pub(super) fn tables(problem: &Problem, signals: &Arc<Signals>, level: Level) -> Arc<Tables> {
    let is_first_order_hold = problem.method().uses_next_input();
    let is_same = |entry: &Entry| {
        std::ptr::eq(entry.signals.as_ptr(), Arc::as_ptr(signals))
            && (entry.is_first_order_hold, entry.level) == (is_first_order_hold, level)
    };
    let mut shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(place) = shared.iter().position(is_same) {
        let entry = shared.remove(place);
        let tables = entry.tables.clone();
        shared.push(entry);
        return tables;
    }
    // The series take long; meanwhile others may use the tables.
    drop(shared);
    let first = problem.first_active(signals);
    let recorded = Recorded {
        step_s: signals.step_s[0],
        voltage: &signals.voltage[first..],
        measured: &signals.measured[first..],
        initial: signals.initial,
        is_first_order_hold,
    };
    let tables = Arc::new(Tables::new(Series::new(&recorded), level));
    let mut shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(entry) = shared.iter().find(|entry| is_same(entry)) {
        return entry.tables.clone();
    }
    shared.retain(|entry| entry.signals.strong_count() > 0);
    while shared.len() > problem.signals().len()
        && shared.iter().map(|e| e.tables.count()).sum::<usize>() > SHARED_CELLS_MAX
    {
        shared.remove(0);
    }
    shared.push(Entry { signals: Arc::downgrade(signals), is_first_order_hold, level, tables: tables.clone() });
    tables
}
