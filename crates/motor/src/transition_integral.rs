//! The integrals of the transition matrix over a step, `S = ∫₀ʰ exp(Aτ) dτ` and `Z = ∫₀ʰ S(τ) dτ`, of many motors side by side.
//!
//! With them a step is `x⁺ = x + S (A x + b v + c T) + Z b v̇`, where the voltage begins at v and has the slope v̇. Functions of a 2×2
//! matrix are `r I + q B` with `B = A − t I`, trace t (Cayley–Hamilton), so that each integral takes two numbers, where a step map
//! takes four and two more for each input. As `B A = −d I`, determinant d, a step is `x⁺ = x + r (A x + g) + q (B g − d x)`,
//! with `g = b v + c T`. Steps are composed by `S = S₁ + S₂ + A S₁ S₂` and `Z = Z₁ + Z₂ + S₁ S₂`. RK4 and Euler use the first terms of
//! the series of S. Reference: N. J. Higham, Functions of Matrices (2008), ch. 1 and 10.

#![expect(clippy::needless_range_loop, reason = "a lane indexes several arrays alike; that is what vectorizes")]

use super::composed::SplitSteps;
use super::discretize::{Input, Method, StepMaps, coefficients, halvings_needed};
use super::dual::multiply_add;
use motorfit_core::numeric::count;

/// The dynamics `dx/dt = A x + b v + c T` of `N` motors side by side, x = `[i, ω]`.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub struct Dynamics<const N: usize> {
    /// Matrix A, row-major \[1/s\].
    pub a: [[f64; N]; 4],
    /// Vector b, and the product B b.
    pub voltage: [[[f64; N]; 2]; 2],
    /// Vector c, and the product B c.
    pub torque: [[[f64; N]; 2]; 2],
    /// Trace of A \[1/s\].
    pub trace: [f64; N],
    /// Determinant of A \[1/s²\].
    pub determinant: [f64; N],
}

impl<const N: usize> Dynamics<N> {
    /// Returns the dynamics of motors, `parameters[p][lane]` in the order R, L, K, B, J. With the current as input, b is
    /// `(0, K/J)` and only the last entry of A is not zero.
    #[inline(always)]
    pub fn new([r, l, k, b, j]: &[[f64; N]; 5], input: Input) -> Self {
        let zero = [0.0; N];
        let mut new =
            Self { a: [zero; 4], voltage: [[zero; 2]; 2], torque: [[zero; 2]; 2], trace: zero, determinant: zero };
        for n in 0..N {
            if input == Input::Voltage {
                new.a[0][n] = -r[n] / l[n];
                new.a[1][n] = -k[n] / l[n];
                new.a[2][n] = k[n] / j[n];
                new.voltage[0][0][n] = 1.0 / l[n];
            } else {
                new.voltage[0][1][n] = k[n] / j[n];
            }
            new.a[3][n] = -b[n] / j[n];
            new.torque[0][1][n] = -1.0 / j[n];
            new.trace[n] = new.a[0][n] + new.a[3][n];
            new.determinant[n] = new.a[0][n] * new.a[3][n] - new.a[1][n] * new.a[2][n];
        }
        for [input, product] in [&mut new.voltage, &mut new.torque] {
            for n in 0..N {
                product[0][n] = new.a[1][n] * input[1][n] - new.a[3][n] * input[0][n];
                product[1][n] = new.a[2][n] * input[0][n] - new.a[0][n] * input[1][n];
            }
        }
        new
    }
}

/// The integral S of `N` motors side by side as the coefficients r \[s\] and q \[s²\] of I and B, and with `K` = 2 those of Z \[s²\]
/// and \[s³\].
#[derive(Clone, Copy)]
#[repr(align(64))]
pub struct TransitionIntegrals<const N: usize, const K: usize>(pub [[[f64; N]; 2]; K]);

impl<const N: usize, const K: usize> TransitionIntegrals<N, K> {
    /// Returns the integrals over a step of no length.
    #[inline(always)]
    pub fn zero() -> Self {
        Self([[[0.0; N]; 2]; K])
    }

    /// Returns the integrals over a step of `h` seconds, one value for each motor.
    #[inline(always)]
    pub fn new(dynamics: &Dynamics<N>, h: [f64; N], Method { discretization, .. }: Method) -> Self {
        let Dynamics { a, trace, determinant, .. } = dynamics;
        let mut halvings = [0; N];
        if discretization.is_exact() {
            for n in 0..N {
                halvings[n] = halvings_needed([a[0][n] * h[n], a[1][n] * h[n], a[2][n] * h[n], a[3][n] * h[n]]);
            }
        }
        let (mut part, mut scaled) = (h, [[0.0; N]; 2]);
        for n in 0..N {
            part[n] *= 0.5_f64.powi(halvings[n].cast_signed());
            scaled[0][n] = trace[n] * part[n];
            scaled[1][n] = determinant[n] * part[n] * part[n];
        }
        // The coefficients of φ₁ and φ₂, with S = h φ₁(hA), Z = h² φ₂(hA) and A = B + t I.
        let phi = coefficients(&scaled[0], &scaled[1], discretization);
        let mut integrals = Self::zero();
        let mut power = [1.0; N];
        for k in 0..K {
            for n in 0..N {
                power[n] *= part[n];
                let q = phi[k][1][n] * part[n];
                integrals.0[k][0][n] = (phi[k][0][n] + trace[n] * q) * power[n];
                integrals.0[k][1][n] = q * power[n];
            }
        }
        for done in 0..halvings.iter().copied().max().unwrap_or(0) {
            let doubled = integrals.then::<false>(&integrals, dynamics);
            for k in 0..K {
                for of in 0..2 {
                    for n in 0..N {
                        let before = integrals.0[k][of][n];
                        integrals.0[k][of][n] = if done < halvings[n] { doubled.0[k][of][n] } else { before };
                    }
                }
            }
        }
        integrals
    }

