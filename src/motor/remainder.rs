//! Changes of the input within a step.
//!
//! An input that jumps by Δv and bends by Δr per second, s before the end of a step, adds `Δv Γ(s) + Δr Γ₂(s)` to both states
//! at its end, with the response to a unit that is held, `Γ(s) = ∫₀ˢ e^{Aτ} b dτ`, and that to a unit a second,
//! `Γ₂(s) = ∫₀ˢ Γ(τ) dτ`. Their derivatives with respect to s are `e^{As} b` and Γ(s).

use super::discretize::{Discretization, Input, Method, step_maps};
use super::dual::Number;
use super::extended::Extended;

/// The responses of a motor over parts of steps; the last is kept, because on an even clock all parts are the same.
pub(super) struct Remainder<T> {
    motor: [[T; 1]; 5],
    method: Method,
    known: Option<Responses<T>>,
}

struct Responses<T> {
    duration_s: f64,
    held: [T; 2],
    ramp: [T; 2],
    /// The derivative of `held` with respect to the duration.
    slope: [T; 2],
}

/// Durations that differ by less than this part are the same.
const ROUNDING: f64 = 1e-9;

impl<T: Number> Remainder<T> {
    #[inline(always)]
    pub(super) fn new(motor: &Extended<T>, method: Method) -> Self {
        Self { motor: motor.motor.map(|value| [value]), method, known: None }
    }

    /// Returns the change of both states by an input that jumps and bends a duration \[s\] before the end of a step.
    pub(super) fn change(&mut self, [jump, bend]: [T; 2], duration: T) -> [T; 2] {
        let duration_s = duration.value();
        let is_known = |known: &Responses<T>| (known.duration_s - duration_s).abs() <= ROUNDING * duration_s;
        let known = match self.known.take().filter(is_known) {
            Some(known) => known,
            None => Responses::new(&self.motor, self.method, duration_s),
        };
        let later = duration - T::constant(duration_s);
        let change = [0, 1].map(|axis| {
            let [held, ramp] = [known.held[axis], known.ramp[axis]];
            jump * (held + known.slope[axis] * later) + bend * (ramp + held * later)
        });
        self.known = Some(known);
        change
    }

    /// Returns the responses of both states to a unit that is held and to a unit a second, over a duration \[s\].
    pub(super) fn over(&self, duration_s: f64) -> [[T; 2]; 2] {
        let Responses { held, ramp, .. } = Responses::new(&self.motor, self.method, duration_s);
        [held, ramp]
    }
}

impl<T: Number> Responses<T> {
    #[inline(never)]
    fn new(motor: &[[T; 1]; 5], method: Method, duration_s: f64) -> Self {
        let maps = step_maps(motor, duration_s, method);
        let [_, l, k, _, j] = motor.map(|[value]| value);
        let (zero, one) = (T::constant(0.0), T::constant(1.0));
        let b = if method.input == Input::Voltage { [one / l, zero] } else { [zero, k / j] };
        let d = maps.d.map(|[entry]| entry);
        let moved = if method.discretization == Discretization::Euler {
            [zero; 2]
        } else {
            [d[0] * b[0] + d[1] * b[1], d[2] * b[0] + d[3] * b[1]]
        };
        let taps = maps.taps.map(|tap| tap.map(|[gain]| gain));
        Self {
            duration_s,
            held: [0, 1].map(|axis| taps[0][axis] + taps[1][axis]),
            ramp: taps[1].map(|gain| gain * duration_s),
            slope: [b[0] + moved[0], b[1] + moved[1]],
        }
    }
}
