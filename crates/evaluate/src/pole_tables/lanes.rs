//! Candidates side by side: polynomials of a cell, and sums of squared errors.
//!
//! Each function is compiled for each SIMD level by itself: arrays that come through memory become vectors.

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays alike; that is what vectorizes")]

use super::cell::Polynomials;
use super::geometry::{NODES, NOWHERE, Place};
use super::response::{FUNCTIONS, Functions, sums};
use super::sequences::{PointValues, SEQUENCES};
use super::series::{Form, Series};
use super::transition::{Matrices, Transitions};
use crate::at_level::at_level;
use crate::cpu::Level;
use motorfit_motor::multiply_add;

/// Number of candidates side by side.
pub(super) const LANES: usize = 8;
/// A number of each candidate.
pub(super) type Lane = [f64; LANES];

/// Candidates side by side.
#[repr(C, align(64))]
pub(super) struct CandidateLanes {
    pub matrices: Matrices<LANES>,
    /// Keys of the cells of the first poles, and of second real ones.
    pub keys: [[u64; LANES]; 2],
    /// The points of the first poles.
    pub v: [Lane; 3],
    /// The points of second real poles.
    pub second: Lane,
    /// Factor of β.
    pub inverse: Lane,
    /// Ratio of the errors of β and α.
    pub slope: Lane,
    /// α and β of the functions at the poles; β still lacks its factor.
    pub functions: [[Lane; FUNCTIONS]; 2],
    /// Bounds of the errors of the functions; infinite ones where there is no cell.
    pub errors: [Lane; FUNCTIONS],
}

impl Default for CandidateLanes {
    fn default() -> Self {
        Self {
            matrices: Matrices::new(&[[1.0; LANES]; 5]),
            keys: [[NOWHERE; LANES]; 2],
            v: [[0.0; LANES]; 3],
            second: [0.0; LANES],
            inverse: [0.0; LANES],
            slope: [0.0; LANES],
            functions: [[[0.0; LANES]; FUNCTIONS]; 2],
            errors: [[0.0; LANES]; FUNCTIONS],
        }
    }
}

/// Number of groups of candidates that are evaluated together, stage by stage: the divisions and roots of one take long, but do not wait
/// for those of another.
pub(super) const GROUPS: usize = 4;
/// Number of candidates that are evaluated together.
pub(super) const CANDIDATES: usize = GROUPS * LANES;
/// Groups that are evaluated together.
pub(super) type Groups = [CandidateLanes; GROUPS];
/// R, L, K, B and J of the candidates of the groups.
pub(super) type GroupRows = [[f64; 5]; CANDIDATES];

/// Computes the matrices of candidates and the places of their poles.
pub(super) fn place(rows: &GroupRows, shift: f64, groups: &mut Groups, level: Level) {
    match level {
        Level::Avx512 => place_avx512(rows, shift, groups),
        Level::Avx2 => place_avx2(rows, shift, groups),
        Level::Portable => place_portable(rows, shift, groups),
    }
}

#[inline(always)]
fn placed(rows: &GroupRows, shift: f64, groups: &mut Groups) {
    for (rows, lanes) in rows.as_chunks::<LANES>().0.iter().zip(groups) {
        let mut parameters = [[0.0; LANES]; 5];
        for lane in 0..LANES {
            for p in 0..5 {
                parameters[p][lane] = rows[lane][p];
            }
        }
        // The black box forces the lanes through memory; otherwise the compiler splits them into scalars.
        let parameters = std::hint::black_box(&parameters);
        lanes.matrices = Matrices::new(parameters);
        let lanes = std::hint::black_box(lanes);
        for lane in 0..LANES {
            let Place { key, second_key, v, second, inverse, slope } = Place::new(&lanes.matrices.at(lane), shift);
            (lanes.keys[0][lane], lanes.keys[1][lane]) = (key, second_key);
            (lanes.v[0][lane], lanes.v[1][lane], lanes.v[2][lane]) = (v[0], v[1], v[2]);
            (lanes.second[lane], lanes.inverse[lane], lanes.slope[lane]) = (second, inverse, slope);
        }
    }
}

