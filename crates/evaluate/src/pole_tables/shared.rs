//! Tables that all searches of a process share. Recordings with the same samples have the same tables, also if they are read again.

use super::series::{Recorded, Series};
use super::tables::Tables;
use crate::cpu::Level;
use crate::problem::Problem;
use crate::signals::Signals;
use sha2::{Digest as _, Sha256};
use std::collections::{HashMap, HashSet};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Memory of all tables from which on those that were not used for longest are dropped when another recording comes \[bytes\].
const BYTES_MAX: usize = 200 << 20;

/// Hold and SIMD level of tables.
type Kind = (bool, Level);

/// The tables of a process.
#[derive(Default)]
struct Shared {
    /// By the address of the signals, which is not used again as long as there is a weak reference.
    by_address: HashMap<(usize, Kind), (Weak<Signals>, Arc<Tables>)>,
    by_digest: HashMap<([u8; 32], Kind), Arc<Tables>>,
}

static SHARED: Mutex<Option<Shared>> = Mutex::new(None);
/// Number of the last use.
static USES: AtomicU64 = AtomicU64::new(0);

impl Shared {
    /// Drops the tables that were not used for longest as long as there are too many; `needed` are kept.
    fn prune(&mut self, needed: usize) {
        let mut by_use: Vec<_> = self.by_digest.iter().map(|(key, tables)| (tables.last_use(), *key)).collect();
        by_use.sort_unstable_by_key(|(last_use, _)| *last_use);
        let mut bytes: usize = self.by_digest.values().map(|tables| tables.bytes()).sum();
        let droppable = by_use.len().saturating_sub(needed);
        for (_, key) in &by_use[..droppable] {
            if bytes <= BYTES_MAX {
                break;
            }
            bytes -= self.by_digest.remove(key).map_or(0, |tables| tables.bytes());
        }
        let kept: HashSet<_> = self.by_digest.values().map(Arc::as_ptr).collect();
        self.by_address
            .retain(|_, (signals, tables)| signals.strong_count() > 0 && kept.contains(&Arc::as_ptr(tables)));
    }
}

/// Drops the tables of all recordings.
pub(super) fn clear() {
    *SHARED.lock().unwrap_or_else(PoisonError::into_inner) = None;
}

/// Returns the tables of a recording of a problem.
pub(super) fn tables(problem: &Problem, signals: &Arc<Signals>, level: Level) -> Arc<Tables> {
    let kind = (problem.method().uses_next_input(), level);
    let address = (Arc::as_ptr(signals).addr(), kind);
    let mut lock = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
    let known = lock.get_or_insert_default().by_address.get(&address);
    let tables = match known.map(|(_, tables)| tables.clone()) {
        Some(tables) => tables,
        None => {
            // The digest and the series take long; meanwhile others may use the tables.
            drop(lock);
            added(problem, signals, kind)
        }
    };
    tables.note_use(USES.fetch_add(1, Ordering::Relaxed));
    tables
}

/// Adds the tables of a recording, which are those of another one with the same samples if there is one.
fn added(problem: &Problem, signals: &Arc<Signals>, kind: Kind) -> Arc<Tables> {
    let first = problem.first_active(signals);
    let recorded = Recorded {
        step_s: signals.step_s[0],
        voltage: &signals.voltage[first..],
        measured: &signals.measured[first..],
        initial: signals.initial,
        is_first_order_hold: kind.0,
    };
    let key = (digest(&recorded), kind);
    let lock = || SHARED.lock().unwrap_or_else(PoisonError::into_inner);
    let known = lock().get_or_insert_default().by_digest.get(&key).cloned();
    let tables = known.unwrap_or_else(|| Arc::new(Tables::new(Series::new(&recorded), kind.1)));
    let mut lock = lock();
    let shared = lock.get_or_insert_default();
    let tables = shared.by_digest.entry(key).or_insert(tables).clone();
    let address = (Arc::as_ptr(signals).addr(), kind);
    shared.by_address.insert(address, (Arc::downgrade(signals), tables.clone()));
    tables.note_use(USES.fetch_add(1, Ordering::Relaxed));
    shared.prune(problem.signals().len());
    tables
}

/// Returns the digest of all numbers of a recording.
fn digest(of: &Recorded<'_>) -> [u8; 32] {
    let mut digest = Sha256::new();
    let mut add = |numbers: &[f64]| {
        for numbers in numbers.chunks(512) {
            let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
            digest.update(&bytes);
        }
    };
    add(&[of.step_s]);
    add(&of.initial);
    add(of.voltage);
    add(of.measured.as_flattened());
    digest.finalize().into()
}
