//! Validation: how well parameters explain recordings that they were not fitted to.

use super::figures;
use super::residuals::{self, ResidualTests};
use super::spec::{Identification, IdentifySpec};
use crate::Result;
use crate::estimate::{fit_problem, initial_states};
use crate::record::Record;

/// A recording that was held out.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldOut {
    /// The recording.
    pub record: Record,
    /// The state `[i, ω]` at its start.
    pub initial: [f64; 2],
    /// Whether that was estimated from the recording: all that is.
    pub initial_is_estimated: bool,
    /// 100 (1 − ‖y − ŷ‖/‖y − mean y‖) of current and speed; `None` for a channel not measured.
    pub fit_percent: [Option<f64>; 2],
    /// Standard deviation of the residuals of both.
    pub residual_sigma: [Option<f64>; 2],
    /// The residuals of both, tested.
    pub residual_tests: ResidualTests,
}

/// How well parameters explain held-out recordings.
#[derive(Debug, Clone, PartialEq)]
pub struct Validation {
    /// One by one.
    pub held_out: Vec<HeldOut>,
    /// The fit over all of them. Where they hardly move there is little to explain, and the residuals tell more.
    pub fit_percent: [Option<f64>; 2],
    /// Standard deviation of the residuals over all of them.
    pub residual_sigma: [Option<f64>; 2],
}

/// Simulates held-out recordings with the parameters that were found, without another fit: the state at the start alone is
/// estimated where a recording begins in motion.
///
/// # Errors
/// As for a problem of these recordings.
pub fn validate(records: &[Record], spec: &IdentifySpec, found: &Identification) -> Result<Validation> {
    let problem = fit_problem(records, &found.space, spec.model)?;
    let values: Vec<f64> = found.space.free().iter().map(|axis| found.parameters.get(axis.parameter)).collect();
    let sigma = found.residual_sigma.map(|sigma| sigma.filter(|s| *s > 0.0).unwrap_or(1.0));
    let initial = initial_states(&problem, &values, sigma)?;
    let moved = residuals::moved(found, &values);
    let one = |(n, record): (usize, &Record)| {
        let alone = std::slice::from_ref(record);
        let own = fit_problem(alone, &found.space, spec.model)?.starting_from(&initial[n..=n]);
        let (fit_percent, residual_sigma) = figures::of(alone, &own, &values);
        Ok(HeldOut {
            record: record.clone(),
            initial: initial[n],
            initial_is_estimated: own.signals()[0].is_initial_free(),
            fit_percent,
            residual_sigma,
            residual_tests: residuals::tests(alone, &own, &values, &moved)[0],
        })
    };
    let held_out = records.iter().enumerate().map(one).collect::<Result<Vec<_>>>()?;
    let (fit_percent, residual_sigma) = figures::of(records, &problem.starting_from(&initial), &values);
    Ok(Validation { held_out, fit_percent, residual_sigma })
}
