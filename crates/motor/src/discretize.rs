//! One-step maps: from continuous-time parameters to `x⁺ = x + D x + taps·v + torque·T`.
//!
//! With `A = [[−R/L, −K/L], [K/J, −B/J]]`, `M = hA`, `b = (1/L, 0)` and `φ₁(M) = Σ Mⁿ/(n+1)!`, every method has `D = M φ₁` and
//! the gain `h φ₁ b` of a constant input. The full series is the exact zero-order hold, four terms are RK4 with a zero-order
//! hold, one term is Euler. The first-order hold splits `h φ₁ b` by `φ₂(M) = Σ Mⁿ/(n+2)!`. Powers of a 2×2 matrix are
//! `Mⁿ = αₙ I + βₙ M` with `αₙ₊₁ = −d βₙ`, `βₙ₊₁ = αₙ + t βₙ` (trace t, determinant d), so there is no branch on the
//! eigenvalues. For the exact holds, if the spectral radius of M exceeds 1, the step is halved until it does not, and the maps
//! of the halves are composed (scaling and squaring).
//!
//! With the current as input the model reduces to `dω/dt = (K i − B ω − T)/J`: `A = [[0, 0], [0, −B/J]]`, `b = (0, K/J)`,
//! for which the same series is exact. The state of the current is set to zero in one step and has no effect.
//!
//! Inputs: R \[ohm\], L \[H\], K \[V·s/rad\], B \[N·m·s/rad\], J \[kg·m²\], h \[s\]. Reference: N. J. Higham, Functions of
//! Matrices (2008), ch. 10.

use super::dual::{Dual, Number};
use super::linear::Parameters;
use motorfit_core::named::named;

named! {
    /// Discretization of the continuous-time motor.
    #[non_exhaustive]
    pub enum Discretization (default Zoh) {
        /// Exact for a voltage that is constant between samples (zero-order hold).
        Zoh = "zoh",
        /// Exact for a voltage that is linear between samples (first-order hold).
        Foh = "foh",
        /// Classical Runge–Kutta method of order 4 with a zero-order hold.
        Rk4 = "rk4",
        /// Forward Euler method with a zero-order hold.
        Euler = "euler",
    }
}

impl Discretization {
    /// Returns the number of terms of φ₁; 18 reach rounding error for a spectral radius up to 1.1.
    fn terms(self) -> u32 {
        match self {
            Self::Zoh | Self::Foh => 18,
            Self::Rk4 => 4,
            Self::Euler => 1,
        }
    }

    /// Returns true if the method is exact for its hold.
    #[doc(hidden)]
    pub fn is_exact(self) -> bool {
        matches!(self, Self::Zoh | Self::Foh)
    }

    /// Returns true if a step also uses the voltage at its end (first-order hold).
    #[must_use]
    pub fn uses_next_input(self) -> bool {
        self == Self::Foh
    }
}

named! {
    /// Input of a motor.
    #[derive(Hash)]
    pub enum Input (default Voltage) {
        /// The voltage \[V\].
        Voltage = "voltage",
        /// The current \[A\]: only the mechanical equation is left, in which R and L have no effect.
        Current = "current",
    }
}

/// A one-step method: the discretization and the input of the continuous-time motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Method {
    /// The discretization.
    pub discretization: Discretization,
    /// The input of the motor: voltage or current.
    pub input: Input,
}

impl Method {
    /// Returns true if a step also uses the input at its end (first-order hold).
    #[must_use]
    pub fn uses_next_input(self) -> bool {
        self.discretization.uses_next_input()
    }
}

/// Makes the method of a motor with the voltage as input.
impl From<Discretization> for Method {
    fn from(discretization: Discretization) -> Self {
        Self { discretization, input: Input::Voltage }
    }
}

/// One-step map `x⁺ = x + D x + taps[0] v[n] + taps[1] v[n+1] + torque T[n]` of one candidate, x = `[i, ω]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepMap {
    /// Matrix `D = Φ − I`, row-major.
    pub d: [f64; 4],
    /// Gains of the voltage at the start and at the end of the step, a value for each state.
    pub taps: [[f64; 2]; 2],
    /// Gain of the load torque, which is constant over the step, a value for each state.
    pub torque: [f64; 2],
}

impl StepMap {
    /// Returns the map of a motor for a step of `h` seconds.
    #[must_use]
    pub fn new(parameters: &Parameters, h: f64, method: impl Into<Method>) -> Self {
        Self::part(&step_maps(&parameters.to_array().map(|p| [p]), h, method), |v| v)
    }

    /// Returns the map and its derivatives with respect to the logarithms of R, L, K, B and J.
    #[must_use]
    pub fn with_sensitivities(parameters: &Parameters, h: f64, method: impl Into<Method>) -> (Self, [Self; 5]) {
        split(&step_maps(&seeded(parameters), h, method))
    }

