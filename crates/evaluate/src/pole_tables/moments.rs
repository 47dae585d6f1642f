//! Power series of a recording at points near each other, by moments of blocks of its coefficients.
//!
//! With `λ = e^e` and a common exponent c of the points, the B terms of a block from `k` on are
//! `λᵏ Σ c[k+j] e^{cj} e^{(e−c)j}`. For `|e − c| B/2 ≤ 1` the last factor is a Taylor polynomial in the place `x = (2j − B + 1)/B` within the
//! block, so that a block has as many moments `Σ c[k+j] e^{cj} xᵐ`, which all points share.

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays alike; that is what vectorizes")]

use super::sequences::{PointValues, Rows, SEQUENCES};
use crate::at_level::at_level;
use crate::cpu::Level;
use motorfit_core::numeric::{count, whole};
use motorfit_motor::multiply_add;

/// Largest number of moments.
const MOMENTS: usize = 18;
/// Number of moments that are summed at a time.
const AT_A_TIME: usize = 6;
/// Numbers of moments and the largest |e − c| B/2 for each: the next term of the exponential function is below 2e-16.
const ACCURACIES: [(usize, f64); 2] = [(12, 0.25), (18, 1.0)];
/// Largest number of rows of a block, whose weights and places stay in the first cache.
const ROWS_MAX: usize = 128;
/// Factors and powers between two exact ones.
const RESTART: usize = 64;
/// Number of points side by side.
const LANES: usize = 8;

/// Moments of a block, real and imaginary parts.
type Moments = [PointValues; MOMENTS];
type Complex = [f64; 2];

/// Blocks of a number of rows.
struct Blocks {
    center: Complex,
    /// Number of rows.
    size: usize,
    /// Number of moments.
    moments: usize,
    /// `e^{cj}` of each row of a block: its real part four times, then its imaginary part.
    weights: Vec<PointValues>,
    /// `xᵐ` of each row.
    places: Vec<[f64; MOMENTS]>,
}

impl Blocks {
    /// Returns the largest blocks for points, given by their exponents.
    fn new(points: &[Complex], most: usize) -> Self {
        let of = |part: usize| points.iter().map(move |point| point[part]);
        let middle =
            |part: usize| 0.5 * (of(part).fold(f64::INFINITY, f64::min) + of(part).fold(f64::NEG_INFINITY, f64::max));
        let center = [middle(0), middle(1)];
        let radius = points.iter().map(|e| (e[0] - center[0]).hypot(e[1] - center[1])).fold(0.0, f64::max);
        let size = |reach: f64| whole((2.0 * reach / radius).min(count(most.min(ROWS_MAX)))).max(1);
        // The operations of a row: in the moments, and its part of those in the sums at the points.
        let cost =
            |&(moments, reach): &(usize, f64)| count(moments) * (1.0 + 2.0 * count(points.len()) / count(size(reach)));
        let cheapest = ACCURACIES.iter().min_by(|a, b| cost(a).total_cmp(&cost(b)));
        let &(moments, reach) = cheapest.unwrap_or(&ACCURACIES[0]);
        let size = size(reach);
        let place = |j: usize| {
            let x = (2.0 * count(j) - count(size - 1)) / count(size);
            let mut powers = [1.0; MOMENTS];
            for m in 1..MOMENTS {
                powers[m] = powers[m - 1] * x;
            }
            powers
        };
        Self { center, size, moments, weights: weights(center, size), places: (0..size).map(place).collect() }
    }
}

/// Returns `e^{cj}` for j below a number.
fn weights(center: Complex, size: usize) -> Vec<PointValues> {
    let factor = exponential(center);
    let mut weights = Vec::with_capacity(size);
    let mut weight = [1.0, 0.0];
    for j in 0..size {
        if j % RESTART == 0 {
            weight = exponential(center.map(|part| part * count(j)));
        }
        let [re, im] = weight;
        weights.push([re, re, re, re, im, im, im, im]);
        weight = product(weight, factor);
    }
    weights
}

