//! Steiglitz–McBride for recordings on an irregular clock, applied to copies resampled at even steps. Interpolation between
//! samples biases the estimate, which serves as the start of a refinement on the recorded times.

use super::failure::SmFailure;
use super::fit::Fit;
use super::motor::first_sigma;
use super::refine::fit_problem;
use super::steiglitz_mcbride::{Estimate, steiglitz_mcbride};
use motorfit_core::Result;
use motorfit_core::numeric::count;
use motorfit_evaluate::{Initial, Model, Problem};
use motorfit_motor::{Discretization, Space};
use motorfit_record::Record;
use std::cell::OnceCell;

/// Periods of the copies, in mean steps of the recording. The shorter period serves motors with a short electrical time
/// constant.
const PERIODS: [f64; 3] = [1.0, 0.5, 2.0];

/// Ratio of residuals to the standard deviation of each channel below which a start is good enough and no further copy is
/// tried.
const NEAR: f64 = 0.1;

/// Estimates the motor of one recording on any clock. Of the estimates from copies at even steps it returns the first whose
/// motor fits the recording well, or else the one that fits it best.
///
/// # Errors
/// Propagates the errors of [`steiglitz_mcbride`] and [`fit_problem`].
pub fn steiglitz_mcbride_resampled(record: &Record, model: Model) -> Result<std::result::Result<Estimate, SmFailure>> {
    Ok(best_copy(record, model, None)?.1)
}

/// Returns the estimate of [`steiglitz_mcbride_resampled`] with the index of the chosen copy. All copies are tried, or only
/// copy `only` if that is given.
///
/// # Errors
/// Propagates the errors of [`steiglitz_mcbride`] and [`fit_problem`].
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
        // Each step of a copy has the mean of the input over it, a zero-order hold. A segment of a recording may begin in
        // motion.
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

/// Returns the copies of a recording at even steps, and those of its longest segment if it has gaps, each with its index.
/// `only` selects one copy.
fn copies(
    record: &Record,
    discretization: Discretization,
    only: Option<usize>,
) -> impl Iterator<Item = (usize, Record)> {
    let zero_order_hold = !discretization.uses_next_input();
    let part = OnceCell::new();
    let is_selected = move |place: &usize| only.is_none_or(|only| only == *place);
    (0..2 * PERIODS.len()).filter(is_selected).filter_map(move |place| {
        let is_whole = place < PERIODS.len();
        let record = if is_whole { record } else { part.get_or_init(|| record.longest_segment()).as_ref()? };
        let mean = record.duration_s() / count(record.len() - 1);
        let period_s = PERIODS[place % PERIODS.len()] * mean.min(2.0 * record.period_s());
        Some((place, record.resampled_evenly(period_s, zero_order_hold).ok()?))
    })
}

/// Returns the sum of squared residuals of a motor in units of the noise variance, and true if they are a small fraction of
/// each channel.
fn misfit(problem: &Problem, estimate: &Estimate) -> (f64, bool) {
    let signals = &problem.signals()[0];
    let (fit, sigma) = (Fit::new(problem), first_sigma(signals));
    let Some(normal) = fit.normal(&fit.start(&estimate.parameters.to_array())) else { return (f64::INFINITY, false) };
    let squares = &normal.all_squares()[0];
    let is_near = (0..2)
        .filter(|&channel| signals.has(channel))
        .all(|channel| squares[channel] < count(signals.count(channel)) * (NEAR * signals.deviation(channel)).powi(2));
    (squares.iter().zip(sigma).map(|(square, sigma)| square / (sigma * sigma)).sum(), is_near)
}