    fn part<T: Number>(maps: &StepMaps<1, T>, of: impl Fn(T) -> f64) -> Self {
        let axes = |of_axes: [[T; 1]; 2]| of_axes.map(|[v]| of(v));
        Self { d: maps.d.map(|[v]| of(v)), taps: maps.taps.map(axes), torque: axes(maps.torque) }
    }
}

/// Returns R, L, K, B and J with their derivatives with respect to their logarithms.
pub fn seeded(parameters: &Parameters) -> [[Dual<5>; 1]; 5] {
    let values = parameters.to_array();
    std::array::from_fn(|p| {
        let mut derivatives = [0.0; 5];
        derivatives[p] = values[p];
        [Dual { value: values[p], derivatives }]
    })
}

/// Separates a map of dual numbers into values and derivatives.
pub(super) fn split(maps: &StepMaps<1, Dual<5>>) -> (StepMap, [StepMap; 5]) {
    let slope = |p: usize| StepMap::part(maps, |v| v.derivatives[p]);
    (StepMap::part(maps, |v| v.value), std::array::from_fn(slope))
}

/// One-step maps of `N` candidates side by side, see [`StepMap`].
#[derive(Debug, Clone, Copy)]
pub struct StepMaps<const N: usize, T = f64> {
    /// Matrix `D = Φ − I`, row-major.
    pub d: [[T; N]; 4],
    /// Gains of the voltage at the start and at the end of the step.
    pub taps: [[[T; N]; 2]; 2],
    /// Gain of the load torque.
    pub torque: [[T; N]; 2],
}

/// Returns the one-step maps of `N` motors for a step of `h` seconds, `parameters[p][lane]` in the order R, L, K, B, J.
#[inline(always)]
#[must_use]
pub fn step_maps<T: Number, const N: usize>(
    parameters: &[[T; N]; 5],
    h: f64,
    method: impl Into<Method>,
) -> StepMaps<N, T> {
    let Method { discretization, input } = method.into();
    let [r, l, k, b, j] = parameters;
    let mut m = [[T::constant(0.0); N]; 4];
    let mut halvings = [0_u32; N];
    for n in 0..N {
        if input == Input::Voltage {
            m[0][n] = -r[n] / l[n] * h;
            m[1][n] = -k[n] / l[n] * h;
            m[2][n] = k[n] / j[n] * h;
        }
        m[3][n] = -b[n] / j[n] * h;
    }
    if discretization.is_exact() {
        for n in 0..N {
            halvings[n] = halvings_needed([m[0][n], m[1][n], m[2][n], m[3][n]].map(T::value));
        }
    }
    let deepest = halvings.iter().copied().max().unwrap_or(0);
    let mut part = [h; N];
    if deepest > 0 {
        for n in 0..N {
            let scale = power_of_half(halvings[n]);
            part[n] *= scale;
            for row in &mut m {
                row[n] = row[n] * scale;
            }
        }
    }
    let mut maps = series(&m, discretization, input);
    for n in 0..N {
        let step = T::constant(part[n]);
        let scale = if input == Input::Voltage { step / l[n] } else { step * k[n] / j[n] };
        for axis in 0..2 {
            maps.taps[0][axis][n] = maps.taps[0][axis][n] * scale;
            maps.taps[1][axis][n] = maps.taps[1][axis][n] * scale;
            maps.torque[axis][n] = maps.torque[axis][n] * (-step / j[n]);
        }
    }
    let foh = discretization.uses_next_input();
    if deepest > 0 && N.is_multiple_of(TOGETHER) {
        compose(&mut maps, &halvings, foh);
    } else {
        (0..deepest).for_each(|done| double(&mut maps, &halvings, done, foh));
    }
    if input == Input::Current {
        maps.d[0] = [T::constant(-1.0); N];
    }
    maps
}

/// Returns 2⁻ⁿ, for n up to 1022.
#[inline(always)]
fn power_of_half(n: u32) -> f64 {
    f64::from_bits(u64::from(1023 - n.min(1022)) << 52)
}

/// Returns the number of halvings of a step after which the spectral radius of `M` is at most 1; zero if the radius is not
/// finite, and the map then becomes NaN.
#[inline(always)]
pub(super) fn halvings_needed(m: [f64; 4]) -> u32 {
    let half_trace = 0.5 * (m[0] + m[3]);
    let determinant = m[0] * m[3] - m[1] * m[2];
    let discriminant = half_trace * half_trace - determinant;
    let radius = if discriminant < 0.0 { determinant.sqrt() } else { half_trace.abs() + discriminant.sqrt() };
    // The exponent of a float above 1 is the number of halvings that bring it into 1 to 2; one more brings it to 1 at most.
    let needed = ((radius.to_bits() >> 52) & 0x7ff) as u32;
    if radius > 1.0 && radius < f64::INFINITY { needed - 1022 } else { 0 }
}

