//! Candidates side by side: polynomials of a cell, and sums of squared errors.
//!
//! Each function is compiled for each SIMD level by itself: arrays that come through memory become vectors.

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays alike; that is what vectorizes")]

use super::cell::Polynomials;
use super::geometry::{Kind, Poles};
use super::nodes::SEQUENCES;
use super::response::{FUNCTIONS, Functions, sums};
use super::series::Series;
use super::transition::{Matrices, Transitions};
use crate::evaluate::at_level::at_level;
use crate::evaluate::cpu::Level;
use crate::motor::multiply_add;

/// Number of candidates side by side.
pub(super) const LANES: usize = 8;
/// A number of each candidate.
pub(super) type Lane = [f64; LANES];
/// Real parts of the functions of a set, then imaginary parts.
pub(super) type LaneValues = [Lane; 2 * SEQUENCES];

/// Evaluates the polynomials of a set at the points of candidates.
pub(super) fn polynomials(of: &Polynomials, v: &[Lane; 3], values: &mut LaneValues, level: Level) {
    match level {
        Level::Avx512 => polynomials_avx512(of, v, values),
        Level::Avx2 => polynomials_avx2(of, v, values),
        Level::Portable => polynomials_portable(of, v, values),
    }
}

#[inline(always)]
fn horner<const FMA: bool>(of: &Polynomials, v: &[Lane; 3], values: &mut LaneValues) {
    let mut sums = [[0.0; LANES]; 2 * SEQUENCES];
    for row in of.iter().rev() {
        for f in 0..SEQUENCES {
            for lane in 0..LANES {
                let (a, b) = (sums[f][lane], sums[SEQUENCES + f][lane]);
                let re = multiply_add::<FMA>(a, v[0][lane], row[f]);
                let im = multiply_add::<FMA>(b, v[0][lane], row[SEQUENCES + f]);
                sums[f][lane] = multiply_add::<FMA>(b, v[1][lane], re);
                sums[SEQUENCES + f][lane] = multiply_add::<FMA>(a, v[2][lane], im);
            }
        }
    }
    *values = sums;
}

at_level! {
    fn polynomials_avx512(of: &Polynomials, v: &[Lane; 3], values: &mut LaneValues) = avx512 { horner::<true>(of, v, values) } else polynomials_avx2
}

at_level! {
    fn polynomials_avx2(of: &Polynomials, v: &[Lane; 3], values: &mut LaneValues) = avx2 { horner::<true>(of, v, values) } else polynomials_portable
}

fn polynomials_portable(of: &Polynomials, v: &[Lane; 3], values: &mut LaneValues) {
    horner::<false>(of, v, values);
}

/// Candidates side by side in a cell.
#[repr(C, align(64))]
pub(super) struct CellLanes {
    pub matrices: Matrices<LANES>,
    /// The points of their poles in the cell.
    pub v: [Lane; 3],
    /// LaneValues at the first pole, of both sets.
    pub values: [LaneValues; 2],
    /// LaneValues at the second real pole.
    pub others: [Lane; FUNCTIONS],
    /// Bounds of the errors of the values.
    pub errors: [Lane; FUNCTIONS],
    pub kind: Kind,
    /// Ratio of the errors of β and α for two poles close to each other.
    pub pair_slope: f64,
}

impl CellLanes {
    pub fn new() -> Self {
        Self {
            matrices: Matrices::new(&[[1.0; LANES]; 5]),
            v: [[0.0; LANES]; 3],
            values: [[[0.0; LANES]; 2 * SEQUENCES]; 2],
            others: [[0.0; LANES]; FUNCTIONS],
            errors: [[0.0; LANES]; FUNCTIONS],
            kind: Kind::Complex,
            pair_slope: 0.0,
        }
    }
}

/// Candidates of a block, given by R, L, K, B and J, and the numbers of those that are side by side in a cell about a point; the poles of a
/// recording are shifted by 2/T.
pub(super) struct Selection<'a> {
    pub rows: &'a [[f64; 5]],
    pub ids: [u32; LANES],
    pub center: [f64; 2],
    pub shift: f64,
}

/// Computes the matrices of candidates and the points of their poles.
pub(super) fn gather(of: &Selection<'_>, lanes: &mut CellLanes, level: Level) {
    match level {
        Level::Avx512 => gather_avx512(of, lanes),
        Level::Avx2 => gather_avx2(of, lanes),
        Level::Portable => gather_portable(of, lanes),
    }
}