at_level! {
    fn place_avx512(rows: &GroupRows, shift: f64, groups: &mut Groups) = avx512 { placed(rows, shift, groups) } else place_avx2
}

at_level! {
    fn place_avx2(rows: &GroupRows, shift: f64, groups: &mut Groups) = avx2 { placed(rows, shift, groups) } else place_portable
}

fn place_portable(rows: &GroupRows, shift: f64, groups: &mut Groups) {
    placed(rows, shift, groups);
}

/// Number of points at which polynomials are evaluated together: those of several cells do not wait for each other.
pub(super) const TOGETHER: usize = 8;
/// Polynomials of the functions of one set in the cells of some points.
pub(super) type CellPolynomials<'a> = [&'a Polynomials; TOGETHER];

/// Evaluates polynomials at points.
pub(super) fn polynomials(
    of: &CellPolynomials<'_>,
    v: &[[f64; 3]; TOGETHER],
    values: &mut [PointValues; TOGETHER],
    level: Level,
) {
    match level {
        Level::Avx512 => polynomials_avx512(of, v, values),
        Level::Avx2 => polynomials_avx2(of, v, values),
        Level::Portable => polynomials_portable(of, v, values),
    }
}

/// Evaluates polynomials at `P` points at a time, even and odd powers apart: their sums do not wait for each other.
#[inline(always)]
fn horner<const FMA: bool, const P: usize>(
    of: &CellPolynomials<'_>,
    v: &[[f64; 3]; TOGETHER],
    values: &mut [PointValues; TOGETHER],
) {
    for first in (0..TOGETHER).step_by(P) {
        let mut sums = [[[0.0; 2 * SEQUENCES]; 2]; P];
        for k in (0..NODES / 2).rev() {
            for p in 0..P {
                let [x, y, z] = v[first + p];
                let square = [x * x + y * z, 2.0 * x * y, 2.0 * x * z];
                for half in 0..2 {
                    sums[p][half] = next::<FMA>(&sums[p][half], square, &of[first + p][2 * k + half]);
                }
            }
        }
        for p in 0..P {
            values[first + p] = next::<FMA>(&sums[p][1], v[first + p], &sums[p][0]);
        }
    }
}

/// Returns values times a point plus a coefficient.
#[inline(always)]
fn next<const FMA: bool>(sum: &PointValues, [x, y, z]: [f64; 3], row: &PointValues) -> PointValues {
    let mut next = [0.0; 2 * SEQUENCES];
    for f in 0..SEQUENCES {
        let (a, b) = (sum[f], sum[SEQUENCES + f]);
        next[f] = multiply_add::<FMA>(b, y, multiply_add::<FMA>(a, x, row[f]));
        next[SEQUENCES + f] = multiply_add::<FMA>(a, z, multiply_add::<FMA>(b, x, row[SEQUENCES + f]));
    }
    next
}