/// Returns the coefficients of I and M in `φ₁(M)` and `φ₂(M)`, from the trace and the determinant of M. Those of `φ₂` are zero if
/// the method does not use them.
#[inline(always)]
pub(super) fn coefficients<T: Number, const N: usize>(
    trace: &[T; N],
    determinant: &[T; N],
    method: Discretization,
) -> [[[T; N]; 2]; 2] {
    let zero = T::constant(0.0);
    let (mut alpha, mut beta) = ([T::constant(1.0); N], [zero; N]);
    let (mut p, mut q) = ([[zero; N]; 2], [[zero; N]; 2]);
    let mut inverse_factorial = 1.0;
    for term in 0..method.terms() {
        inverse_factorial /= f64::from(term + 1); // 1/(n+1)!
        let next = inverse_factorial / f64::from(term + 2); // 1/(n+2)!
        if method.uses_next_input() {
            for n in 0..N {
                q[0][n] = q[0][n] + alpha[n] * next;
                q[1][n] = q[1][n] + beta[n] * next;
            }
        }
        for n in 0..N {
            p[0][n] = p[0][n] + alpha[n] * inverse_factorial;
            p[1][n] = p[1][n] + beta[n] * inverse_factorial;
            let raised = alpha[n] + trace[n] * beta[n];
            alpha[n] = -determinant[n] * beta[n];
            beta[n] = raised;
        }
    }
    [p, q]
}

/// Returns `D` and the unscaled gains: `taps[0] = φ₁ e₁` (zero-order hold), or `(φ₁ − φ₂) e₁` with `taps[1] = φ₂ e₁`
/// (first-order hold), and `torque = φ₁ e₂`. With the current as input the taps are those of `e₂`.
#[inline(always)]
fn series<T: Number, const N: usize>(m: &[[T; N]; 4], method: Discretization, input: Input) -> StepMaps<N, T> {
    let zero = T::constant(0.0);
    let mut maps = StepMaps { d: [[zero; N]; 4], taps: [[[zero; N]; 2]; 2], torque: [[zero; N]; 2] };
    let foh = method.uses_next_input();
    let (mut trace, mut determinant) = ([zero; N], [zero; N]);
    for n in 0..N {
        trace[n] = m[0][n] + m[3][n];
        determinant[n] = m[0][n] * m[3][n] - m[1][n] * m[2][n];
    }
    let [p, q] = coefficients(&trace, &determinant, method);
    for n in 0..N {
        let phi1 = [p[0][n] + p[1][n] * m[0][n], p[1][n] * m[1][n], p[1][n] * m[2][n], p[0][n] + p[1][n] * m[3][n]];
        // D = M φ₁
        maps.d[0][n] = m[0][n] * phi1[0] + m[1][n] * phi1[2];
        maps.d[1][n] = m[0][n] * phi1[1] + m[1][n] * phi1[3];
        maps.d[2][n] = m[2][n] * phi1[0] + m[3][n] * phi1[2];
        maps.d[3][n] = m[2][n] * phi1[1] + m[3][n] * phi1[3];
        let end = match (foh, input) {
            (true, Input::Voltage) => [q[0][n] + q[1][n] * m[0][n], q[1][n] * m[2][n]],
            (true, Input::Current) => [q[1][n] * m[1][n], q[0][n] + q[1][n] * m[3][n]],
            (false, _) => [zero; 2],
        };
        for axis in 0..2 {
            maps.taps[1][axis][n] = end[axis];
            maps.taps[0][axis][n] = phi1[2 * axis + usize::from(input == Input::Current)] - end[axis];
            maps.torque[axis][n] = phi1[2 * axis + 1];
        }
    }
    maps
}

/// Number of motors whose halves are composed together: their maps stay in registers.
const TOGETHER: usize = 8;

/// Composes the halves of the steps of [`TOGETHER`] motors after those of others.
#[inline(always)]
fn compose<T: Number, const N: usize>(maps: &mut StepMaps<N, T>, halvings: &[u32; N], foh: bool) {
    for first in (0..N).step_by(TOGETHER) {
        let own: [u32; TOGETHER] = std::array::from_fn(|n| halvings[first + n]);
        let part = |of: [T; N]| -> [T; TOGETHER] { std::array::from_fn(|n| of[first + n]) };
        let taps = maps.taps.map(|tap| tap.map(part));
        let mut some = StepMaps { d: maps.d.map(part), taps, torque: maps.torque.map(part) };
        for done in 0..own.into_iter().max().unwrap_or(0) {
            double_together(&mut some, &own, done, foh);
        }
        let put = |to: &mut [T; N], from: &[T; TOGETHER]| to[first..first + TOGETHER].copy_from_slice(from);
        maps.d.iter_mut().zip(&some.d).for_each(|(to, from)| put(to, from));
        maps.taps.iter_mut().flatten().zip(some.taps.iter().flatten()).for_each(|(to, from)| put(to, from));
        maps.torque.iter_mut().zip(&some.torque).for_each(|(to, from)| put(to, from));
    }
}

