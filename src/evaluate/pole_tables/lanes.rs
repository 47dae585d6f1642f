//! Candidates side by side: polynomials of a cell, and sums of squared errors.
//!
//! Each function is compiled for each SIMD level by itself: arrays that come through memory become vectors.

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays alike; that is what vectorizes")]

use super::cell::Polynomials;
use super::geometry::{Kind, Poles};
use super::nodes::TOGETHER;
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
pub(super) type Values = [Lane; 2 * TOGETHER];

/// Evaluates the polynomials of a set at the points of candidates.
pub(super) fn polynomials(of: &Polynomials, v: &[Lane; 3], values: &mut Values, level: Level) {
    match level {
        Level::Avx512 => polynomials_avx512(of, v, values),
        Level::Avx2 => polynomials_avx2(of, v, values),
        Level::Portable => polynomials_portable(of, v, values),
    }
}

#[inline(always)]
fn horner<const FMA: bool>(of: &Polynomials, v: &[Lane; 3], values: &mut Values) {
    let mut sums = [[0.0; LANES]; 2 * TOGETHER];
    for row in of.iter().rev() {
        for f in 0..TOGETHER {
            for lane in 0..LANES {
                let (a, b) = (sums[f][lane], sums[TOGETHER + f][lane]);
                let re = multiply_add::<FMA>(a, v[0][lane], row[f]);
                let im = multiply_add::<FMA>(b, v[0][lane], row[TOGETHER + f]);
                sums[f][lane] = multiply_add::<FMA>(b, v[1][lane], re);
                sums[TOGETHER + f][lane] = multiply_add::<FMA>(a, v[2][lane], im);
            }
        }
    }
    *values = sums;
}

at_level! {
    fn polynomials_avx512(of: &Polynomials, v: &[Lane; 3], values: &mut Values) = avx512 { horner::<true>(of, v, values) } else polynomials_avx2
}

at_level! {
    fn polynomials_avx2(of: &Polynomials, v: &[Lane; 3], values: &mut Values) = avx2 { horner::<true>(of, v, values) } else polynomials_portable
}

fn polynomials_portable(of: &Polynomials, v: &[Lane; 3], values: &mut Values) {
    horner::<false>(of, v, values);
}

/// Candidates side by side in a cell.
#[repr(C, align(64))]
pub(super) struct Side {
    pub matrices: Matrices<LANES>,
    /// The points of their poles in the cell.
    pub v: [Lane; 3],
    /// Values at the first pole, of both sets.
    pub values: [Values; 2],
    /// Values at the second real pole.
    pub others: [Lane; FUNCTIONS],
    /// Bounds of the errors of the values.
    pub errors: [Lane; FUNCTIONS],
    pub kind: Kind,
    /// Ratio of the errors of β and α for two poles close to each other.
    pub pair_slope: f64,
}

impl Side {
    pub fn new() -> Self {
        Self {
            matrices: Matrices::new(&[[1.0; LANES]; 5]),
            v: [[0.0; LANES]; 3],
            values: [[[0.0; LANES]; 2 * TOGETHER]; 2],
            others: [[0.0; LANES]; FUNCTIONS],
            errors: [[0.0; LANES]; FUNCTIONS],
            kind: Kind::Complex,
            pair_slope: 0.0,
        }
    }
}

/// Rows of R, L, K, B and J, and those that are side by side in a cell about a point, for a recording with the shift 2/T.
pub(super) struct Chosen<'a> {
    pub rows: &'a [[f64; 5]],
    pub ids: [u32; LANES],
    pub center: [f64; 2],
    pub shift: f64,
}

/// Computes the matrices of candidates and the points of their poles.
pub(super) fn begin(of: &Chosen<'_>, side: &mut Side, level: Level) {
    match level {
        Level::Avx512 => begin_avx512(of, side),
        Level::Avx2 => begin_avx2(of, side),
        Level::Portable => begin_portable(of, side),
    }
}

