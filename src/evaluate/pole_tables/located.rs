//! Where the poles of candidates lie, and the candidates in the order of their cells.

use super::geometry::{Code, Poles, real_code};
use super::lanes::{LANES, Lane};
use super::transition::Matrices;
use crate::evaluate::at_level::at_level;
use crate::evaluate::cpu::Level;

/// Candidates of a block.
#[derive(Debug, Default)]
pub(super) struct Located {
    /// R, L, K, B and J.
    pub rows: Vec<[f64; 5]>,
    /// Codes of the first poles.
    pub codes: Vec<u32>,
    /// The second ones of two real poles, and their codes.
    pub seconds: Vec<(f64, u32)>,
    /// Place of each candidate in `seconds`.
    pub second: Vec<u32>,
}

/// Poles of candidates side by side.
struct PoleLanes {
    codes: [u32; LANES],
    larger: Lane,
    larger_codes: [u32; LANES],
}

#[inline(always)]
fn side_by_side(rows: &[[f64; 5]; LANES], shift: f64, lanes: &mut PoleLanes) {
    let mut parameters = [[0.0; LANES]; 5];
    for lane in 0..LANES {
        for p in 0..5 {
            parameters[p][lane] = rows[lane][p];
        }
    }
    let parameters = std::hint::black_box(&parameters);
    let matrices = Matrices::new(parameters);
    let matrices = std::hint::black_box(&matrices);
    for lane in 0..LANES {
        let poles = Poles::new(&matrices.at(lane), shift);
        lanes.codes[lane] = poles.code();
        lanes.larger[lane] = poles.larger();
        lanes.larger_codes[lane] = real_code(poles.larger());
    }
}

at_level! {
    fn avx512(rows: &[[f64; 5]; LANES], shift: f64, lanes: &mut PoleLanes) = avx512 { side_by_side(rows, shift, lanes) } else avx2
}

at_level! {
    fn avx2(rows: &[[f64; 5]; LANES], shift: f64, lanes: &mut PoleLanes) = avx2 { side_by_side(rows, shift, lanes) } else portable
}

fn portable(rows: &[[f64; 5]; LANES], shift: f64, lanes: &mut PoleLanes) {
    side_by_side(rows, shift, lanes);
}

impl Located {
    /// Locates candidates, given by R, L, K, B and J, for a recording with the shift 2/T.
    pub fn locate(&mut self, candidates: impl Iterator<Item = [f64; 5]>, shift: f64, level: Level) {
        self.rows.clear();
        self.rows.extend(candidates);
        let count = self.rows.len();
        // The last ones side by side are filled up.
        self.rows.resize(count.next_multiple_of(LANES), [1.0; 5]);
        self.codes.clear();
        self.seconds.clear();
        self.second.clear();
        let mut lanes = PoleLanes { codes: [0; LANES], larger: [0.0; LANES], larger_codes: [0; LANES] };
        let rows = std::mem::take(&mut self.rows);
        for rows in rows.as_chunks::<LANES>().0 {
            match level {
                Level::Avx512 => avx512(rows, shift, &mut lanes),
                Level::Avx2 => avx2(rows, shift, &mut lanes),
                Level::Portable => portable(rows, shift, &mut lanes),
            }
            self.codes.extend_from_slice(&lanes.codes);
            if lanes.codes.iter().any(|code| Code(*code).is_real()) {
                self.add_seconds(&lanes);
            }
        }
        self.rows = rows;
        self.codes.truncate(count);
        self.rows.truncate(count);
    }

    /// Adds the second poles of candidates side by side, the last ones located.
    fn add_seconds(&mut self, lanes: &PoleLanes) {
        let first = self.codes.len() - LANES;
        self.second.resize(first + LANES, u32::MAX);
        for lane in 0..LANES {
            let code = &mut self.codes[first + lane];
            if *code == Code::NOWHERE.0 || !Code(*code).is_real() {
                continue;
            }
            if lanes.larger_codes[lane] == Code::NOWHERE.0 {
                *code = Code::NOWHERE.0;
                continue;
            }
            self.second[first + lane] = u32::try_from(self.seconds.len()).unwrap_or(u32::MAX);
            self.seconds.push((lanes.larger[lane], lanes.larger_codes[lane]));
        }
    }
}

/// Numbers sorted by a slot each, by counting.
#[derive(Debug, Default)]
pub(super) struct Sorted {
    order: Vec<u32>,
    /// The end of each slot in `order`, after the beginning of the first.
    ends: Vec<u32>,
    next: Vec<u32>,
}

impl Sorted {
    /// Sorts the numbers of slots; those of a slot of `count` or above are left out.
    pub fn sort(&mut self, slots: &[u32], count: usize) {
        self.ends.clear();
        self.ends.resize(count + 1, 0);
        for slot in slots {
            if let Some(end) = self.ends.get_mut(*slot as usize + 1) {
                *end += 1;
            }
        }
        for slot in 0..count {
            self.ends[slot + 1] += self.ends[slot];
        }
        self.order.clear();
        self.order.resize(self.ends[count] as usize, 0);
        self.next.clear();
        self.next.extend_from_slice(&self.ends);
        for (number, slot) in (0..).zip(slots) {
            if (*slot as usize) < count {
                let at = &mut self.next[*slot as usize];
                self.order[*at as usize] = number;
                *at += 1;
            }
        }
    }

    /// Returns the numbers of a slot.
    pub fn of(&self, slot: usize) -> &[u32] {
        let (Some(from), Some(to)) = (self.ends.get(slot), self.ends.get(slot + 1)) else { return &[] };
        &self.order[*from as usize..*to as usize]
    }
}