fn exponential([x, y]: Complex) -> Complex {
    let (sin, cos) = y.sin_cos();
    [x.exp() * cos, x.exp() * sin]
}

fn product(a: Complex, b: Complex) -> Complex {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

/// Returns the sums `Σ c[k] λᵏ` at points near each other.
pub(super) fn values(rows: &Rows, points: &[Complex], level: Level) -> Vec<PointValues> {
    let blocks = Blocks::new(points, rows.len());
    let mut all = vec![[[0.0; 2 * SEQUENCES]; MOMENTS]; rows.len().div_ceil(blocks.size)];
    for (rows, moments) in rows.chunks(blocks.size).zip(&mut all) {
        match level {
            Level::Avx512 => moments_avx512(rows, &blocks, moments),
            Level::Avx2 => moments_avx2(rows, &blocks, moments),
            Level::Portable => moments_portable(rows, &blocks, moments),
        }
        let mut factorial = 1.0;
        for (m, moment) in moments.iter_mut().enumerate() {
            factorial *= count(m.max(1));
            moment.iter_mut().for_each(|value| *value /= factorial);
        }
    }
    let mut values = vec![[0.0; 2 * SEQUENCES]; points.len()];
    for (points, values) in points.chunks(LANES).zip(values.chunks_mut(LANES)) {
        let lanes = PointLanes::new(points, &blocks);
        let mut sums = [[0.0; LANES]; 2 * SEQUENCES];
        match level {
            Level::Avx512 => sums_avx512(&all, &lanes, &mut sums),
            Level::Avx2 => sums_avx2(&all, &lanes, &mut sums),
            Level::Portable => sums_portable(&all, &lanes, &mut sums),
        }
        for (lane, values) in values.iter_mut().enumerate() {
            *values = std::array::from_fn(|n| sums[n][lane]);
        }
    }
    values
}

/// Adds the rows of a block to its moments, `M` of them at a time.
#[inline(always)]
fn add<const FMA: bool, const M: usize>(rows: &Rows, blocks: &Blocks, moments: &mut Moments) {
    for (part, moments) in moments[..blocks.moments].as_chunks_mut::<M>().0.iter_mut().enumerate() {
        let mut sums = [[0.0; 2 * SEQUENCES]; M];
        for ((row, weight), places) in rows.iter().zip(&blocks.weights).zip(&blocks.places) {
            let mut own = [0.0; 2 * SEQUENCES];
            for f in 0..SEQUENCES {
                own[f] = row[f] * weight[f];
                own[SEQUENCES + f] = row[f] * weight[SEQUENCES + f];
            }
            for m in 0..M {
                let place = places[part * M + m];
                for n in 0..2 * SEQUENCES {
                    sums[m][n] = multiply_add::<FMA>(own[n], place, sums[m][n]);
                }
            }
        }
        *moments = sums;
    }
}

at_level! {
    fn moments_avx512(rows: &Rows, blocks: &Blocks, moments: &mut Moments) = avx512 { add::<true, AT_A_TIME>(rows, blocks, moments) } else moments_avx2
}

at_level! {
    fn moments_avx2(rows: &Rows, blocks: &Blocks, moments: &mut Moments) = avx2 { add::<true, AT_A_TIME>(rows, blocks, moments) } else moments_portable
}

fn moments_portable(rows: &Rows, blocks: &Blocks, moments: &mut Moments) {
    add::<false, AT_A_TIME>(rows, blocks, moments);
}

/// Points side by side.
#[repr(C, align(64))]
struct PointLanes {
    /// Exponents of the first row of a block.
    exponents: [[f64; LANES]; 2],
    /// `(e − c) B/2`.
    z: [[f64; LANES]; 2],
    /// `e^{(e−c)(B−1)/2}`.
    middle: [[f64; LANES]; 2],
    /// `e^{eB}`.
    step: [[f64; LANES]; 2],
    size: f64,
    moments: usize,
}

impl PointLanes {
    fn new(points: &[Complex], blocks: &Blocks) -> Self {
        let zero = [[0.0; LANES]; 2];
        let size = count(blocks.size);
        let mut lanes = Self { exponents: zero, z: zero, middle: zero, step: zero, size, moments: blocks.moments };
        for lane in 0..LANES {
            let e = points[lane.min(points.len() - 1)];
            let apart = [e[0] - blocks.center[0], e[1] - blocks.center[1]];
            let middle = exponential(apart.map(|part| 0.5 * part * (size - 1.0)));
            let step = exponential(e.map(|part| part * size));
            for part in 0..2 {
                lanes.exponents[part][lane] = e[part];
                lanes.z[part][lane] = 0.5 * apart[part] * size;
                lanes.middle[part][lane] = middle[part];
                lanes.step[part][lane] = step[part];
            }
        }
        lanes
    }

    /// Returns the power of λ at the first row of a block.
    fn power(&self, block: usize) -> [[f64; LANES]; 2] {
        let mut power = [[0.0; LANES]; 2];
        for lane in 0..LANES {
            let exponent =
                [self.exponents[0][lane], self.exponents[1][lane]].map(|part| part * self.size * count(block));
            let own = product(exponential(exponent), [self.middle[0][lane], self.middle[1][lane]]);
            (power[0][lane], power[1][lane]) = (own[0], own[1]);
        }
        power
    }
}

/// Sums the blocks at points.
#[inline(always)]
fn summed<const FMA: bool>(all: &[Moments], lanes: &PointLanes, sums: &mut [[f64; LANES]; 2 * SEQUENCES]) {
    let mut power = [[0.0; LANES]; 2];
    for (block, moments) in all.iter().enumerate() {
        if block % RESTART == 0 {
            power = lanes.power(block);
        }
        let mut own = [[0.0; LANES]; 2 * SEQUENCES];
        polynomial::<FMA>(&moments[..lanes.moments], &lanes.z, &mut own);
        let own = std::hint::black_box(&own);
        for f in 0..SEQUENCES {
            for lane in 0..LANES {
                let (re, im) = (own[f][lane], own[SEQUENCES + f][lane]);
                sums[f][lane] += power[0][lane] * re - power[1][lane] * im;
                sums[SEQUENCES + f][lane] += power[0][lane] * im + power[1][lane] * re;
            }
        }
        for lane in 0..LANES {
            let (re, im) = (power[0][lane], power[1][lane]);
            power[0][lane] = re * lanes.step[0][lane] - im * lanes.step[1][lane];
            power[1][lane] = re * lanes.step[1][lane] + im * lanes.step[0][lane];
        }
    }
}

/// Evaluates the polynomials with the moments of a block.
#[inline(always)]
fn polynomial<const FMA: bool>(
    moments: &[PointValues],
    z: &[[f64; LANES]; 2],
    sums: &mut [[f64; LANES]; 2 * SEQUENCES],
) {
    for moment in moments.iter().rev() {
        for f in 0..SEQUENCES {
            for lane in 0..LANES {
                let (re, im) = (sums[f][lane], sums[SEQUENCES + f][lane]);
                let next = multiply_add::<FMA>(re, z[0][lane], moment[f]);
                let other = multiply_add::<FMA>(re, z[1][lane], moment[SEQUENCES + f]);
                sums[f][lane] = multiply_add::<FMA>(-im, z[1][lane], next);
                sums[SEQUENCES + f][lane] = multiply_add::<FMA>(im, z[0][lane], other);
            }
        }
    }
}

at_level! {
    fn sums_avx512(all: &[Moments], lanes: &PointLanes, sums: &mut [[f64; LANES]; 2 * SEQUENCES]) = avx512 { summed::<true>(all, lanes, sums) } else sums_avx2
}

at_level! {
    fn sums_avx2(all: &[Moments], lanes: &PointLanes, sums: &mut [[f64; LANES]; 2 * SEQUENCES]) = avx2 { summed::<true>(all, lanes, sums) } else sums_portable
}

fn sums_portable(all: &[Moments], lanes: &PointLanes, sums: &mut [[f64; LANES]; 2 * SEQUENCES]) {
    summed::<false>(all, lanes, sums);
}
