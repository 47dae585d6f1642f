//! The step of a motor from functions of its matrix.
//!
//! With `A = −m I + X`, `m = (R/L + B/J)/2` and `X² = d I`, `d = (R/L − B/J)²/4 − K²/(LJ)`, each analytic function of A is `α I + β X`:
//! there is no branch between real and complex poles. `φ₁` and `φ₂` of hA are Taylor polynomials of a halved step. Steps are doubled by
//! their elements, as those of the kernel: with poles far apart α and βX would cancel (N. J. Higham, Functions of Matrices, 2008,
//! ch. 10).

use motorfit_motor::multiply_add;

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
        let size = (self.decay.abs() + self.square.abs().sqrt()) * (h / HALVED);
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

/// A step: `E = Φ − I`, row-major, and the gains of a constant voltage and of its rise over the step.
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
}

/// Terms of the Taylor polynomials: for |z| up to [`HALVED`] the next is below 1e-16.
const TERMS: usize = 12;
/// Largest |hA| without halving: a power of two.
const HALVED: f64 = 0.25;
/// Number of halvings at which a step becomes NaN: |hA| is above 10⁸.
const HALVINGS_MAX: u32 = 30;

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

impl Transition {
    /// Returns the step of `h` seconds from `φ₁` and `φ₂` of hA. `E = hA φ₁` has not the cancellation of `Φ − I`.
    #[inline(always)]
    fn new(of: &Matrix, h: f64, [first, second]: [Element; 2]) -> Self {
        let (skew, back, torque) = (of.skew * h, of.back * h, of.torque * h);
        let phi = [first.0 + first.1 * skew, -first.1 * back, first.1 * torque, first.0 - first.1 * skew];
        let (electrical, mechanical) = (of.electrical * h, of.mechanical * h);
        let scale = h * of.per_inductance;
        Self {
            e: [
                -electrical * phi[0] - back * phi[2],
                -electrical * phi[1] - back * phi[3],
                torque * phi[0] - mechanical * phi[2],
                torque * phi[1] - mechanical * phi[3],
            ],
            gain: [scale * phi[0], scale * phi[2]],
            ramp: [scale * (second.0 + second.1 * skew), scale * second.1 * torque],
        }
    }

    /// Returns two such steps as one.
    #[inline(always)]
    fn twice<const FOH: bool>(&self) -> Self {
        let [a, b, c, d] = self.e;
        let advanced = |v: [f64; 2]| [v[0] + (a * v[0] + b * v[1]), v[1] + (c * v[0] + d * v[1])];
        let gain = advanced(self.gain);
        let mut twice = Self {
            e: [
                2.0 * a + (a * a + b * c),
                2.0 * b + (a * b + b * d),
                2.0 * c + (c * a + d * c),
                2.0 * d + (c * b + d * d),
            ],
            gain: [self.gain[0] + gain[0], self.gain[1] + gain[1]],
            ramp: [0.0; 2],
        };
        if FOH {
            // The voltage in the middle is the mean of those at the ends.
            let ramp = advanced(self.ramp);
            twice.ramp = [0.5 * (self.gain[0] + ramp[0] + self.ramp[0]), 0.5 * (self.gain[1] + ramp[1] + self.ramp[1])];
        }
        twice
    }
}

/// Steps of motors side by side, a field after the other.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Transitions<const L: usize> {
    fields: [[f64; L]; 8],
    halvings: [u32; L],
}

impl<const L: usize> Transitions<L> {
    /// Computes the steps of `h` seconds.
    #[inline(always)]
    pub fn new<const FMA: bool, const FOH: bool>(matrices: &Matrices<L>, h: f64) -> Self {
        let mut all = Self { fields: [[0.0; L]; 8], halvings: [0; L] };
        for lane in 0..L {
            let of = matrices.at(lane);
            let halvings = of.halvings(h);
            // 2⁻ⁿ by its exponent.
            let part = h * f64::from_bits(u64::from(1023 - halvings) << 52);
            let part = if halvings < HALVINGS_MAX { part } else { f64::NAN };
            let (mean, square) = (-of.decay * part, of.square * part * part);
            let first = Element::series::<FMA>(1, mean, square);
            let second = if FOH { Element::series::<FMA>(2, mean, square) } else { Element(0.0, 0.0) };
            all.set(lane, &Transition::new(&of, part, [first, second]));
            all.halvings[lane] = halvings;
        }
        let mut most = 0;
        for own in all.halvings {
            most = if own > most { own } else { most };
        }
        for done in 0..most {
            all.double::<FOH>(done);
        }
        all
    }

    /// Returns one of the steps.
    #[inline(always)]
    pub fn at(&self, lane: usize) -> Transition {
        let [a, b, c, d, e, f, g, h] = &self.fields;
        Transition { e: [a[lane], b[lane], c[lane], d[lane]], gain: [e[lane], f[lane]], ramp: [g[lane], h[lane]] }
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, of: &Transition) {
        let Transition { e: [a, b, c, d], gain: [e, f], ramp: [g, h] } = *of;
        for (field, value) in self.fields.iter_mut().zip([a, b, c, d, e, f, g, h]) {
            field[lane] = value;
        }
    }

    /// Doubles the steps that were halved more often.
    #[inline(always)]
    fn double<const FOH: bool>(&mut self, done: u32) {
        // The black box forces the lanes through memory; otherwise the compiler splits them into scalars.
        let old = std::hint::black_box(*self);
        for lane in 0..L {
            let is_halved = done < old.halvings[lane];
            let (one, two) = (old.at(lane), old.at(lane).twice::<FOH>());
            let chosen = |one: f64, two: f64| if is_halved { two } else { one };
            self.set(
                lane,
                &Transition {
                    e: [
                        chosen(one.e[0], two.e[0]),
                        chosen(one.e[1], two.e[1]),
                        chosen(one.e[2], two.e[2]),
                        chosen(one.e[3], two.e[3]),
                    ],
                    gain: [chosen(one.gain[0], two.gain[0]), chosen(one.gain[1], two.gain[1])],
                    ramp: [chosen(one.ramp[0], two.ramp[0]), chosen(one.ramp[1], two.ramp[1])],
                },
            );
        }
    }
}