    /// Returns the integrals over the distinct coarse parts of steps and over the distinct fine parts.
    #[inline(always)]
    pub fn of_parts<const FMA: bool>(split: &SplitSteps, dynamics: &Dynamics<N>, method: Method) -> [Vec<Self>; 2] {
        let mut parts = [Vec::new(), Vec::new()];
        for (of, table) in parts.iter_mut().enumerate() {
            let (multiples, base_s) = (&split.multiples[of], split.base_s(of));
            let base = Self::new(dynamics, [base_s; N], method);
            *table = vec![base; multiples.len()];
            for at in 0..multiples.len() {
                // Multiples increase, and most follow their predecessor.
                let n = multiples[at];
                table[at] = if at > 0 && n == multiples[at - 1] + 1 {
                    table[at - 1].then::<FMA>(&base, dynamics)
                } else {
                    Self::new(dynamics, [count(n) * base_s; N], method)
                };
            }
        }
        parts
    }

    /// Returns the step maps for a step of `h` seconds, over which these are the integrals: `D = A S = r A − d q I`. A first-order
    /// hold needs `K` = 2.
    #[inline(always)]
    pub fn maps(&self, dynamics: &Dynamics<N>, h: f64, method: Method) -> StepMaps<N> {
        let (Dynamics { a, torque, determinant, .. }, [r, q]) = (dynamics, &self.0[0]);
        let zero = [[0.0; N]; 2];
        let mut maps = StepMaps { d: [[0.0; N]; 4], taps: [zero; 2], torque: zero };
        let responses = self.responses(dynamics);
        for n in 0..N {
            let rest = determinant[n] * q[n];
            maps.d[0][n] = r[n] * a[0][n] - rest;
            maps.d[1][n] = r[n] * a[1][n];
            maps.d[2][n] = r[n] * a[2][n];
            maps.d[3][n] = r[n] * a[3][n] - rest;
            for axis in 0..2 {
                let end = if K > 1 && method.uses_next_input() { responses[K - 1][axis][n] / h } else { 0.0 };
                maps.taps[1][axis][n] = end;
                maps.taps[0][axis][n] = responses[0][axis][n] - end;
                maps.torque[axis][n] = r[n] * torque[0][axis][n] + q[n] * torque[1][axis][n];
            }
        }
        if method.input == Input::Current {
            maps.d[0] = [-1.0; N];
        }
        maps
    }

    /// Returns the integrals, applied to the vector b: the responses of both states to a unit step of the voltage, and to a unit
    /// ramp.
    #[inline(always)]
    pub fn responses(&self, dynamics: &Dynamics<N>) -> [[[f64; N]; 2]; K] {
        let mut responses = [[[0.0; N]; 2]; K];
        for k in 0..K {
            for axis in 0..2 {
                for n in 0..N {
                    let [b, bb] = [dynamics.voltage[0][axis][n], dynamics.voltage[1][axis][n]];
                    responses[k][axis][n] = self.0[k][0][n] * b + self.0[k][1][n] * bb;
                }
            }
        }
        responses
    }

    /// Returns the integrals over this step followed by another.
    #[inline(always)]
    pub fn then<const FMA: bool>(&self, second: &Self, dynamics: &Dynamics<N>) -> Self {
        let Dynamics { trace, determinant, .. } = dynamics;
        let (one, two) = (&self.0, &second.0);
        let mut sum = Self::zero();
        for n in 0..N {
            // S₁ S₂ = u I + v B with B² = −t B − d I, and A S₁ S₂ = (t u − d v) I + u B
            let qq = one[0][1][n] * two[0][1][n];
            let u = multiply_add::<FMA>(-determinant[n], qq, one[0][0][n] * two[0][0][n]);
            let crossed = multiply_add::<FMA>(one[0][0][n], two[0][1][n], one[0][1][n] * two[0][0][n]);
            let v = multiply_add::<FMA>(-trace[n], qq, crossed);
            let r = multiply_add::<FMA>(trace[n], u, one[0][0][n] + two[0][0][n]);
            sum.0[0][0][n] = multiply_add::<FMA>(-determinant[n], v, r);
            sum.0[0][1][n] = u + (one[0][1][n] + two[0][1][n]);
            if K > 1 {
                sum.0[1][0][n] = u + (one[1][0][n] + two[1][0][n]);
                sum.0[1][1][n] = v + (one[1][1][n] + two[1][1][n]);
            }
        }
        sum
    }
}