#[inline(always)]
fn gathered(of: &Chosen<'_>, side: &mut Side) {
    let row = |lane: usize| &of.rows[of.ids[lane] as usize];
    let rows = [row(0), row(1), row(2), row(3), row(4), row(5), row(6), row(7)];
    // Written out, the numbers become vectors without a way through memory.
    let all = |p: usize| {
        let [a, b, c, d, e, f, g, h] = rows;
        [a[p], b[p], c[p], d[p], e[p], f[p], g[p], h[p]]
    };
    let parameters = [all(0), all(1), all(2), all(3), all(4)];
    side.matrices = Matrices::new(&parameters);
    // The black box forces the lanes through memory; otherwise the compiler splits them into scalars.
    let side = std::hint::black_box(side);
    for lane in 0..LANES {
        let poles = Poles::new(&side.matrices.at(lane), of.shift);
        let v = poles.point(of.center, side.kind);
        for p in 0..3 {
            side.v[p][lane] = v[p];
        }
    }
}

at_level! {
    fn begin_avx512(of: &Chosen<'_>, side: &mut Side) = avx512 { gathered(of, side) } else begin_avx2
}

at_level! {
    fn begin_avx2(of: &Chosen<'_>, side: &mut Side) = avx2 { gathered(of, side) } else begin_portable
}

fn begin_portable(of: &Chosen<'_>, side: &mut Side) {
    gathered(of, side);
}

/// The sums of squared errors of current and speed, and their bounds.
pub(super) type Sums = [[Lane; 2]; 2];

/// Computes the sums of squared errors.
pub(super) fn squared_errors(series: &Series, side: &Side, results: &mut Sums, level: Level) {
    match level {
        Level::Avx512 => sums_avx512(series, side, results),
        Level::Avx2 => sums_avx2(series, side, results),
        Level::Portable => sums_portable(series, side, results),
    }
}

at_level! {
    fn sums_avx512(series: &Series, side: &Side, results: &mut Sums) = avx512 { all::<true>(series, side, results) } else sums_avx2
}

at_level! {
    fn sums_avx2(series: &Series, side: &Side, results: &mut Sums) = avx2 { all::<true>(series, side, results) } else sums_portable
}

fn sums_portable(series: &Series, side: &Side, results: &mut Sums) {
    all::<false>(series, side, results);
}

#[inline(always)]
fn all<const FMA: bool>(series: &Series, side: &Side, results: &mut Sums) {
    if series.sets.len() > 1 || series.is_first_order_hold {
        each::<FMA, true>(series, side, results);
    } else {
        each::<FMA, false>(series, side, results);
    }
}

#[inline(always)]
fn each<const FMA: bool, const GENERAL: bool>(series: &Series, side: &Side, results: &mut Sums) {
    let steps = Transitions::new::<FMA, GENERAL>(&side.matrices, series.step_s);
    // The black box forces the lanes through memory; otherwise the compiler splits them into scalars.
    let steps = std::hint::black_box(&steps);
    let (is_real, is_pair) = (side.kind == Kind::Real, side.kind == Kind::Pair);
    for lane in 0..LANES {
        let matrix = side.matrices.at(lane);
        let step = steps.at(lane);
        let root = matrix.square.abs().sqrt();
        let inverse = if is_pair { 1.0 } else { 1.0 / root };
        let zero = [0.0; FUNCTIONS];
        let slope = if is_pair { side.pair_slope } else { inverse };
        let mut functions = Functions { alpha: zero, beta: zero, error: zero, slope };
        for f in 0..if GENERAL { FUNCTIONS } else { TOGETHER } {
            let (set, own) = (f / TOGETHER, f % TOGETHER);
            let (re, im) = (side.values[set][own][lane], side.values[set][TOGETHER + own][lane]);
            let other = side.others[f][lane];
            // In q the matrix X has the other sign.
            functions.alpha[f] = if is_real { 0.5 * (re + other) } else { re };
            functions.beta[f] = inverse * if is_real { 0.5 * (re - other) } else { -im };
            functions.error[f] = side.errors[f][lane];
        }
        let sums = sums::<GENERAL>(series, &matrix, &step, &functions);
        for c in 0..2 {
            results[0][c][lane] = sums[c].value;
            results[1][c][lane] = sums[c].error;
        }
    }
}
