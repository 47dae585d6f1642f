//! Sums of squared errors of a motor from the functions of a recording at its poles.
//!
//! The sum `S = Σ z zᵀ` follows from the recursion: with `H = Σ v[m] z[m−1]`, the last state e and `V = Σ v²`,
//! `S = Φ (S − e eᵀ) Φᵀ + Φ H bᵀ + b Hᵀ Φᵀ + b bᵀ V + v₀ (x₀ bᵀ + b x₀ᵀ) + x₀ x₀ᵀ`, three linear equations (a Stein equation). For the
//! changes of the voltage `G = Σ u z` follows from `(I − Φ) G = Φ (H − u_last e) + b Σ u v + x₀ u₀`; for the voltage of the sample
//! before it is `H + u_last e`.

use super::bounded::Bounded;
use super::sequences::SEQUENCES;
use super::series::Series;
use super::transition::{Matrix, Transition};

/// Functions of both sets at most.
pub(super) const FUNCTIONS: usize = 2 * SEQUENCES;

/// Functions of the matrix A: each is `α I + β X`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Functions {
    pub alpha: [f64; FUNCTIONS],
    pub beta: [f64; FUNCTIONS],
    /// Bounds of the errors of α; those of β are `slope` times as large.
    pub error: [f64; FUNCTIONS],
    pub slope: f64,
}

/// A vector of current and speed.
type Pair = [Bounded; 2];

impl Functions {
    /// Returns a function of A times a vector, which is given with X times it.
    #[inline(always)]
    fn times(&self, n: usize, [vector, turned]: [[f64; 2]; 2]) -> Pair {
        let part = |c: usize| {
            let error = self.error[n] * (vector[c].abs() + self.slope * turned[c].abs());
            Bounded::new(self.alpha[n] * vector[c] + self.beta[n] * turned[c], error)
        };
        [part(0), part(1)]
    }
}

/// The vectors b and D, and the part of the initial state that moves freely.
struct Drive {
    forced: [f64; 2],
    direct: [f64; 2],
    free: [f64; 2],
}

impl Drive {
    #[inline(always)]
    fn new<const GENERAL: bool, const CHANGES: bool>(series: &Series, of: &Matrix, step: &Transition) -> Self {
        let ramp = if GENERAL && series.is_first_order_hold { step.ramp } else { [0.0; 2] };
        let start = series.products.first_voltage;
        let free = [series.initial[0] - ramp[0] * start, series.initial[1] - ramp[1] * start];
        let scale = of.per_inductance / of.determinant();
        let at_rest = [of.mechanical * scale, of.torque * scale];
        // With a first-order hold u[m−1] has the gain Γ − ramp, and Φ ramp from z = x − ramp u.
        let [a, b, c, d] = step.e;
        let turned = [a * ramp[0] + b * ramp[1], c * ramp[0] + d * ramp[1]];
        let forced = |c: usize| if CHANGES { ramp[c] - at_rest[c] } else { step.gain[c] + turned[c] };
        let direct = |c: usize| if CHANGES { at_rest[c] } else { ramp[c] };
        Self { forced: [forced(0), forced(1)], direct: [direct(0), direct(1)], free }
    }
}

