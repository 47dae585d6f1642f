//! Initial states of recordings under given parameters, where they are free.
//!
//! The output of a linear motor is linear in the initial state, so one Gauss–Newton step gives the least-squares estimate.
//! Friction makes the output slightly nonlinear and takes a few steps. A Gaussian prior, as wide as the range to which the
//! motor can be driven, keeps a state that hardly shows in the recording near its measured value, for instance a current
//! that decays within a sample.

use super::fit::Fit;
use super::fitted::state;
use super::refine::check_plain;
use motorfit_core::Result;
use motorfit_core::numeric::peak;
use motorfit_evaluate::{Problem, Signals};
use motorfit_motor::{Input, Parameters};
use nalgebra::{DMatrix, DVector};

/// Number of Gauss–Newton steps for a nonlinear motor.
const NONLINEAR_STEPS: usize = 5;
/// Standard deviation of the prior, as a multiple of the largest state; wide enough not to bias an observable state.
const PRIOR: f64 = 3.0;

/// Returns the largest current \[A\] and speed \[rad/s\] that a recording shows or its input can drive the motor to; 1 if
/// both are zero.
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

/// Returns the state `[i, ω]` at the start of each recording of a problem made by [`super::fit_problem`]. A known state is
/// returned as it is; a free one is estimated by least squares with a Gaussian prior about its measured value, with the noise σ
/// `sigma` of current \[A\] and speed \[rad/s\] and the parameters fixed at `values`.
///
/// # Errors
/// Returns `Usage` if the problem has another criterion, or the number of `values` is not that of the free parameters.
pub fn initial_states(problem: &Problem, values: &[f64], sigma: [f64; 2]) -> Result<Vec<[f64; 2]>> {
    check_plain(problem)?;
    let axes = problem.space().free().len();
    if values.len() != axes {
        let message = format!("{} values for {axes} free parameters", values.len());
        return Err(motorfit_core::Error::usage(message, "Give one value per free parameter."));
    }
    let fit = Fit::new(problem);
    let mut at = fit.start(values);
    let (start, motor) = (at.clone(), problem.parameters(values, 0));
    let free = problem.signals().iter().filter(|signals| signals.initial_is_free);
    let precisions: Vec<[f64; 2]> = free
        .map(|signals| largest(signals, &motor, problem.method().input).map(|most| (PRIOR * most).powi(-2)))
        .collect();
    for _ in 0..if problem.features().is_linear() { 1 } else { NONLINEAR_STEPS } {
        // Where the motor diverges the states stay as they are.
        let Some(normal) = fit.normal(&at) else { break };
        let (matrix, gradient) = fit.weighted(&normal, &vec![sigma.to_vec(); problem.signals().len()]);
        // The states of one recording do not depend on those of another.
        for (first, precision) in (axes..fit.unknowns).step_by(2).zip(&precisions) {
            let prior = |a: usize, b: usize| if a == b { precision[a] } else { 0.0 };
            let own = DMatrix::from_fn(2, 2, |a, b| matrix[(first + a, first + b)] + prior(a, b));
            let right =
                DVector::from_fn(2, |a, _| gradient[first + a] + precision[a] * (start[first + a] - at[first + a]));
            // Without a solution the state stays as it is.
            if let Some(step) =
                own.cholesky().map(|factor| factor.solve(&right)).filter(|s| s.iter().all(|v| v.is_finite()))
            {
                at[first] += step[0];
                at[first + 1] += step[1];
            }
        }
    }
    Ok(fit.initial(&at).iter().map(|of| state(of)).collect())
}
