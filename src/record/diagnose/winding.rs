//! The winding's equation, fitted to a current by its output error, for sensors that show one sign only.

use super::view::View;
use crate::numeric::{count, order_statistic};

/// Samples that a fit looks at, at most.
const FITTED_MAX: usize = 8000;
/// Electrical time constants that a fit starts from \[samples\].
const LAGS: [f64; 5] = [0.1, 1.0, 4.0, 15.0, 50.0];
/// Back-EMF constants that a fit starts from, in parts of the voltage over the speed of a driven motor.
const BACKS: [f64; 5] = [0.25, 0.5, 0.75, 0.9, 1.0];
/// The first step of the drop of voltage, and its most, in parts of the largest voltage: a larger one would do what a sensor
/// that stops at 0 A does.
const DROP: [f64; 2] = [0.01, 0.2];
/// Rounds of a descent along each coordinate.
const ROUNDS: usize = 30;

/// The characteristic of a current sensor.
pub(super) type Shows = fn(f64) -> f64;

/// A winding i′ = (g (v − K ω, less a drop) − i)/τ, and how well a current is explained by it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Winding {
    /// K \[V s/rad\], ln of τ in samples, and the drop \[V\].
    at: [f64; 3],
    /// g = 1/R \[A/V\].
    conductance: f64,
    /// The standard deviation of the current that is left \[A\].
    pub error: f64,
}

impl Winding {
    /// Fits the current that a sensor shows of the winding's; `None` where the motor does not turn.
    pub(super) fn fitted(view: &View<'_>, speed: &[f64], current: &[f64], sign: f64, shows: Shows) -> Option<Self> {
        let v = view.input.values;
        let first = v.iter().position(|v| *v != 0.0)?.saturating_sub(1);
        let fitted = first..v.len().min(first + FITTED_MAX);
        let fit = Fit { v: &v[fitted.clone()], w: &speed[fitted.clone()], i: &current[fitted], sign, shows };
        let fast = view.speed.as_ref()?.peak;
        let driven = |n: &usize| sign * fit.w[*n] > 0.3 * fast && sign * fit.v[*n] > 0.0;
        let mut ratios: Vec<f64> = (0..fit.v.len()).filter(driven).map(|n| fit.v[n] / fit.w[n]).collect();
        let ratio = order_statistic(&mut ratios, 0.5);
        let starts = BACKS.iter().flat_map(|part| LAGS.map(|lag| [part * ratio, lag.ln(), 0.0]));
        let best = starts.map(|at| fit.winding(at)).min_by(|a, b| a.error.total_cmp(&b.error))?;
        let peak = view.input.peak;
        (ratio > 0.0).then(|| fit.descended(best, [0.1 * ratio, 0.5, DROP[0] * peak], DROP[1] * peak))
    }

    /// Returns the winding's current under the voltage and the speed of a whole recording.
    pub(super) fn current(&self, voltage: &[f64], speed: &[f64]) -> Vec<f64> {
        let mut course = Vec::with_capacity(voltage.len());
        courses(self.at, voltage, speed, |i| course.push(self.conductance * i));
        course
    }
}

/// Hands on the course of R i.
fn courses([back, lag, drop]: [f64; 3], v: &[f64], w: &[f64], mut take: impl FnMut(f64)) {
    let decay = (-(-lag).exp()).exp();
    let mut state = 0.0;
    take(state);
    for n in 1..v.len() {
        let volts = v[n - 1] - back * 0.5 * (w[n] + w[n - 1]);
        // A drop of the brushes or a deadband lessens the voltage in both directions.
        let left = volts - volts.clamp(-drop, drop);
        state = left + decay * (state - left);
        take(state);
    }
}

/// The subject of a fit.
struct Fit<'a> {
    v: &'a [f64],
    w: &'a [f64],
    i: &'a [f64],
    sign: f64,
    shows: Shows,
}

impl Fit<'_> {
    /// The winding with the conductance that fits best.
    fn winding(&self, at: [f64; 3]) -> Winding {
        let [mut square, mut product, mut all] = [0.0; 3];
        let mut current = self.i.iter();
        courses(at, self.v, self.w, |i| {
            let (shown, measured) = ((self.shows)(self.sign * i), current.next().map_or(0.0, |i| self.sign * i));
            square += shown * shown;
            product += shown * measured;
            all += measured * measured;
        });
        let conductance = if square > 0.0 { product / square } else { 0.0 };
        let left = if conductance > 0.0 { all - conductance * product } else { all };
        Winding { at, conductance: conductance.max(0.0), error: (left.max(0.0) / count(self.i.len())).sqrt() }
    }

    /// Descends along one coordinate after the other, with steps that grow and shrink.
    fn descended(&self, mut best: Winding, mut steps: [f64; 3], drop_max: f64) -> Winding {
        for _ in 0..ROUNDS {
            for k in 0..3 {
                let moved = [1.0, -1.0].map(|sign| {
                    let mut at = best.at;
                    at[k] += sign * steps[k];
                    at[2] = at[2].clamp(0.0, drop_max);
                    self.winding(at)
                });
                let better = moved.into_iter().min_by(|a, b| a.error.total_cmp(&b.error));
                match better.filter(|moved| moved.error < best.error) {
                    Some(moved) => (best, steps[k]) = (moved, 1.3 * steps[k]),
                    None => steps[k] *= 0.5,
                }
            }
        }
        best
    }
}
