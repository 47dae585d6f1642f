//! Evaluation of candidates: places of their poles, polynomials of the cells there, sums of squared errors.

#![expect(clippy::needless_range_loop, reason = "a function indexes several arrays alike")]

use super::bounded::Bounded;
use super::cells::Cells;
use super::geometry::{Key, NOWHERE, low};
use super::lanes::{
    CANDIDATES, GroupRows, Groups, LANES, TOGETHER, place, polynomials, real_polynomials, squared_errors,
};
use super::sequences::SEQUENCES;
use super::series::Series;
use crate::cpu::Level;
use std::sync::atomic::Ordering;

/// Sums of squared errors of a candidate that is not served.
pub(super) const UNSERVED: [Bounded; 2] = [Bounded { value: f64::NAN, error: f64::INFINITY }; 2];

/// A candidate, by its number among those that are evaluated together, with the numbers of the cells of its poles.
#[derive(Clone, Copy)]
struct Located {
    number: usize,
    cells: [usize; 2],
}

/// The tables of a recording, and a number for the batch.
pub(super) struct TableBlock<'a> {
    pub series: &'a Series,
    pub cells: &'a Cells,
    pub level: Level,
    pub batch: u64,
}

/// Memory of an evaluation.
#[derive(Default)]
pub(super) struct Scratch {
    /// R, L, K, B and J of the candidates.
    pub rows: GroupRows,
    groups: Groups,
    /// Candidates whose poles share a cell, and those with two real poles.
    single: Vec<Located>,
    double: Vec<Located>,
    /// True for each cell that was used.
    used: Vec<bool>,
}

impl TableBlock<'_> {
    /// Evaluates the first `count` of the rows. Cells that the tables lack are added to `missing`; the result is `None` if there are
    /// such.
    pub fn evaluate(
        &self,
        count: usize,
        scratch: &mut Scratch,
        missing: &mut Vec<Key>,
    ) -> Option<[[Bounded; 2]; CANDIDATES]> {
        place(&scratch.rows, self.series.shift(), &mut scratch.groups, self.level);
        let known = missing.len();
        self.locate(count, scratch, missing);
        if missing.len() > known {
            return None;
        }
        let Scratch { groups, single, double, .. } = scratch;
        single.chunks(TOGETHER).for_each(|located| self.complex(located, groups));
        double.chunks(TOGETHER / 2).for_each(|located| self.real(located, groups));
        let mut sums = [UNSERVED; CANDIDATES];
        for (group, sums) in groups.iter().zip(sums.as_chunks_mut::<LANES>().0).take(count.div_ceil(LANES)) {
            let mut results = [[[0.0; LANES]; 2]; 2];
            squared_errors(self.series, group, &mut results, self.level);
            let [values, errors] = &results;
            for (lane, sums) in sums.iter_mut().enumerate() {
                let own = |c: usize| Bounded::new(values[c][lane], errors[c][lane]);
                *sums = [own(0), own(1)];
            }
        }
        Some(sums)
    }

    /// Notes the batch in the cells that were used.
    pub fn mark(&self, scratch: &Scratch) {
        for (cell, _) in self.cells.all.iter().zip(&scratch.used).filter(|(_, used)| **used) {
            cell.used.store(self.batch, Ordering::Relaxed);
        }
    }

    /// Finds the cells of the candidates.
    fn locate(&self, count: usize, scratch: &mut Scratch, missing: &mut Vec<Key>) {
        let Scratch { groups, single, double, used, .. } = scratch;
        used.resize(self.cells.all.len(), false);
        single.clear();
        double.clear();
        let mut find = |key: u64| {
            let key = Key(low(key));
            let found = self.cells.find(key);
            match found {
                Some(number) => used[number] = true,
                None => missing.push(key),
            }
            found
        };
        for (first, group) in (0..count).step_by(LANES).zip(groups) {
            for lane in 0..LANES.min(count - first) {
                let (number, [key, second]) = (first + lane, group.keys.map(|keys| keys[lane]));
                if key == NOWHERE {
                    group.errors[..SEQUENCES].iter_mut().for_each(|errors| errors[lane] = f64::INFINITY);
                    continue;
                }
                let Some(cell) = find(key) else { continue };
                if second == NOWHERE {
                    single.push(Located { number, cells: [cell; 2] });
                } else if let Some(second) = find(second) {
                    double.push(Located { number, cells: [cell, second] });
                }
            }
        }
    }

    /// Evaluates the functions of pairs of poles.
    fn complex(&self, located: &[Located], groups: &mut Groups) {
        let at = |p: usize| &located[p.min(located.len() - 1)];
        let cell = |p: usize| &*self.cells.all[at(p).cells[0]];
        let cells = [cell(0), cell(1), cell(2), cell(3), cell(4), cell(5), cell(6), cell(7)];
        let mut v = [[0.0; 3]; TOGETHER];
        for (p, v) in v.iter_mut().enumerate() {
            let (group, lane) = (&groups[at(p).number / LANES], at(p).number % LANES);
            *v = [group.v[0][lane], group.v[1][lane], group.v[2][lane]];
        }
        for set in 0..self.series.sets.len() {
            let mut values = [[0.0; 2 * SEQUENCES]; TOGETHER];
            polynomials(&cells.map(|cell| cell.polynomials(set)), &v, &mut values, self.level);
            for ((of, cell), values) in located.iter().zip(cells).zip(&values) {
                let (group, lane) = (&mut groups[of.number / LANES], of.number % LANES);
                for f in 0..SEQUENCES {
                    let n = set * SEQUENCES + f;
                    // In q the matrix X has the other sign.
                    (group.functions[0][n][lane], group.functions[1][n][lane]) = (values[f], -values[SEQUENCES + f]);
                    group.errors[n][lane] = cell.error[n];
                }
            }
        }
    }

    /// Evaluates the functions of two real poles each.
    fn real(&self, located: &[Located], groups: &mut Groups) {
        let at = |p: usize| &located[(p / 2).min(located.len() - 1)];
        let cell = |p: usize| &*self.cells.all[at(p).cells[p % 2]];
        let cells = [cell(0), cell(1), cell(2), cell(3), cell(4), cell(5), cell(6), cell(7)];
        let mut v = [0.0; TOGETHER];
        for (p, v) in v.iter_mut().enumerate() {
            let (group, lane) = (&groups[at(p).number / LANES], at(p).number % LANES);
            *v = [group.v[0][lane], group.second[lane]][p % 2];
        }
        for set in 0..self.series.sets.len() {
            let mut values = [[0.0; SEQUENCES]; TOGETHER];
            real_polynomials(&cells.map(|cell| cell.polynomials(set)), &v, &mut values, self.level);
            for ((of, cells), values) in located.iter().zip(cells.as_chunks::<2>().0).zip(values.as_chunks::<2>().0) {
                let (group, lane) = (&mut groups[of.number / LANES], of.number % LANES);
                for f in 0..SEQUENCES {
                    let n = set * SEQUENCES + f;
                    group.functions[0][n][lane] = 0.5 * (values[0][f] + values[1][f]);
                    group.functions[1][n][lane] = 0.5 * (values[0][f] - values[1][f]);
                    group.errors[n][lane] = cells[0].error[n].max(cells[1].error[n]);
                }
            }
        }
    }
}
