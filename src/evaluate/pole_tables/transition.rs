//! The step of a motor from functions of its matrix.
//!
//! With `A = −m I + X`, `m = (R/L + B/J)/2` and `X² = d I`, `d = (R/L − B/J)²/4 − K²/(LJ)`, each analytic function of A is `α I + β X`:
//! there is no branch between real and complex poles. `φ₁` and `φ₂` of hA are Taylor polynomials of a halved step, which is doubled by
//! `φ₁(2z) = φ₁(z)(1 + (e^z − 1)/2)` and `φ₂(2z) = φ₂(z)/2 + φ₁(z)²/4` (N. J. Higham, Functions of Matrices, 2008, ch. 10).

use crate::motor::multiply_add;

/// Elements of `A` and of its functions.
#[derive(Debug, Clone, Copy)]
pub(super) struct Matrix {
    /// R/L, K/L, K/J and B/J \[1/s\] and 1/L.
    pub electrical: f64,
    pub back: f64,
    pub torque: f64,
    pub mechanical: f64,
    pub per_inductance: f64,
    /// m and d.
    pub decay: f64,
    pub square: f64,
    /// Element of X: (B/J − R/L)/2.
    pub skew: f64,
}

impl Matrix {
    #[inline(always)]
    pub fn new([r, l, k, b, j]: [f64; 5]) -> Self {
        let inverse = 1.0 / (l * j);
        let (per_inductance, per_inertia) = (inverse * j, inverse * l);
        let (electrical, mechanical) = (r * per_inductance, b * per_inertia);
        let skew = 0.5 * (mechanical - electrical);
        Self {
            electrical,
            back: k * per_inductance,
            torque: k * per_inertia,
            mechanical,
            per_inductance,
            decay: 0.5 * (electrical + mechanical),
            square: skew * skew - k * k * inverse,
            skew,
        }
    }

    /// Returns the determinant of A.
    #[inline(always)]
    pub fn determinant(&self) -> f64 {
        self.electrical * self.mechanical + self.back * self.torque
    }

    /// Returns the number of halvings of a step after which |hA| is at most [`HALVED`].
    #[inline(always)]
    pub fn halvings(&self, h: f64) -> u32 {
        let size = (self.decay + self.square.abs().sqrt()) * (h / HALVED);
        // The exponent of a number above 1 is the number of halvings that bring it into 1 to 2; one more brings it to 1 at most.
        let needed = ((size.to_bits() >> 52) & 0x7ff) as u32;
        if size > 1.0 { (needed - 1022).min(HALVINGS_MAX) } else { 0 }
    }

    /// Returns X times a vector.
    #[inline(always)]
    pub fn times(&self, [current, speed]: [f64; 2]) -> [f64; 2] {
        [self.skew * current - self.back * speed, self.torque * current - self.skew * speed]
    }
}

/// Matrices of motors side by side, a field after the other.
pub(super) struct Matrices<const L: usize>([[f64; L]; 8]);

impl<const L: usize> Matrices<L> {
    /// Computes the matrices from R, L, K, B and J.
    #[inline(always)]
    pub fn new(parameters: &[[f64; L]; 5]) -> Self {
        let mut all = [[0.0; L]; 8];
        for lane in 0..L {
            let [r, l, k, b, j] = parameters;
            let own = Matrix::new([r[lane], l[lane], k[lane], b[lane], j[lane]]);
            let Matrix { electrical, back, torque, mechanical, per_inductance, decay, square, skew } = own;
            let fields = [electrical, back, torque, mechanical, per_inductance, decay, square, skew];
            for field in 0..8 {
                all[field][lane] = fields[field];
            }
        }
        Self(all)
    }

    /// Returns one of the matrices.
    #[inline(always)]
    pub fn at(&self, lane: usize) -> Matrix {
        let [electrical, back, torque, mechanical, per_inductance, decay, square, skew] = &self.0;
        Matrix {
            electrical: electrical[lane],
            back: back[lane],
            torque: torque[lane],
            mechanical: mechanical[lane],
            per_inductance: per_inductance[lane],
            decay: decay[lane],
            square: square[lane],
            skew: skew[lane],
        }
    }
}

/// A step: `E = Φ − I`, row-major, and the gains of the voltage at its beginning and end with a first-order hold.
#[derive(Debug, Clone, Copy)]
pub(super) struct Transition {
    pub e: [f64; 4],
    pub gain: [f64; 2],
    pub ramp: [f64; 2],
}

/// An element `α + β x` of the algebra with `x² = square`.
#[derive(Debug, Clone, Copy)]
struct Element(f64, f64);

impl Element {
    #[inline(always)]
    fn times<const FMA: bool>(self, other: Self, square: f64) -> Self {
        let (Self(a, b), Self(c, d)) = (self, other);
        Self(multiply_add::<FMA>(b * square, d, a * c), multiply_add::<FMA>(a, d, b * c))
    }

    /// Returns the polynomial `Σ zⁿ/(n + first)!` with `z = mean + x`.
    #[inline(always)]
    fn series<const FMA: bool>(first: usize, mean: f64, square: f64) -> Self {
        let mut sum = Self(0.0, 0.0);
        for n in (0..TERMS).rev() {
            let Self(a, b) = sum;
            let constant = multiply_add::<FMA>(a, mean, INVERSE_FACTORIALS[first + n]);
            sum = Self(multiply_add::<FMA>(b, square, constant), multiply_add::<FMA>(b, mean, a));
        }
        sum
    }

