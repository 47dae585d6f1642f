//! Levenberg–Marquardt in the criterion of a search: the local search of a multistart.
//!
//! Residuals are divided by the scale of the criterion, so that its weighted sum of squares is minimized, with the initial states of
//! the search. Criteria of magnitudes and with weights over time are evaluated at the optimum of the squares.

use super::descent::Descent;
use super::normal::{Fit, Sigma};
use crate::evaluate::{Problem, Scalar, Signals};
use crate::numeric::{count, index};
use std::sync::Arc;

/// Length of a step, relative to the root of the weighted squares of the measured signals, below which a descent ends: the next one
/// would change the cost by less than rounding.
const TOLERANCE: f64 = 1e-9;

/// Descends from `start` with at most `evaluations` evaluations, where a simulation with derivatives counts as one and one more for
/// each free parameter. Returns the values of the end, its cost, and the number of evaluations. The cost is +∞ if there are too few
/// evaluations, or if the motor diverges at the start.
#[must_use]
pub fn descend(problem: &Problem, start: &[f64], evaluations: u64) -> (Vec<f64>, f64, u64) {
    let each = 1 + problem.space().free().len() as u64;
    let failed = |evaluations: u64| (start.to_vec(), f64::INFINITY, evaluations);
    let simulations = evaluations / each;
    if simulations == 0 || start.len() != problem.space().free().len() {
        return failed(evaluations.max(1));
    }
    let problem = problem.with_known_initial();
    let fit = Fit::new(&problem);
    let sigma = scales(&problem);
    let Ok(descent) = Descent::new(&fit, start, sigma.clone()) else { return failed(each) };
    let mut descent = descent.at_most(index(simulations - 1));
    descent.run(TOLERANCE * signal_length(&problem, &sigma));
    let (values, simulations) = descent.end();
    let cost = Scalar::cost(&problem, &values);
    let cost = if cost.is_nan() { f64::INFINITY } else { cost };
    (values, cost, simulations as u64 * each)
}

/// Returns the divisors of the residuals of each recording and channel.
fn scales(problem: &Problem) -> Sigma {
    let divisor = |factor: f64| if factor > 0.0 { 1.0 / factor.sqrt() } else { 1.0 };
    problem.signals().iter().map(|signals| signals.factor.map(divisor)).collect()
}

/// Returns the root of the squares of the measured signals, weighted as the residuals.
fn signal_length(problem: &Problem, sigma: &Sigma) -> f64 {
    let one = |(signals, sigma): (&Arc<Signals>, &[f64; 2])| {
        let channel = |channel: usize| {
            let length = signals.rms(channel) / sigma[channel];
            if signals.has(channel) { length * length * count(signals.count(channel)) } else { 0.0 }
        };
        channel(0) + channel(1)
    };
    problem.signals().iter().zip(sigma).map(one).sum::<f64>().sqrt()
}