/// Composes two equal steps as [`double`] does, one array after the other and without branches, so that they become vectors.
#[inline(always)]
fn double_together<T: Number, const N: usize>(maps: &mut StepMaps<N, T>, halvings: &[u32; N], done: u32, foh: bool) {
    let old = *maps;
    let is_composed: [bool; N] = std::array::from_fn(|n| done < halvings[n]);
    // The new values of the motors that still need it, the old ones of the others.
    macro_rules! chosen {
        ($n:ident, $old:expr, $new:expr) => {{
            let old = $old;
            std::array::from_fn(|$n| {
                let new = $new;
                if is_composed[$n] { new } else { old[$n] }
            })
        }};
    }
    let [a, b, c, d] = old.d;
    maps.d[0] = chosen!(n, a, a[n] * 2.0 + (a[n] * a[n] + b[n] * c[n]));
    maps.d[1] = chosen!(n, b, b[n] * 2.0 + (a[n] * b[n] + b[n] * d[n]));
    maps.d[2] = chosen!(n, c, c[n] * 2.0 + (c[n] * a[n] + d[n] * c[n]));
    maps.d[3] = chosen!(n, d, d[n] * 2.0 + (c[n] * b[n] + d[n] * d[n]));
    let [s, e] = old.taps;
    let t = old.torque;
    for axis in 0..2 {
        let (p, q) = if axis == 0 { (a, b) } else { (c, d) };
        maps.torque[axis] = chosen!(n, t[axis], t[axis][n] * 2.0 + (p[n] * t[0][n] + q[n] * t[1][n]));
        if foh {
            let middle: [T; N] =
                std::array::from_fn(|n| (s[axis][n] + e[axis][n] + (p[n] * e[0][n] + q[n] * e[1][n])) * 0.5);
            maps.taps[0][axis] = chosen!(n, s[axis], s[axis][n] + (p[n] * s[0][n] + q[n] * s[1][n]) + middle[n]);
            maps.taps[1][axis] = chosen!(n, e[axis], e[axis][n] + middle[n]);
        } else {
            maps.taps[0][axis] = chosen!(n, s[axis], s[axis][n] + (p[n] * s[0][n] + q[n] * s[1][n]) + s[axis][n]);
        }
    }
}

/// Composes two equal steps into one of twice the length in the lanes that still need it: `D ← 2D + D²`, and gains of
/// constant inputs `g ← 2g + D g`. For a first-order hold, whose middle is the mean of its ends, `w = g₀ + Φ g₁`,
/// `g₀ ← Φ g₀ + w/2`, `g₁ ← g₁ + w/2`.
#[inline(always)]
fn double<T: Number, const N: usize>(maps: &mut StepMaps<N, T>, halvings: &[u32; N], done: u32, foh: bool) {
    for n in 0..N {
        if done >= halvings[n] {
            continue;
        }
        let d = maps.d.map(|entry| entry[n]);
        let times_d = |v: [T; 2]| [d[0] * v[0] + d[1] * v[1], d[2] * v[0] + d[3] * v[1]];
        let (start, end) = (maps.taps[0].map(|t| t[n]), maps.taps[1].map(|t| t[n]));
        let torque = maps.torque.map(|t| t[n]);
        let (d_start, d_end, d_torque) = (times_d(start), times_d(end), times_d(torque));
        for axis in 0..2 {
            let middle = (start[axis] + end[axis] + d_end[axis]) * 0.5;
            let second = if foh { middle } else { start[axis] };
            maps.taps[0][axis][n] = start[axis] + d_start[axis] + second;
            maps.taps[1][axis][n] = if foh { end[axis] + middle } else { T::constant(0.0) };
            maps.torque[axis][n] = torque[axis] * 2.0 + d_torque[axis];
        }
        maps.d[0][n] = d[0] * 2.0 + (d[0] * d[0] + d[1] * d[2]);
        maps.d[1][n] = d[1] * 2.0 + (d[0] * d[1] + d[1] * d[3]);
        maps.d[2][n] = d[2] * 2.0 + (d[2] * d[0] + d[3] * d[2]);
        maps.d[3][n] = d[3] * 2.0 + (d[2] * d[1] + d[3] * d[3]);
    }
}
