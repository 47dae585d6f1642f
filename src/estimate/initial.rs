//! The state at the start of a recording under given parameters, where it is free.
//!
//! The output of a linear motor is linear in that state: one Gauss–Newton step from anywhere is the least squares
//! estimate. Friction bends it a little, and takes a few.

use super::normal::Fit;
use super::refine::check_plain;
use crate::Result;
use crate::evaluate::Problem;
use nalgebra::{DMatrix, DVector};

/// Steps where the output is not linear.
const BENT_STEPS: usize = 5;

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
    for _ in 0..if problem.features().is_linear() { 1 } else { BENT_STEPS } {
        let (matrix, gradient) = fit.weighted(&fit.normal(&at), &vec![sigma; problem.signals().len()]);
        // The states of one recording do not depend on those of another.
        for first in (axes..fit.unknowns).step_by(2) {
            let own = DMatrix::from_fn(2, 2, |a, b| matrix[(first + a, first + b)]);
            let right = DVector::from_fn(2, |a, _| gradient[first + a]);
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
