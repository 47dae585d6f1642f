//! A cell: polynomials of a recording's functions about a point of the plane of poles.

use super::geometry::{Key, NODES, RADIUS};
use super::moments::values;
use super::response::FUNCTIONS;
use super::sequences::{PointValues, Rows, SEQUENCES, rows_that_count};
use super::series::Series;
use crate::cpu::Level;
use motorfit_core::numeric::count;
use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::SplitMix64;
use std::f64::consts::TAU;
use std::sync::LazyLock;
use std::sync::atomic::AtomicU64;

/// Number of points at which a cell is compared with the functions.
const CHECKED: usize = 4;
/// Rounding error of a value, relative to it.
const ROUNDING: f64 = 2.0 * f64::EPSILON;

/// Polynomials of the functions of one set, `[coefficient][real parts, imaginary parts]`.
pub(super) type Polynomials = [PointValues; NODES];

/// A cell of the tables.
#[derive(Debug)]
pub(super) struct Cell {
    pub key: Key,
    /// Polynomials of the forced motion, and of the free one if there is any.
    pub forced: Polynomials,
    free: Option<Box<Polynomials>>,
    /// Bound of the error of each function: the largest at the points that were checked, and rounding.
    pub error: [f64; FUNCTIONS],
    /// The last batch that used it.
    pub used: AtomicU64,
}

/// Powers `e^{−2πikn/N}/N` of the discrete Fourier transform.
static TWIDDLES: LazyLock<[[f64; 2]; NODES]> = LazyLock::new(|| {
    std::array::from_fn(|n| {
        let angle = TAU * count(n) / count(NODES);
        [angle.cos() / count(NODES), -angle.sin() / count(NODES)]
    })
});

impl Cell {
    /// Returns the polynomials of a set.
    #[inline(always)]
    pub fn polynomials(&self, set: usize) -> &Polynomials {
        match &self.free {
            Some(free) if set == 1 => free,
            _ => &self.forced,
        }
    }

    /// Computes the functions of a recording at the nodes of a cell, and their polynomials.
    pub fn new(series: &Series, key: Key, level: Level) -> Self {
        let on_circle = (0..NODES).map(|n| [count(n) / count(NODES), 1.0]);
        let w = on_circle.chain(checked(key)).map(|[part, radius]| {
            let (sin, cos) = (TAU * part).sin_cos();
            [RADIUS * radius * cos, RADIUS * radius * sin]
        });
        let w: Vec<[f64; 2]> = w.collect();
        let (shift, h) = (series.shift(), series.step_s);
        let exponents: Vec<[f64; 2]> = w
            .iter()
            .map(|w| {
                let [re, im] = key.point(*w);
                [(shift - re) * h, -im * h]
            })
            .collect();
        let decay = (key.least() - shift) * h;
        // The root of Σ |λ|²ᵏ: independent errors of the coefficients add up by squares.
        let powers = if decay > 0.0 { 1.0 / -(-2.0 * decay).exp_m1() } else { f64::INFINITY };
        let spread = powers.min(count(series.samples)).sqrt();
        let (forced, used) = ([[0.0; 2 * SEQUENCES]; NODES], AtomicU64::new(0));
        let mut cell = Self { key, forced, free: None, error: [0.0; FUNCTIONS], used };
        for (set, rows) in series.sets.iter().enumerate() {
            let rows: &Rows = &rows[..rows_that_count(rows, decay)];
            let values = values(rows, &exponents, level);
            let polynomials = transformed(&values[..NODES], key.row() == 0);
            // The imaginary part of a pole is rounded, which counts in units of the side.
            let rounding = ROUNDING * (1.0 + count(key.row()));
            for (w, value) in w.iter().zip(&values).skip(NODES) {
                let error = errors(&polynomials, (*w, rounding), value);
                for (n, error) in error.into_iter().enumerate() {
                    let own = &mut cell.error[set * SEQUENCES + n];
                    *own = own.max(error);
                }
            }
            if set == 0 {
                cell.forced = polynomials;
            } else {
                cell.free = Some(Box::new(polynomials));
            }
        }
        for (error, rounding) in cell.error.iter_mut().zip(series.rounding) {
            *error += rounding * spread;
        }
        cell
    }
}

/// Returns random points at which a cell is checked, the same whenever it is built: parts of the circle about the middle between two nodes,
/// where the error is largest, and radii in that of the circle.
fn checked(key: Key) -> impl Iterator<Item = [f64; 2]> {
    let mut numbers = SplitMix64::seed_from_u64(u64::from(key.0));
    (0..CHECKED).map(move |_| {
        let [node, apart, inside] = [(); 3].map(|()| numbers.random::<f64>());
        let place = (node * count(NODES)).floor() + 0.35 + 0.3 * apart;
        [place / count(NODES), 1.0 - 0.1 * inside]
    })
}

/// Returns the coefficients of the polynomials in `w/r` through values on the circle.
fn transformed(values: &[PointValues], is_real: bool) -> Polynomials {
    let twiddles = &*TWIDDLES;
    std::array::from_fn(|k| {
        let mut sums = [0.0; 2 * SEQUENCES];
        for (n, value) in values.iter().enumerate() {
            let [re, im] = twiddles[k * n % NODES];
            for f in 0..SEQUENCES {
                sums[f] += value[f] * re - value[SEQUENCES + f] * im;
                sums[SEQUENCES + f] += value[f] * im + value[SEQUENCES + f] * re;
            }
        }
        if is_real {
            sums[SEQUENCES..].fill(0.0);
        }
        sums
    })
}

/// Returns the distance of each polynomial from the value at w, and at least the error of rounding.
fn errors(polynomials: &Polynomials, (w, rounding): ([f64; 2], f64), value: &PointValues) -> [f64; SEQUENCES] {
    let [x, y] = w.map(|part| part / RADIUS);
    let mut sums = [0.0; 2 * SEQUENCES];
    for row in polynomials.iter().rev() {
        for f in 0..SEQUENCES {
            let (re, im) = (sums[f], sums[SEQUENCES + f]);
            sums[f] = re * x - im * y + row[f];
            sums[SEQUENCES + f] = re * y + im * x + row[SEQUENCES + f];
        }
    }
    std::array::from_fn(|f| {
        let size = value[f].hypot(value[SEQUENCES + f]);
        let distance = (sums[f] - value[f]).hypot(sums[SEQUENCES + f] - value[SEQUENCES + f]);
        // NaN becomes an infinite error.
        if size.is_finite() && distance.is_finite() { distance.max(rounding * size) } else { f64::INFINITY }
    })
}