at_level! {
    fn polynomials_avx512(of: &CellPolynomials<'_>, v: &[[f64; 3]; TOGETHER], values: &mut [PointValues; TOGETHER]) = avx512 { horner::<true, 4>(of, v, values) } else polynomials_avx2
}

at_level! {
    fn polynomials_avx2(of: &CellPolynomials<'_>, v: &[[f64; 3]; TOGETHER], values: &mut [PointValues; TOGETHER]) = avx2 { horner::<true, 2>(of, v, values) } else polynomials_portable
}

fn polynomials_portable(of: &CellPolynomials<'_>, v: &[[f64; 3]; TOGETHER], values: &mut [PointValues; TOGETHER]) {
    horner::<false, 4>(of, v, values);
}

/// Values of four functions at real points.
pub(super) type RealValues = [[f64; SEQUENCES]; TOGETHER];

/// Evaluates polynomials at real points.
pub(super) fn real_polynomials(of: &CellPolynomials<'_>, v: &[f64; TOGETHER], values: &mut RealValues, level: Level) {
    match level {
        Level::Avx512 => real_avx512(of, v, values),
        Level::Avx2 => real_avx2(of, v, values),
        Level::Portable => real_portable(of, v, values),
    }
}

#[inline(always)]
fn real_horner<const FMA: bool>(of: &CellPolynomials<'_>, v: &[f64; TOGETHER], values: &mut RealValues) {
    let mut sums = [[0.0; SEQUENCES]; TOGETHER];
    for k in (0..NODES).rev() {
        for p in 0..TOGETHER {
            let row = &of[p][k];
            for f in 0..SEQUENCES {
                sums[p][f] = multiply_add::<FMA>(sums[p][f], v[p], row[f]);
            }
        }
    }
    *values = sums;
}

at_level! {
    fn real_avx512(of: &CellPolynomials<'_>, v: &[f64; TOGETHER], values: &mut RealValues) = avx512 { real_horner::<true>(of, v, values) } else real_avx2
}

at_level! {
    fn real_avx2(of: &CellPolynomials<'_>, v: &[f64; TOGETHER], values: &mut RealValues) = avx2 { real_horner::<true>(of, v, values) } else real_portable
}

fn real_portable(of: &CellPolynomials<'_>, v: &[f64; TOGETHER], values: &mut RealValues) {
    real_horner::<false>(of, v, values);
}

/// The sums of squared errors of current and speed, and their bounds.
pub(super) type Sums = [[Lane; 2]; 2];

/// Computes the sums of squared errors.
pub(super) fn squared_errors(series: &Series, lanes: &CandidateLanes, results: &mut Sums, level: Level) {
    match level {
        Level::Avx512 => sums_avx512(series, lanes, results),
        Level::Avx2 => sums_avx2(series, lanes, results),
        Level::Portable => sums_portable(series, lanes, results),
    }
}

at_level! {
    fn sums_avx512(series: &Series, lanes: &CandidateLanes, results: &mut Sums) = avx512 { all::<true>(series, lanes, results) } else sums_avx2
}

at_level! {
    fn sums_avx2(series: &Series, lanes: &CandidateLanes, results: &mut Sums) = avx2 { all::<true>(series, lanes, results) } else sums_portable
}

fn sums_portable(series: &Series, lanes: &CandidateLanes, results: &mut Sums) {
    all::<false>(series, lanes, results);
}

#[inline(always)]
fn all<const FMA: bool>(series: &Series, lanes: &CandidateLanes, results: &mut Sums) {
    let is_general = series.sets.len() > 1 || series.is_first_order_hold;
    match (is_general, series.form) {
        (true, Form::Voltage) => each::<FMA, true, false>(series, lanes, results),
        (true, Form::Changes) => each::<FMA, true, true>(series, lanes, results),
        (false, Form::Voltage) => each::<FMA, false, false>(series, lanes, results),
        (false, Form::Changes) => each::<FMA, false, true>(series, lanes, results),
    }
}

#[inline(always)]
fn each<const FMA: bool, const GENERAL: bool, const CHANGES: bool>(
    series: &Series,
    lanes: &CandidateLanes,
    results: &mut Sums,
) {
    let steps = Transitions::new::<FMA, GENERAL>(&lanes.matrices, series.step_s);
    // The black box forces the lanes through memory; otherwise the compiler splits them into scalars.
    let steps = std::hint::black_box(&steps);
    for lane in 0..LANES {
        let matrix = lanes.matrices.at(lane);
        let step = steps.at(lane);
        let zero = [0.0; FUNCTIONS];
        let mut functions = Functions { alpha: zero, beta: zero, error: zero, slope: lanes.slope[lane] };
        for f in 0..if GENERAL { FUNCTIONS } else { SEQUENCES } {
            functions.alpha[f] = lanes.functions[0][f][lane];
            functions.beta[f] = lanes.inverse[lane] * lanes.functions[1][f][lane];
            functions.error[f] = lanes.errors[f][lane];
        }
        let sums = sums::<GENERAL, CHANGES>(series, &matrix, &step, &functions);
        for c in 0..2 {
            results[0][c][lane] = sums[c].value;
            results[1][c][lane] = sums[c].error;
        }
    }
}
