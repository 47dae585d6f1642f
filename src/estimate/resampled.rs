//! Steiglitz–McBride for recordings on an irregular clock: on copies at even steps. The estimate is biased by what lies
//! between samples, and starts a refinement on the true times.

use super::failure::SmFailure;
use super::normal::Fit;
use super::refine::{first_sigma, fit_problem};
use super::steiglitz_mcbride::{Estimate, steiglitz_mcbride};
use crate::Result;
use crate::evaluate::{Initial, Model, Problem};
use crate::motor::{Discretization, Space};
use crate::numeric::count;
use crate::record::Record;
use std::cell::OnceCell;

/// Periods of the copies, in mean steps of the recording. Shorter ones serve motors whose electrical time constant is short.
const PERIODS: [f64; 3] = [1.0, 0.5, 2.0];

/// Residuals below this part of the deviation of each channel leave a start near enough: no other copy is tried.
const NEAR: f64 = 0.1;

/// Estimates the motor of one recording on any clock: of the estimates from copies at even steps, the first whose motor fits the
/// recording itself well, or the one that fits it best.
///
/// # Errors
/// As [`steiglitz_mcbride`].
pub(crate) fn steiglitz_mcbride_resampled(
    record: &Record,
    model: Model,
) -> Result<std::result::Result<Estimate, SmFailure>> {
    Ok(best_copy(record, model, None)?.1)
}

/// Returns the same with the place of its copy among all, which are tried but for `only` one if that is given.
///
/// # Errors
/// As [`steiglitz_mcbride`].
pub(super) fn best_copy(
    record: &Record,
    model: Model,
    only: Option<usize>,
) -> Result<(Option<usize>, std::result::Result<Estimate, SmFailure>)> {
    if record.steps().step_index.is_empty() {
        return Ok((None, steiglitz_mcbride(record, model)?));
    }
    let problem = fit_problem(std::slice::from_ref(record), &Space::table2(), model)?;
    let (mut lowest, mut best) = (f64::INFINITY, (None, Err(SmFailure::Irregular)));
    for (place, copy) in copies(record, model.discretization, only) {
        // The mean of the input over each step of a copy is held; a part of a recording may begin in motion.
        let found = steiglitz_mcbride(&copy, Model { discretization: Discretization::Zoh, initial: Initial::Auto })?;
        match found {
            Ok(estimate) => {
                let (cost, is_near) = misfit(&problem, &estimate);
                if cost < lowest {
                    (lowest, best) = (cost, (Some(place), Ok(Estimate { is_resampled: true, ..estimate })));
                }
                if is_near {
                    break;
                }
            }
            Err(failure) if best.1.is_err() => best.1 = Err(failure),
            Err(_) => {}
        }
    }
    Ok(best)
}

/// Returns the copies of a recording at even steps and those of its longest part where it has gaps, each with its place among
/// all; but for `only` one if that is given.
fn copies(
    record: &Record,
    discretization: Discretization,
    only: Option<usize>,
) -> impl Iterator<Item = (usize, Record)> {
    let is_held = !discretization.uses_next_input();
    let part = OnceCell::new();
    let is_asked = move |place: &usize| only.is_none_or(|only| only == *place);
    (0..2 * PERIODS.len()).filter(is_asked).filter_map(move |place| {
        let is_whole = place < PERIODS.len();
        let record = if is_whole { record } else { part.get_or_init(|| record.longest_part()).as_ref()? };
        let mean = record.duration_s() / count(record.len() - 1);
        let period_s = PERIODS[place % PERIODS.len()] * mean.min(2.0 * record.period_s());
        Some((place, record.at_even_steps(period_s, is_held).ok()?))
    })
}

/// Returns the sum of squared errors of a motor in units of the noise, and whether they are a small part of each channel.
fn misfit(problem: &Problem, estimate: &Estimate) -> (f64, bool) {
    let signals = &problem.signals()[0];
    let (fit, sigma) = (Fit::new(problem), first_sigma(signals));
    let squares = fit.normal(&fit.start(&estimate.parameters.to_array())).all_squares()[0];
    let is_near = (0..2)
        .filter(|&channel| signals.has(channel))
        .all(|channel| squares[channel] < count(signals.count(channel)) * (NEAR * signals.deviation(channel)).powi(2));
    (squares.iter().zip(sigma).map(|(square, sigma)| square / (sigma * sigma)).sum(), is_near)
}