#[inline(always)]
fn gather_lanes(of: &Selection<'_>, lanes: &mut CellLanes) {
    let row = |lane: usize| &of.rows[of.ids[lane] as usize];
    let rows = [row(0), row(1), row(2), row(3), row(4), row(5), row(6), row(7)];
    // Written out, the numbers become vectors without a way through memory.
    let all = |p: usize| {
        let [a, b, c, d, e, f, g, h] = rows;
        [a[p], b[p], c[p], d[p], e[p], f[p], g[p], h[p]]
    };
    let parameters = [all(0), all(1), all(2), all(3), all(4)];
    lanes.matrices = Matrices::new(&parameters);
    // The black box forces the lanes through memory; otherwise the compiler splits them into scalars.
    let lanes = std::hint::black_box(lanes);
    for lane in 0..LANES {
        let poles = Poles::new(&lanes.matrices.at(lane), of.shift);
        let v = poles.point(of.center, lanes.kind);
        for p in 0..3 {
            lanes.v[p][lane] = v[p];
        }
    }
}

at_level! {
    fn gather_avx512(of: &Selection<'_>, lanes: &mut CellLanes) = avx512 { gather_lanes(of, lanes) } else gather_avx2
}

at_level! {
    fn gather_avx2(of: &Selection<'_>, lanes: &mut CellLanes) = avx2 { gather_lanes(of, lanes) } else gather_portable
}

fn gather_portable(of: &Selection<'_>, lanes: &mut CellLanes) {
    gather_lanes(of, lanes);
}

/// The sums of squared errors of current and speed, and their bounds.
pub(super) type Sums = [[Lane; 2]; 2];

/// Computes the sums of squared errors.
pub(super) fn squared_errors(series: &Series, lanes: &CellLanes, results: &mut Sums, level: Level) {
    match level {
        Level::Avx512 => sums_avx512(series, lanes, results),
        Level::Avx2 => sums_avx2(series, lanes, results),
        Level::Portable => sums_portable(series, lanes, results),
    }
}

at_level! {
    fn sums_avx512(series: &Series, lanes: &CellLanes, results: &mut Sums) = avx512 { all::<true>(series, lanes, results) } else sums_avx2
}

at_level! {
    fn sums_avx2(series: &Series, lanes: &CellLanes, results: &mut Sums) = avx2 { all::<true>(series, lanes, results) } else sums_portable
}

fn sums_portable(series: &Series, lanes: &CellLanes, results: &mut Sums) {
    all::<false>(series, lanes, results);
}

#[inline(always)]
fn all<const FMA: bool>(series: &Series, lanes: &CellLanes, results: &mut Sums) {
    if series.sets.len() > 1 || series.is_first_order_hold {
        each::<FMA, true>(series, lanes, results);
    } else {
        each::<FMA, false>(series, lanes, results);
    }
}

#[inline(always)]
fn each<const FMA: bool, const GENERAL: bool>(series: &Series, lanes: &CellLanes, results: &mut Sums) {
    let steps = Transitions::new::<FMA, GENERAL>(&lanes.matrices, series.step_s);
    // The black box forces the lanes through memory; otherwise the compiler splits them into scalars.
    let steps = std::hint::black_box(&steps);
    let (is_real, is_pair) = (lanes.kind == Kind::Real, lanes.kind == Kind::Pair);
    for lane in 0..LANES {
        let matrix = lanes.matrices.at(lane);
        let step = steps.at(lane);
        let root = matrix.square.abs().sqrt();
        let inverse = if is_pair { 1.0 } else { 1.0 / root };
        let zero = [0.0; FUNCTIONS];
        let slope = if is_pair { lanes.pair_slope } else { inverse };
        let mut functions = Functions { alpha: zero, beta: zero, error: zero, slope };
        for f in 0..if GENERAL { FUNCTIONS } else { SEQUENCES } {
            let (set, own) = (f / SEQUENCES, f % SEQUENCES);
            let (re, im) = (lanes.values[set][own][lane], lanes.values[set][SEQUENCES + own][lane]);
            let other = lanes.others[f][lane];
            // In q the matrix X has the other sign.
            functions.alpha[f] = if is_real { 0.5 * (re + other) } else { re };
            functions.beta[f] = inverse * if is_real { 0.5 * (re - other) } else { -im };
            functions.error[f] = lanes.errors[f][lane];
        }
        let sums = sums::<GENERAL>(series, &matrix, &step, &functions);
        for c in 0..2 {
            results[0][c][lane] = sums[c].value;
            results[1][c][lane] = sums[c].error;
        }
    }
}
