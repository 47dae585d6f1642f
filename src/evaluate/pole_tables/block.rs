//! Evaluation of a block of candidates, cell by cell: candidates side by side share the coefficients.

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays alike")]

use super::bounded::Bounded;
use super::cell::Cell;
use super::cells::Cells;
use super::geometry::{Code, Key, Kind, real_point};
use super::lanes::{CellLanes, LANES, LaneValues, Selection, gather, polynomials, squared_errors};
use super::located::{Located, Sorted};
use super::nodes::SEQUENCES;
use super::response::FUNCTIONS;
use super::series::Series;
use crate::evaluate::cpu::Level;
use std::sync::atomic::Ordering;

/// Value and error of each function at the second real pole.
type Second = [[f64; FUNCTIONS]; 2];

/// Memory of a block.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    located: Located,
    slots: Vec<u32>,
    sorted: Sorted,
    sorted_seconds: Sorted,
    seconds: Vec<Second>,
    /// Cells that the tables lack.
    pub missing: Vec<Key>,
    is_located: bool,
    is_done: bool,
}

impl Scratch {
    /// Begins a block.
    pub fn begin(&mut self) {
        (self.is_located, self.is_done) = (false, false);
    }

    /// Sorts the candidates by their cells, or notes the cells that the tables lack.
    fn find(&mut self, cells: &Cells) {
        let Self { located, slots, sorted, sorted_seconds, missing, .. } = self;
        missing.clear();
        let mut slot = |code: u32| {
            if code == Code::NOWHERE.0 {
                return u32::MAX;
            }
            let (key, is_real) = (Code(code).key(), Code(code).is_real());
            let Some(cell) = cells.find(key) else {
                if missing.last() != Some(&key) {
                    missing.push(key);
                }
                return u32::MAX;
            };
            u32::try_from(2 * cell + usize::from(is_real)).unwrap_or(u32::MAX)
        };
        slots.clear();
        slots.extend(located.seconds.iter().map(|(_, code)| slot(*code)));
        sorted_seconds.sort(slots, 2 * cells.all.len());
        slots.clear();
        slots.extend(located.codes.iter().map(|code| slot(*code)));
        if missing.is_empty() {
            sorted.sort(slots, 2 * cells.all.len());
        }
    }
}

/// The tables of a recording that have the cells of a block.
pub(super) struct TableBlock<'a> {
    pub series: &'a Series,
    pub cells: &'a Cells,
    pub level: Level,
}

/// Groups of candidates side by side that are evaluated together, stage by stage.
const STAGED: usize = 4;

/// Sums of squared errors of a candidate that is not served.
pub(super) const UNSERVED: [Bounded; 2] = [Bounded { value: f64::NAN, error: f64::INFINITY }; 2];

/// Slope of the errors of a pair of poles, in those of the functions per real part of the point of the cell.
const PAIR_SLOPE: f64 = 8.0;

