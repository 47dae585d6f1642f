//! Output-error fit of the winding's equation to the current of a unidirectional sensor.
//!
//! `τ di/dt = g u − i` is driven by the measured voltage and speed: u is `v − K ω`, reduced in magnitude by a voltage drop d,
//! `u = x − clamp(x, −d, d)` with `x = v − K ω`. K, ln τ and the drop are found by a coordinate search from several starts, the
//! conductance g by linear least squares.

use super::view::View;
use motorfit_core::numeric::{count, order_statistic};

/// Largest number of samples in a fit.
const FITTED_MAX: usize = 8000;
/// Electrical time constants of the starts \[samples\].
const LAGS: [f64; 5] = [0.1, 1.0, 4.0, 15.0, 50.0];
/// Back-EMF constants of the starts, relative to the median ratio of voltage to speed of the driven motor.
const BACKS: [f64; 5] = [0.25, 0.5, 0.75, 0.9, 1.0];
/// Initial step and upper bound of the voltage drop, as fractions of the peak voltage. A larger drop would have the same
/// effect as a sensor that clips at 0 A.
const DROP: [f64; 2] = [0.01, 0.2];
/// Number of rounds of the coordinate search.
const ROUNDS: usize = 30;

/// Characteristic of a current sensor: the measured current as a function of the true one.
pub(super) type Sensor = fn(f64) -> f64;

/// Fitted winding `di/dt = (g u − i)/τ`, and the standard deviation of its residuals.
#[derive(Debug, Clone, Copy)]
pub(super) struct Winding {
    /// K \[V s/rad\], ln τ with τ in samples, and the drop \[V\].
    at: [f64; 3],
    /// Conductance g = 1/R \[A/V\].
    conductance: f64,
    /// Standard deviation of the residuals of the current \[A\].
    pub error: f64,
}

impl Winding {
    /// Fits the winding to a measured current; `None` if the motor does not turn in the direction of `sign` under voltage.
    pub(super) fn fitted(view: &View<'_>, speed: &[f64], current: &[f64], sign: f64, sensor: Sensor) -> Option<Self> {
        let v = view.input.values;
        let first = v.iter().position(|v| *v != 0.0)?.saturating_sub(1);
        let fitted = first..v.len().min(first + FITTED_MAX);
        let fit = Fit { v: &v[fitted.clone()], w: &speed[fitted.clone()], i: &current[fitted], sign, sensor };
        let fast = view.speed.as_ref()?.peak;
        let driven = |n: &usize| sign * fit.w[*n] > 0.3 * fast && sign * fit.v[*n] > 0.0;
        let mut ratios: Vec<f64> = (0..fit.v.len()).filter(driven).map(|n| fit.v[n] / fit.w[n]).collect();
        let ratio = order_statistic(&mut ratios, 0.5);
        let starts = BACKS.iter().flat_map(|part| LAGS.map(|lag| [part * ratio, lag.ln(), 0.0]));
        let best = starts.map(|at| fit.winding(at)).min_by(|a, b| a.error.total_cmp(&b.error))?;
        let peak = view.input.peak;
        (ratio > 0.0).then(|| fit.coordinate_search(best, [0.1 * ratio, 0.5, DROP[0] * peak], DROP[1] * peak))
    }

    /// Returns the current \[A\] of the winding under the voltage and speed of a complete recording.
    pub(super) fn current(&self, voltage: &[f64], speed: &[f64]) -> Vec<f64> {
        let mut current = Vec::with_capacity(voltage.len());
        simulate(self.at, voltage, speed, |i| current.push(self.conductance * i));
        current
    }
}

/// Simulates the winding and passes R i \[V\] of each sample to `take`.
fn simulate([back, lag, drop]: [f64; 3], v: &[f64], w: &[f64], mut take: impl FnMut(f64)) {
    let decay = (-(-lag).exp()).exp();
    let mut state = 0.0;
    take(state);
    for n in 1..v.len() {
        let volts = v[n - 1] - back * 0.5 * (w[n] + w[n - 1]);
        // A brush drop or a deadband reduces the voltage in both directions.
        let driving = volts - volts.clamp(-drop, drop);
        state = driving + decay * (state - driving);
        take(state);
    }
}

/// Data of a fit: voltage, speed, measured current, its sign and the sensor.
struct Fit<'a> {
    v: &'a [f64],
    w: &'a [f64],
    i: &'a [f64],
    sign: f64,
    sensor: Sensor,
}

impl Fit<'_> {
    /// Returns the winding with the least-squares conductance for K, ln τ and the drop.
    fn winding(&self, at: [f64; 3]) -> Winding {
        let [mut square, mut product, mut all] = [0.0; 3];
        let mut current = self.i.iter();
        simulate(at, self.v, self.w, |i| {
            let (shown, measured) = ((self.sensor)(self.sign * i), current.next().map_or(0.0, |i| self.sign * i));
            square += shown * shown;
            product += shown * measured;
            all += measured * measured;
        });
        let conductance = if square > 0.0 { product / square } else { 0.0 };
        let sse = if conductance > 0.0 { all - conductance * product } else { all };
        Winding { at, conductance: conductance.max(0.0), error: (sse.max(0.0) / count(self.i.len())).sqrt() }
    }

    /// Improves a fit by coordinate search: a step grows by 1.3 after a success and is halved after a failure.
    fn coordinate_search(&self, mut best: Winding, mut steps: [f64; 3], drop_max: f64) -> Winding {
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
