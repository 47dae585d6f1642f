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

/// Kind of the poles of a motor in a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Two poles close to each other, evaluated together.
    Pair,
    Complex,
    /// The first of two real poles, each in a cell of its own.
    Real,
}

/// A cell and the kind of poles in it, as a number: that of the [`Key`] twice, and 1 more for real poles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Code(pub u32);

impl Code {
    /// Poles that are in no cell.
    pub const NOWHERE: Self = Self(u32::MAX);

    pub fn key(self) -> Key {
        Key(self.0 >> 1)
    }

    pub fn is_real(self) -> bool {
        self.0 & 1 == 1
    }
}

/// Poles `q̄ ± √d` of a motor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Poles {
    /// Mean q̄ of the poles.
    pub mean: f64,
    /// Square d of half their distance; negative for complex poles.
    pub square: f64,
    /// The root of |d|.
    pub half: f64,
    /// The smaller q of two real poles, without cancellation.
    pub smaller: f64,
}

impl Poles {
    #[inline(always)]
    pub fn new(of: &Matrix, shift: f64) -> Self {
        let half = of.square.abs().sqrt();
        let smaller = of.determinant() / (of.decay + half) + shift;
        Self { mean: of.decay + shift, square: of.square, half, smaller }
    }

    /// Returns the code of the cell of the poles, or of the first of two real ones.
    #[inline(always)]
    pub fn code(&self) -> u32 {
        let is_pair = self.half < PAIR * power_below(self.mean);
        let is_real = !is_pair && self.square >= 0.0;
        let q = if is_real { self.smaller } else { self.mean };
        let rows = (self.half / power_below(q)).floor();
        let row = if is_pair || is_real { 0.0 } else { rows + 1.0 };
        // The integer is in the low bits of the sum with 2⁵².
        let row_bits = (row + 4_503_599_627_370_496.0).to_bits() & 0xffff;
        let code = ((octave(q) << 16 | row_bits) << 1) + u64::from(is_real);
        let is_inside = octave(q) < EXPONENTS[1] - EXPONENTS[0] && row <= ROW_MAX;
        low(if is_inside { code } else { u64::MAX })
    }

    /// Returns the second of two real poles.
    #[inline(always)]
    pub fn larger(&self) -> f64 {
        self.mean + self.half
    }

    /// Returns the point of the poles in a cell of their kind: a polynomial in `w/r` with the coefficients a is evaluated by
    /// `(α, β) ← (α v₀ + β v₁ + Re a, α v₂ + β v₀ + Im a)`.
    #[inline(always)]
    pub fn point(&self, [center, height]: [f64; 2], kind: Kind) -> [f64; 3] {
        let (is_pair, is_complex) = (kind == Kind::Pair, kind == Kind::Complex);
        let q = if kind == Kind::Real { self.smaller } else { self.mean };
        let above = if is_complex { self.half - height } else { 0.0 };
        let distance = if is_pair { -self.square } else { above * above };
        let sum = q + center;
        let inverse = 1.0 / ((sum * sum + distance) * RADIUS);
        let slope = 2.0 * center * inverse;
        [
            (q * q - center * center + distance) * inverse,
            if is_pair { slope * self.square } else { -slope * above },
            if is_pair { slope } else { slope * above },
        ]
    }
}

/// Returns the code of the cell of a real pole.
#[inline(always)]
pub(super) fn real_code(q: f64) -> u32 {
    let is_inside = octave(q) < EXPONENTS[1] - EXPONENTS[0];
    low(if is_inside { (octave(q) << 17) + 1 } else { u64::MAX })
}

/// Returns the point of a real pole in its cell.
#[inline(always)]
pub(super) fn real_point(q: f64, center: f64) -> f64 {
    (q - center) / ((q + center) * RADIUS)
}

/// Returns the low bits of a code.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "codes have 24 bits")]
fn low(code: u64) -> u32 {
    code as u32
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