impl TableBlock<'_> {
    /// Evaluates candidates, given by R, L, K, B and J, unless that is done or cells are missing.
    pub fn evaluate(
        &self,
        scratch: &mut Scratch,
        candidates: impl Iterator<Item = [f64; 5]>,
        (all, batch): (&mut [[Bounded; 2]], u64),
    ) {
        if scratch.is_done {
            return;
        }
        if !scratch.is_located {
            scratch.located.locate(candidates, self.series.shift(), self.level);
            scratch.is_located = true;
        }
        scratch.find(self.cells);
        if scratch.missing.is_empty() {
            self.run(scratch, all, batch);
            scratch.is_done = true;
        }
    }

    /// Writes the sums of squared errors of the candidates that were sorted.
    fn run(&self, scratch: &mut Scratch, all: &mut [[Bounded; 2]], batch: u64) {
        let Scratch { located, sorted, sorted_seconds, seconds, .. } = scratch;
        seconds.clear();
        seconds.resize(located.seconds.len(), [[0.0; FUNCTIONS], [f64::INFINITY; FUNCTIONS]]);
        if !seconds.is_empty() {
            for (number, cell) in self.cells.all.iter().enumerate() {
                let own = sorted_seconds.of(2 * number + 1);
                for ids in own.chunks(LANES) {
                    self.second(cell, ids, located, seconds);
                }
                if !own.is_empty() {
                    cell.used.store(batch, Ordering::Relaxed);
                }
            }
        }
        let mut lanes: [CellLanes; STAGED] = std::array::from_fn(|_| CellLanes::new());
        for (number, cell) in self.cells.all.iter().enumerate() {
            for is_real in [false, true] {
                let own = sorted.of(2 * number + usize::from(is_real));
                if own.is_empty() {
                    continue;
                }
                cell.used.store(batch, Ordering::Relaxed);
                for own in &mut lanes {
                    own.errors = cell.error.map(|error| [error; LANES]);
                    own.pair_slope = PAIR_SLOPE / cell.key.center()[0];
                    own.kind = match (is_real, cell.key.row()) {
                        (true, _) => Kind::Real,
                        (false, 0) => Kind::Pair,
                        (false, _) => Kind::Complex,
                    };
                }
                for ids in own.chunks(STAGED * LANES) {
                    self.evaluate_lanes((cell, ids), (located, seconds), (&mut lanes, all));
                }
            }
        }
    }

    /// Evaluates functions at second real poles.
    fn second(&self, cell: &Cell, ids: &[u32], located: &Located, seconds: &mut [Second]) {
        let mut v = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            let (q, _) = located.seconds[ids[lane.min(ids.len() - 1)] as usize];
            v[0][lane] = real_point(q, cell.key.center()[0]);
        }
        for (set, of) in cell.polynomials.iter().enumerate() {
            let mut values: LaneValues = [[0.0; LANES]; 2 * SEQUENCES];
            polynomials(of, &v, &mut values, self.level);
            for (lane, id) in ids.iter().enumerate() {
                for f in 0..SEQUENCES {
                    seconds[*id as usize][0][set * SEQUENCES + f] = values[f][lane];
                }
            }
        }
        for id in ids {
            seconds[*id as usize][1] = cell.error;
        }
    }

    /// Evaluates candidates of a cell, up to [`STAGED`] times so many as are side by side. Each stage is computed for all of them before
    /// the next, because the divisions and roots of one take long but do not wait for those of another.
    fn evaluate_lanes(
        &self,
        (cell, ids): (&Cell, &[u32]),
        (located, seconds): (&Located, &[Second]),
        (lanes, all): (&mut [CellLanes; STAGED], &mut [[Bounded; 2]]),
    ) {
        let (rows, shift, center) = (located.rows.as_slice(), self.series.shift(), cell.key.center());
        for (ids, group) in ids.chunks(LANES).zip(lanes.iter_mut()) {
            // Lanes without a candidate repeat the last one.
            let mut padded = [ids[ids.len() - 1]; LANES];
            padded[..ids.len()].copy_from_slice(ids);
            gather(&Selection { rows, ids: padded, center, shift }, group, self.level);
            if group.kind == Kind::Real {
                for (lane, id) in padded.into_iter().enumerate() {
                    let second = &seconds[located.second[id as usize] as usize];
                    for f in 0..FUNCTIONS {
                        group.others[f][lane] = second[0][f];
                        group.errors[f][lane] = second[1][f].max(cell.error[f]);
                    }
                }
            }
        }
        let used = ids.len().div_ceil(LANES);
        for group in &mut lanes[..used] {
            for (of, values) in cell.polynomials.iter().zip(&mut group.values) {
                polynomials(of, &group.v, values, self.level);
            }
        }
        for (ids, group) in ids.chunks(LANES).zip(lanes.iter()) {
            let mut results = [[[0.0; LANES]; 2]; 2];
            squared_errors(self.series, group, &mut results, self.level);
            let [values, errors] = &results;
            for (lane, id) in ids.iter().enumerate() {
                let own = |c: usize| Bounded::new(values[c][lane], errors[c][lane]);
                all[*id as usize] = [own(0), own(1)];
            }
        }
    }
}