/// Returns the sums of squared errors of current and speed; `GENERAL` with a first-order hold or a motor that moves at the first sample.
#[inline(always)]
pub(super) fn sums<const GENERAL: bool, const CHANGES: bool>(
    series: &Series,
    of: &Matrix,
    step: &Transition,
    functions: &Functions,
) -> Pair {
    let products = &series.products;
    let Drive { forced, direct, free } = Drive::new::<GENERAL, CHANGES>(series, of, step);
    let (forced_too, free_too) = ([forced, of.times(forced)], [free, of.times(free)]);
    let sum = |n: usize| {
        let own = functions.times(n, forced_too);
        if !GENERAL {
            return own;
        }
        let other = functions.times(SEQUENCES + n, free_too);
        [own[0] + other[0], own[1] + other[1]]
    };
    let measured = [sum(0)[0], sum(1)[1]];
    let (before, end) = (sum(2), sum(3));
    let (delayed, last) = (advanced(&step.e, before), advanced(&step.e, end));
    let first = if GENERAL { products.first } else { 0.0 };
    let term = |a: usize, b: usize| {
        let driven = delayed[a] * forced[b] + delayed[b] * forced[a];
        let constant = forced[a] * forced[b] * products.sequence;
        let driven = driven + Bounded::rounded(constant) - last[a] * last[b];
        let moved = first * (free[a] * forced[b] + free[b] * forced[a]) + free[a] * free[b];
        if GENERAL { driven + Bounded::rounded(moved) } else { driven }
    };
    let squares = stein(&step.e, [term(0, 0), term(0, 1), term(1, 1)]);
    let source = |c: usize| {
        let constant = forced[c] * products.mixed + if GENERAL { free[c] * products.first_voltage } else { 0.0 };
        delayed[c] - last[c] * products.last_voltage + Bounded::rounded(constant)
    };
    let from_changes = solved(&step.e, [source(0), source(1)]);
    let from_voltage = |c: usize| before[c] + end[c] * products.last_voltage;
    let with_voltage = |c: usize| if CHANGES { from_changes[c] } else { from_voltage(c) };
    let total = |c: usize| {
        let square = Bounded::rounded(products.measured[c]);
        // With a zero-order hold and the voltage D is zero.
        if !GENERAL && !CHANGES {
            return square + measured[c] * -2.0 + squares[c];
        }
        let constants = [direct[c] * direct[c] * products.voltage, -2.0 * direct[c] * products.with_voltage[c]];
        let own = Bounded::rounded(constants[0]) + Bounded::rounded(constants[1]);
        square + measured[c] * -2.0 + squares[c] + with_voltage(c) * (2.0 * direct[c]) + own
    };
    [total(0), total(1)]
}

/// Returns Φ times a vector.
#[inline(always)]
fn advanced(e: &[f64; 4], of: Pair) -> Pair {
    [of[0] + of[0] * e[0] + of[1] * e[1], of[1] + of[0] * e[2] + of[1] * e[3]]
}

/// Returns x with `−E x = y`.
#[inline(always)]
fn solved(e: &[f64; 4], y: Pair) -> Pair {
    let inverse = -1.0 / (e[0] * e[3] - e[1] * e[2]);
    [(y[0] * e[3] - y[1] * e[1]) * inverse, (y[1] * e[0] - y[0] * e[2]) * inverse]
}

/// Returns the diagonal of S with `S − Φ S Φᵀ = R`; R is given by its elements 11, 12 and 22. Differences from I are taken from E.
#[inline(always)]
fn stein(e: &[f64; 4], r: [Bounded; 3]) -> Pair {
    let [a, b, c, d] = [1.0 + e[0], e[1], e[2], 1.0 + e[3]];
    let first = [-e[0] * (2.0 + e[0]), -2.0 * a * b, -b * b];
    let mixed = [-a * c, -(e[0] + e[3] + (e[0] * e[3] + b * c)), -b * d];
    let second = [-c * c, -2.0 * c * d, -e[3] * (2.0 + e[3])];
    let minor = |a: f64, b: f64, c: f64, d: f64| {
        let (product, other) = (a * b, c * d);
        Bounded::new(product - other, f64::EPSILON * (product.abs() + other.abs()))
    };
    let upper = [
        minor(mixed[1], second[2], mixed[2], second[1]),
        minor(first[2], second[1], first[1], second[2]),
        minor(first[1], mixed[2], first[2], mixed[1]),
    ];
    let lower = [
        minor(mixed[0], second[1], mixed[1], second[0]),
        minor(first[1], second[0], first[0], second[1]),
        minor(first[0], mixed[1], first[1], mixed[0]),
    ];
    let determinant = upper[0] * first[0] + upper[1] * mixed[0] + upper[2] * second[0];
    let inverse = 1.0 / determinant.value;
    let relative = determinant.error * inverse.abs();
    let solved = |row: [Bounded; 3]| {
        let sum = (r[0] * row[0] + r[1] * row[1] + r[2] * row[2]) * inverse;
        Bounded::new(sum.value, sum.error + sum.value.abs() * relative)
    };
    [solved(upper), solved(lower)]
}
