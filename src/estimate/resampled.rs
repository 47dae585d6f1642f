//! Steiglitz–McBride for recordings on an irregular clock: on copies at even steps. The estimate is biased by what lies
//! between samples, and starts a refinement on the true times.

use super::failure::SmFailure;
use super::refine::{first_sigma, fit_problem};
use super::steiglitz_mcbride::{Estimate, steiglitz_mcbride};
use crate::Result;
use crate::evaluate::{Initial, Model, Problem};
use crate::motor::{Discretization, Space};
use crate::numeric::count;
use crate::record::Record;

/// Periods of the copies, in mean steps of the recording. Shorter ones serve motors whose electrical time constant is short.
const PERIODS: [f64; 3] = [1.0, 0.5, 2.0];

/// Estimates the motor of one recording on any clock: of the estimates from copies at even steps, the one whose motor fits the
/// recording itself best.
///
/// # Errors
/// As [`steiglitz_mcbride`].
pub(crate) fn steiglitz_mcbride_resampled(
    record: &Record,
    model: Model,
) -> Result<std::result::Result<Estimate, SmFailure>> {
    if record.steps().step_index.is_empty() {
        return steiglitz_mcbride(record, model);
    }
    let problem = fit_problem(std::slice::from_ref(record), &Space::table2(), model)?;
    let mut best: (f64, std::result::Result<Estimate, SmFailure>) = (f64::INFINITY, Err(SmFailure::Irregular));
    for copy in copies(record, model.discretization) {
        // The mean of the input over each step of a copy is held; a part of a recording may begin in motion.
        let found = steiglitz_mcbride(&copy, Model { discretization: Discretization::Zoh, initial: Initial::Auto })?;
        match found {
            Ok(estimate) => {
                let cost = cost(&problem, &estimate);
                if cost < best.0 {
                    best = (cost, Ok(Estimate { is_resampled: true, ..estimate }));
                }
            }
            Err(failure) if best.1.is_err() => best.1 = Err(failure),
            Err(_) => {}
        }
    }
    Ok(best.1)
}

/// Returns the copies of a recording at even steps, and those of its longest part where it has gaps.
fn copies(record: &Record, discretization: Discretization) -> Vec<Record> {
    let is_held = !discretization.uses_next_input();
    let part = record.longest_part();
    let of = |record: &Record| {
        let mean = record.duration_s() / count(record.len() - 1);
        PERIODS.map(|times| record.at_even_steps(times * mean.min(2.0 * record.period_s()), is_held).ok())
    };
    std::iter::once(record).chain(&part).flat_map(of).flatten().collect()
}

/// The sum of squared errors of a motor in units of the noise.
fn cost(problem: &Problem, estimate: &Estimate) -> f64 {
    let signals = &problem.signals()[0];
    let (model, sigma) = (problem.simulate(&estimate.parameters.to_array(), 0, signals.initial), first_sigma(signals));
    let of = |channel: usize| {
        let pairs = signals.measured(channel).zip(&model[channel]).enumerate();
        let counting = pairs.filter(|(n, _)| signals.counts(channel, *n));
        counting.map(|(_, (y, x))| (y - x).powi(2)).sum::<f64>() / sigma[channel].powi(2)
    };
    (0..2).filter(|&channel| signals.has(channel)).map(of).sum()
}
