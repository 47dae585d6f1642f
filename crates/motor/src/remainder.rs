//! Response to changes of the input within a step.
//!
//! An input whose value jumps by Δv and whose slope changes by Δr at a duration s before the end of a step adds
//! `Δv Γ(s) + Δr Γ₂(s)` to both states at the end. `Γ(s) = ∫₀ˢ e^{Aτ} b dτ` is the step response, `Γ₂(s) = ∫₀ˢ Γ(τ) dτ` the
//! ramp response. Their derivatives with respect to s are `e^{As} b` and Γ(s).

use super::discretize::{Discretization, Input, Method, step_maps};
use super::dual::Number;
use super::extended::Extended;

/// The responses of a motor over parts of steps. The last one is cached, because on an even clock all parts have the same
/// duration.
pub(super) struct Remainder<T> {
    motor: [[T; 1]; 5],
    method: Method,
    cached: Option<Responses<T>>,
}

/// Responses of both states over one duration.
struct Responses<T> {
    duration_s: f64,
    /// Response to a unit step.
    step_response: [T; 2],
    /// Response to a unit ramp.
    ramp: [T; 2],
    /// Derivative of the step response with respect to the duration.
    slope: [T; 2],
}

/// Relative difference up to which durations count as equal.
const ROUNDING: f64 = 1e-9;

impl<T: Number> Remainder<T> {
    #[inline(always)]
    pub(super) fn new(motor: &Extended<T>, method: Method) -> Self {
        Self { motor: motor.motor.map(|value| [value]), method, cached: None }
    }

    /// Returns the change of both states due to an input whose value and slope change a duration \[s\] before the end of a
    /// step.
    pub(super) fn change(&mut self, [jump, bend]: [T; 2], duration: T) -> [T; 2] {
        let duration_s = duration.value();
        let is_known = |cached: &Responses<T>| (cached.duration_s - duration_s).abs() <= ROUNDING * duration_s;
        let cached = match self.cached.take().filter(is_known) {
            Some(cached) => cached,
            None => Responses::new(&self.motor, self.method, duration_s),
        };
        let later = duration - T::constant(duration_s);
        let change = [0, 1].map(|axis| {
            let [step_response, ramp] = [cached.step_response[axis], cached.ramp[axis]];
            jump * (step_response + cached.slope[axis] * later) + bend * (ramp + step_response * later)
        });
        self.cached = Some(cached);
        change
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
            step_response: [0, 1].map(|axis| taps[0][axis] + taps[1][axis]),
            ramp: taps[1].map(|gain| gain * duration_s),
            slope: [b[0] + moved[0], b[1] + moved[1]],
        }
    }
}
