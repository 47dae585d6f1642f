//! Cells of the plane of poles.
//!
//! A pole s is given by `q = 2/T − s` for a recording of T seconds, so that `λ = e^{sh} = e^{(2/T − q)h}` and no λᵏ of the recording
//! exceeds e² for `Re q ≥ 0`. The functions of a recording are analytic in this half-plane and bounded, so that on a disk of radius r
//! about a point p, in the variable `w = (q − p)/(q + p*)`, the error of a polynomial of degree n is about rⁿ⁺¹. Disks in w are the same
//! at every scale: cells are squares whose side is the power of two below `Re q`, and have one point p on the real axis or in the middle
//! of the square.

use super::transition::Matrix;

/// Number of nodes on the circle of a cell, which is that of the coefficients.
pub(super) const NODES: usize = 28;
/// Radius of the circle in w: that of the corners of a cell.
pub(super) const RADIUS: f64 = 0.26;
/// Real part of the point p, in sides: the corners on both sides are about as far away.
const CENTER: f64 = 1.33;
/// Half the distance of two poles, in sides, up to which they are evaluated as a pair in a cell of the real axis.
const PAIR: f64 = 0.2;
/// Smallest and largest biased exponent of `Re q` that has cells: 2⁻⁶⁰ and 2⁶⁰.
const EXPONENTS: [u64; 2] = [1023 - 60, 1023 + 60];
/// Largest number of a cell above the real axis.
const ROW_MAX: f64 = 65_534.0;

/// A cell: its octave, and its number above the real axis; 0 for the cell on the axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Key(pub u32);

impl Key {
    pub fn octave(self) -> usize {
        (self.0 >> 16) as usize
    }

    pub fn row(self) -> usize {
        (self.0 & 0xffff) as usize
    }

    /// Returns the point p.
    pub fn center(self) -> [f64; 2] {
        let side = f64::from_bits((u64::from(self.0 >> 16) + EXPONENTS[0]) << 52);
        let row = f64::from(self.0 & 0xffff);
        [CENTER * side, if row > 0.0 { (row - 0.5) * side } else { 0.0 }]
    }

    /// Returns the point of the cell at w.
    pub fn point(self, [re, im]: [f64; 2]) -> [f64; 2] {
        let [center, height] = self.center();
        let size = (1.0 - re) * (1.0 - re) + im * im;
        [center * (1.0 - re * re - im * im) / size, height + 2.0 * center * im / size]
    }

    /// Returns the smallest real part of a point on the circle.
    pub fn least(self) -> f64 {
        self.center()[0] * (1.0 - RADIUS) / (1.0 + RADIUS)
    }
}

/// Number in place of a cell's for poles that are in no cell, and for a second pole where there is none.
pub(super) const NOWHERE: u64 = u64::MAX;

/// Slope of the errors of a pair of poles, in those of the functions per real part of the point of the cell.
const PAIR_SLOPE: f64 = 8.0;

/// The cells of the poles `q̄ ± √d` of a motor, and their points in them. A polynomial in `w/r` with the coefficients a is evaluated by
/// `(α, β) ← (α v₀ + β v₁ + Re a, α v₂ + β v₀ + Im a)`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// The key of the cell of both poles, or of the smaller of two real ones.
    pub key: u64,
    /// The key of the cell of the larger of two real poles.
    pub second_key: u64,
    pub v: [f64; 3],
    /// The point of the larger of two real poles.
    pub second: f64,
    /// Factor by which the function's β is that of X.
    pub inverse: f64,
    /// Ratio of the errors of β and α.
    pub slope: f64,
}

impl Place {
    #[inline(always)]
    pub fn new(of: &Matrix, shift: f64) -> Self {
        let (mean, half) = (of.decay + shift, of.square.abs().sqrt());
        // The smaller of two real poles, without cancellation.
        let smaller = of.determinant() / (of.decay + half) + shift;
        let larger = mean + half;
        let is_pair = half < PAIR * power_below(mean);
        let is_real = !is_pair & (of.square >= 0.0);
        let is_complex = !is_pair & !is_real;
        let q = if is_real { smaller } else { mean };
        let side = power_below(q);
        let above = (half * inverse_of_power(side)).floor();
        let row = if is_complex { above + 1.0 } else { 0.0 };
        let is_inside = (octave(q) < OCTAVES) & (row <= ROW_MAX) & (!is_real | (octave(larger) < OCTAVES));
        // The integer is in the low bits of the sum with 2⁵².
        let row_bits = (row + 4_503_599_627_370_496.0).to_bits() & 0xffff;
        let center = CENTER * side;
        let above = if is_complex { half - (above + 0.5) * side } else { 0.0 };
        let distance = if is_pair { -of.square } else { above * above };
        let sum = q + center;
        let inverse = 1.0 / ((sum * sum + distance) * RADIUS);
        let slope = 2.0 * center * inverse;
        let second_center = CENTER * power_below(larger);
        let per_half = 1.0 / half;
        Self {
            key: if is_inside { octave(q) << 16 | row_bits } else { NOWHERE },
            second_key: if is_inside & is_real { octave(larger) << 16 } else { NOWHERE },
            v: [
                (q * q - center * center + distance) * inverse,
                if is_pair { slope * of.square } else { -slope * above },
                if is_pair { slope } else { slope * above },
            ],
            second: (larger - second_center) / ((larger + second_center) * RADIUS),
            inverse: if is_pair { 1.0 } else { per_half },
            slope: if is_pair { PAIR_SLOPE / center } else { per_half },
        }
    }
}

/// Number of octaves.
const OCTAVES: u64 = EXPONENTS[1] - EXPONENTS[0];

/// Returns the inverse of a power of two.
#[inline(always)]
fn inverse_of_power(power: f64) -> f64 {
    f64::from_bits((2046_u64 << 52).wrapping_sub(power.to_bits()))
}

/// Returns the power of two below a positive number.
#[inline(always)]
fn power_below(q: f64) -> f64 {
    f64::from_bits(q.to_bits() & (0x7ff << 52))
}

/// Returns the octave of a number; a large one for numbers outside of the octaves, negative ones and NaN.
#[inline(always)]
fn octave(q: f64) -> u64 {
    (q.to_bits() >> 52).wrapping_sub(EXPONENTS[0])
}

/// Returns the low bits of a key.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "keys have 23 bits")]
pub(super) fn low(key: u64) -> u32 {
    key as u32
}
