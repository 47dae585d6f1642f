//! Variable projection: a two-dimensional global search for the linear motor.
//!
//! With zero initial state and a given denominator `s² + c₁ s + c₀` (`c₁ = R/L + B/J`, `c₀ = (RB + K²)/(LJ)`) the outputs
//! are linear in `p = 1/L`, `q = B/(LJ)` and `r = K/(LJ)`: the current is `(p s + q)/(…)`, the speed `r/(…)`. With p, q and
//! r solved for by linear least squares, the cost is a function of (c₁, c₀) alone, and a grid over the logarithms of both
//! shows its basins. Reference: G. H. Golub, V. Pereyra, SIAM J. Numerical Analysis 10 (1973).
//!
//! The basis functions `s/(…)` and `1/(…)` are current and speed of the motor with R = c₁, L = 1, K = J = c₀, B = 0.

use super::projection_sums::{LANES, SUMS, sums};
use motorfit_evaluate::{Problem, Signals};
use motorfit_motor::{Discretization, Parameters};

/// Returns true if the projection applies to a problem: all five parameters free and shared, both channels measured, motors
/// at rest without load, an exact discretization.
pub(super) fn applies(problem: &Problem) -> bool {
    let exact = matches!(problem.model().discretization, Discretization::Zoh | Discretization::Foh);
    let axes = problem.space().free();
    let served = |s: &Signals| {
        let quiet = s.torque.iter().all(|t| *t == 0.0);
        s.has(0) && s.has(1) && s.starts_at_rest() && quiet
    };
    exact
        && problem.features().is_linear()
        && axes.len() == 5
        && problem.space().fixed().is_empty()
        && problem.signals().iter().all(|s| served(s))
}

/// Returns the sum of squares of each channel that counts, in units of σ².
pub(super) fn power(problem: &Problem, sigma: &[Vec<f64>]) -> [f64; 2] {
    let mut power = [0.0; 2];
    for (signals, sigma) in problem.signals().iter().zip(sigma) {
        for (n, y) in signals.measured.iter().enumerate() {
            let counts = signals.weight.get(n).unwrap_or(&[1.0; 2]);
            for channel in 0..2 {
                power[channel] += counts[channel] * y[channel] * y[channel] / (sigma[channel] * sigma[channel]);
            }
        }
    }
    power
}

/// Returns the cost and (p, q, r) at up to [`LANES`] points, given the power of the measured values.
pub(super) fn project(
    problem: &Problem,
    points: &[[f64; 2]],
    sigma: &[Vec<f64>],
    power: [f64; 2],
) -> Vec<(f64, [f64; 3])> {
    // Sums over both channels in units of their σ; φ₀² has a sum for each channel.
    let mut totals = [[0.0; LANES]; SUMS];
    for (signals, sigma) in problem.signals().iter().zip(sigma) {
        let point = |lane: usize| points[lane.min(points.len() - 1)];
        let c1: [f64; LANES] = std::array::from_fn(|lane| point(lane)[0]);
        let c0: [f64; LANES] = std::array::from_fn(|lane| point(lane)[1]);
        let motors = [c1, [1.0; LANES], c0, [0.0; LANES], c0];
        let sums = sums(signals, &motors, problem.model().discretization);
        let [current, speed] = [0, 1].map(|channel: usize| 1.0 / (sigma[channel] * sigma[channel]));
        let weights = [current, current, current, current, current, speed, speed];
        for (total, (weight, sum)) in totals.iter_mut().zip(weights.iter().zip(&sums)) {
            total.iter_mut().zip(sum).for_each(|(total, sum)| *total += weight * sum);
        }
    }
    (0..points.len()).map(|lane| solve(totals.map(|sum| sum[lane]), power)).collect()
}

/// Returns the cost and (p, q, r) of the linear least-squares problem at one point.
fn solve([a, b, c, u, v, w, d]: [f64; SUMS], power: [f64; 2]) -> (f64, [f64; 3]) {
    let determinant = a * c - b * b;
    let (p, q, r) = ((c * u - b * v) / determinant, (a * v - b * u) / determinant, w / d);
    // Poles much faster than the clock explain nothing, and neither do samples that do not count.
    let rest = |power: f64, explained: f64| if explained.is_finite() { (power - explained).max(0.0) } else { power };
    let cost = rest(power[0], p * u + q * v) + rest(power[1], r * w);
    (if cost.is_finite() { cost } else { f64::INFINITY }, [p, q, r])
}

/// Returns the motor of a point, each parameter clamped to its bounds; one that is not positive and finite becomes the
/// geometric mean of its bounds.
pub(super) fn motor([c1, c0]: [f64; 2], [p, q, r]: [f64; 3], problem: &Problem) -> [f64; 5] {
    let l = 1.0 / p;
    let b_over_j = (q / p).max(1e-9 * c1).min(0.999 * c1);
    let k_over_j = r / p;
    let resistance = l * (c1 - b_over_j);
    let k = (c0 - (c1 - b_over_j) * b_over_j) * l / k_over_j;
    let j = k / k_over_j;
    let found = [resistance, l, k, b_over_j * j, j];
    let mut inside = Parameters::M2.to_array();
    for axis in problem.space().free() {
        let value = found[axis.parameter as usize];
        let middle = (axis.min * axis.max).sqrt();
        inside[axis.parameter as usize] =
            if value > 0.0 && value.is_finite() { value.clamp(axis.min, axis.max) } else { middle };
    }
    inside
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{fit_problem, simulated::simulated};
    use motorfit_evaluate::Model;
    use motorfit_motor::Space;
    use motorfit_record::{Mask, Preparation, Record};

    /// Returns the cost of a recording at the true poles.
    fn cost_at_truth(record: Record) -> f64 {
        let problem = fit_problem(&[record], &Space::table2(), Model::default()).unwrap();
        assert!(applies(&problem));
        let Parameters { r, l, k, b, j } = Parameters::M2;
        let point = [r / l + b / j, (r * b + k * k) / (l * j)];
        let sigma = vec![vec![0.01, 1.0]];
        project(&problem, &[point], &sigma, power(&problem, &sigma))[0].0
    }

    #[test]
    fn outputs_without_a_response_explain_nothing() {
        // All sums are 0 if the poles are far beyond the clock; the least-squares problem then has no solution.
        let power = [3.0, 5.0];
        assert!((solve([0.0; SUMS], power).0 - 8.0).abs() < 1e-15);
        // The speed alone: w = 2, d = 1 explains 4 of 5.
        assert!((solve([0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 1.0], power).0 - 4.0).abs() < 1e-15);
    }

    #[test]
    fn masked_samples_do_not_count_on_any_clock() {
        for jitter in [0.0, 0.3] {
            let time_s: Vec<f64> =
                (0..400).map(|n| 1e-3 * (f64::from(n) + jitter * (1.7 * f64::from(n)).sin())).collect();
            let voltage = (0..400).map(|n| if n / 30 % 2 == 1 { 10.0 } else { -3.0 }).collect();
            let record = simulated(time_s, voltage, None);
            for channels in [[true, true], [true, false], [false, true]] {
                let mask = vec![Mask::Time { channels, from: 0.1, to: 0.2 }];
                let masked = Preparation { mask, ..Preparation::default() }.apply(&record).unwrap().remove(0);
                // Without noise the cost is rounding; interpolated samples in place of the masked ones would cost some 1e4.
                let cost = cost_at_truth(masked);
                assert!(cost < 1e-6, "{jitter} {channels:?}: {cost}");
            }
        }
    }
}
