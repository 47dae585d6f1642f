//! The state at the start of a recording under given parameters, where it is free.
//!
//! The output of a linear motor is linear in that state: one Gauss–Newton step from anywhere is the least squares
//! estimate. Friction bends it a little, and takes a few. A state that the recording hardly shows, as a current that decays
//! within a sample, stays near where it was measured: the estimate has a prior as wide as the motor can be driven.

use super::normal::Fit;
use super::refine::check_plain;
use crate::Result;
use crate::evaluate::{Problem, Signals};
use crate::motor::{Input, Parameters};
use crate::numeric::peak;
use nalgebra::{DMatrix, DVector};

/// Steps where the output is not linear.
const BENT_STEPS: usize = 5;
/// Standard deviation of the prior, in largest states: nothing is lost of a state that is seen.
const PRIOR: f64 = 3.0;

/// Returns the largest current and speed that a recording shows, or its input drives the motor to; 1 where there is neither.
fn largest(signals: &Signals, motor: &Parameters, input: Input) -> [f64; 2] {
    let driven = match input {
        Input::Voltage => [peak(&signals.voltage) / motor.r, peak(&signals.voltage) / motor.k],
        Input::Current => [peak(&signals.voltage), 0.0],
    };
    [0, 1].map(|channel| {
        let shown = signals.measured(channel).fold(0.0, |most: f64, y| most.max(y.abs()));
        let most = shown.max(if driven[channel].is_finite() { driven[channel] } else { 0.0 });
        if most > 0.0 { most } else { 1.0 }
    })
}

/// The state `[i, ω]` at the start of each recording of a problem that [`super::fit_problem`] has made: as it is where it
/// is known, else by least squares with the noise `sigma` of current and speed, the parameters held at `values`.
///
/// # Errors
/// `Usage` when the problem has another criterion, or `values` do not fit its space.
pub fn initial_states(problem: &Problem, values: &[f64], sigma: [f64; 2]) -> Result<Vec<[f64; 2]>> {
    check_plain(problem)?;
    let axes = problem.space().free().len();
    if values.len() != axes {
        let message = format!("{} values for {axes} free parameters", values.len());
        return Err(crate::Error::usage(message, "Give one value per free parameter."));
    }
    let fit = Fit::new(problem);
    let mut at = fit.start(values);
    let (start, motor) = (at.clone(), problem.parameters(values, 0));
    let free = problem.signals().iter().filter(|signals| signals.initial_is_free);
    let precisions: Vec<[f64; 2]> = free
        .map(|signals| largest(signals, &motor, problem.method().input).map(|most| (PRIOR * most).powi(-2)))
        .collect();
    for _ in 0..if problem.features().is_linear() { 1 } else { BENT_STEPS } {
        let (matrix, gradient) = fit.weighted(&fit.normal(&at), &vec![sigma; problem.signals().len()]);
        // The states of one recording do not depend on those of another.
        for (first, precision) in (axes..fit.unknowns).step_by(2).zip(&precisions) {
            let prior = |a: usize, b: usize| if a == b { precision[a] } else { 0.0 };
            let own = DMatrix::from_fn(2, 2, |a, b| matrix[(first + a, first + b)] + prior(a, b));
            let right =
                DVector::from_fn(2, |a, _| gradient[first + a] + precision[a] * (start[first + a] - at[first + a]));
            // One that the recording does not tell stays as measured.
            if let Some(step) =
                own.cholesky().map(|factor| factor.solve(&right)).filter(|s| s.iter().all(|v| v.is_finite()))
            {
                at[first] += step[0];
                at[first + 1] += step[1];
            }
        }
    }
    Ok(fit.initial(&at))
}