    /// Returns `new` where the step is still halved, with β in units of the longer step.
    #[inline(always)]
    fn chosen(self, is_halved: bool, new: Self) -> Self {
        Self(if is_halved { new.0 } else { self.0 }, if is_halved { 0.5 * new.1 } else { self.1 })
    }
}

/// Terms of the Taylor polynomials: for |z| up to [`HALVED`] the next is below 1e-16.
const TERMS: usize = 12;
/// Largest |hA| without halving: a power of two.
const HALVED: f64 = 0.25;
/// Largest number of halvings; a faster motor becomes NaN.
const HALVINGS_MAX: u32 = 16;

/// 1/n! for n from 0 to [`TERMS`] + 1.
const INVERSE_FACTORIALS: [f64; TERMS + 2] = {
    let mut all = [1.0; TERMS + 2];
    let mut n = 1;
    let mut factorial = 1.0;
    while n < TERMS + 2 {
        #[expect(clippy::cast_precision_loss, reason = "a small number")]
        let number = n as f64;
        factorial *= number;
        all[n] = 1.0 / factorial;
        n += 1;
    }
    all
};

/// Functions of hA of motors side by side: φ₁, φ₂ and `e^z − 1`, each an element of the algebra.
#[derive(Debug, Clone, Copy)]
pub(super) struct PhiFunctions<const L: usize> {
    parts: [[[f64; L]; 2]; 3],
    square: [f64; L],
    halvings: [u32; L],
}

impl<const L: usize> PhiFunctions<L> {
    /// Computes φ₁, and φ₂ if it is needed, for a step of `h` seconds.
    #[inline(always)]
    pub fn new<const FMA: bool, const FOH: bool>(matrices: &Matrices<L>, h: f64) -> Self {
        let mut all = Self { parts: [[[0.0; L]; 2]; 3], square: [0.0; L], halvings: [0; L] };
        for lane in 0..L {
            let of = matrices.at(lane);
            let halvings = of.halvings(h);
            // 2⁻ⁿ by its exponent.
            let part = h * f64::from_bits(u64::from(1023 - halvings) << 52);
            let (mean, square) = (-of.decay * part, of.square * part * part);
            let first = Element::series::<FMA>(1, mean, square);
            let second = if FOH { Element::series::<FMA>(2, mean, square) } else { Element(0.0, 0.0) };
            // e^z − 1 = z φ₁.
            let less_one = Element(mean, 1.0).times::<FMA>(first, square);
            all.set(lane, [first, second, less_one]);
            all.square[lane] = square;
            all.halvings[lane] = halvings;
        }
        let mut most = 0;
        for own in all.halvings {
            most = if own > most { own } else { most };
        }
        for done in 0..most {
            all.double::<FMA, FOH>(done);
        }
        all
    }

    #[inline(always)]
    fn part(&self, part: usize, lane: usize) -> Element {
        Element(self.parts[part][0][lane], self.parts[part][1][lane])
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, values: [Element; 3]) {
        for (part, value) in self.parts.iter_mut().zip(values) {
            (part[0][lane], part[1][lane]) = (value.0, value.1);
        }
    }

    /// Doubles the steps that were halved more often.
    #[inline(always)]
    fn double<const FMA: bool, const FOH: bool>(&mut self, done: u32) {
        // The black box forces the lanes through memory; otherwise the compiler splits them into scalars.
        let old = std::hint::black_box(*self);
        for lane in 0..L {
            let is_halved = done < old.halvings[lane];
            let (first, second, less_one) = (old.part(0, lane), old.part(1, lane), old.part(2, lane));
            let square = old.square[lane];
            let half = first.times::<FMA>(less_one, square);
            let product = less_one.times::<FMA>(less_one, square);
            let longer = Element(first.0 + 0.5 * half.0, first.1 + 0.5 * half.1);
            let longer_less_one = Element(2.0 * less_one.0 + product.0, 2.0 * less_one.1 + product.1);
            let mut longer_second = second;
            if FOH {
                let product = first.times::<FMA>(first, square);
                longer_second = Element(0.5 * second.0 + 0.25 * product.0, 0.5 * second.1 + 0.25 * product.1);
            }
            let first = first.chosen(is_halved, longer);
            let second = second.chosen(is_halved, longer_second);
            self.set(lane, [first, second, less_one.chosen(is_halved, longer_less_one)]);
            self.square[lane] = if is_halved { 4.0 * square } else { square };
        }
    }

    /// Returns the step of one of the motors.
    #[inline(always)]
    pub fn transition(&self, lane: usize, of: &Matrix, h: f64) -> Transition {
        let (Element(a, b), Element(c, d)) = (self.part(0, lane), self.part(1, lane));
        let (first, second) = ([a, b], [c, d]);
        let (skew, back, torque) = (of.skew * h, of.back * h, of.torque * h);
        let phi = [first[0] + first[1] * skew, -first[1] * back, first[1] * torque, first[0] - first[1] * skew];
        let (electrical, mechanical) = (of.electrical * h, of.mechanical * h);
        let scale = h * of.per_inductance;
        Transition {
            // E = hA φ₁, without the cancellation in Φ − I.
            e: [
                -electrical * phi[0] - back * phi[2],
                -electrical * phi[1] - back * phi[3],
                torque * phi[0] - mechanical * phi[2],
                torque * phi[1] - mechanical * phi[3],
            ],
            gain: [scale * phi[0], scale * phi[2]],
            ramp: [scale * (second[0] + second[1] * skew), scale * second[1] * torque],
        }
    }
}
