//! Stage 2, start: motors near the right one, and the bounds around them.
//!
//! Steiglitz–McBride starts the linear motor, on copies at even steps where a clock is irregular. For others the voltage is delayed by several lags, or gain and time constant
//! are read off the one channel that was measured, or the whole box is searched.

use super::extension_bounds::extended_space;
use super::method::Method;
use super::missing_channel::guess;
use super::prepare::Prepared;
use super::spec::IdentifySpec;
use crate::estimate::{
    Estimate, SmFailure, global_reference, lagged, steiglitz_mcbride as estimated, steiglitz_mcbride_on,
    steiglitz_mcbride_resampled,
};
use crate::evaluate::{Problem, Scalar};
use crate::motor::{Axis, Parameter, Space, With};
use crate::record::Record;
use crate::setting::text;
use crate::{Error, Result};

pub(super) struct Start {
    /// The Steiglitz–McBride estimate of the linear motor, unless asked for by name also on an irregular clock.
    pub estimate: std::result::Result<Estimate, SmFailure>,
    /// R, L, K, B and J of motors near the right one, the likeliest first; empty for the linear motor.
    pub motors: Vec<[f64; 5]>,
    /// The space of the linear motor around them.
    pub space: Space,
}

/// Finds where an identification starts.
///
/// # Errors
/// As the refinement of a motor.
pub(super) fn start(prepared: &Prepared<'_>) -> Result<Start> {
    if !prepared.is_linear() {
        let (motors, space) = near(prepared)?;
        return Ok(Start { estimate: Err(SmFailure::PoorFit), motors, space });
    }
    let estimate = on_any_clock(prepared.records, &prepared.spec, prepared.plain())?;
    let space = match &estimate {
        Ok(estimate) => around(&prepared.spec, &[estimate.parameters.to_array()])?,
        Err(_) => prepared.spec.space.clone(),
    };
    Ok(Start { estimate, motors: Vec::new(), space })
}

/// Returns the Steiglitz–McBride estimate, that of copies at even steps where clocks are irregular unless the method is asked for
/// by name. `plain` is the problem of a fit to the recordings.
pub(super) fn on_any_clock(
    records: &[Record],
    spec: &IdentifySpec,
    plain: &Problem,
) -> Result<std::result::Result<Estimate, SmFailure>> {
    let estimate = steiglitz_mcbride(records, spec, plain)?;
    let is_irregular = records.iter().any(|record| !record.steps().step_index.is_empty());
    if estimate.is_ok() || spec.method == Method::SteiglitzMcBride || !is_irregular {
        return Ok(estimate);
    }
    Ok(best_of(records, spec, |(_, record)| steiglitz_mcbride_resampled(record, spec.model))?.or(estimate))
}

/// Returns the Steiglitz–McBride estimate of each recording, and of these the one that costs least on all. `plain` is the
/// problem of a fit to the recordings.
pub(super) fn steiglitz_mcbride(
    records: &[Record],
    spec: &IdentifySpec,
    plain: &Problem,
) -> Result<std::result::Result<Estimate, SmFailure>> {
    // Where the voltage is a line over each step the fit has another method than this one.
    let is_same = *plain.model() == spec.model;
    let one = |(n, record): (usize, &Record)| match is_same {
        true => steiglitz_mcbride_on(plain, n),
        false => estimated(record, spec.model),
    };
    best_of(records, spec, one)
}

/// Returns the estimate that costs least on all recordings, of those that `one` makes of each.
fn best_of(
    records: &[Record],
    spec: &IdentifySpec,
    one: impl Fn((usize, &Record)) -> Result<std::result::Result<Estimate, SmFailure>>,
) -> Result<std::result::Result<Estimate, SmFailure>> {
    if let [record] = records {
        return one((0, record));
    }
    let mut best: std::result::Result<Estimate, SmFailure> = Err(SmFailure::ChannelMissing);
    let mut lowest = f64::INFINITY;
    // Estimates are compared: times may be rounded.
    let problem = Problem::new(records, spec.model, Space::table2(), spec.criterion)?.at_coarse_steps();
    for found in records.iter().enumerate().map(one) {
        match (found?, &best) {
            (Ok(found), _) => {
                let cost = Scalar::cost(&problem, &found.parameters.to_array());
                if best.is_err() || cost < lowest {
                    (best, lowest) = (Ok(found), cost);
                }
            }
            (Err(failure), Err(_)) => best = Err(failure),
            (Err(_), Ok(_)) => {}
        }
    }
    Ok(best)
}

/// The space with a decade to each side of motors for the axes of the motor that have no bounds of their own.
pub(super) fn around(spec: &IdentifySpec, motors: &[[f64; 5]]) -> Result<Space> {
    let decade = |axis: &Axis| {
        if axis.parameter.is_extension() || !spec.auto_bounds.contains(&axis.parameter) {
            return *axis;
        }
        let values = || motors.iter().map(|motor| motor[axis.parameter as usize]);
        let [low, high] = [values().fold(f64::INFINITY, f64::min), values().fold(0.0, f64::max)];
        Axis { min: 0.1 * low, max: 10.0 * high, ..*axis }
    };
    Space::new(spec.space.free().iter().map(decade).collect(), spec.space.fixed().to_vec())
}

/// Motors near the right one, the likeliest first, and the space of the linear motor around them.
fn near(prepared: &Prepared<'_>) -> Result<(Vec<[f64; 5]>, Space)> {
    let (records, spec) = (prepared.records, prepared.spec.as_ref());
    if let Some(model) = &prepared.normalized {
        return Ok((vec![model.motor], model.space.clone()));
    }
    if let Some(motor) = held_motor(spec) {
        return Ok((vec![motor], spec.space.clone()));
    }
    let mut motors = lagged(records, spec.model);
    motors.extend(guess(records, spec));
    if motors.is_empty() {
        let linear = linear(&spec.space)?;
        let found = global_reference(&prepared.fitted(&linear), prepared.deviations(), None)?;
        motors.push(found.refined.parameters.to_array());
    }
    let space = around(spec, &motors)?;
    Ok((motors, space))
}

fn linear(space: &Space) -> Result<Space> {
    let free = space.free().iter().filter(|axis| !axis.parameter.is_extension()).copied().collect();
    let fixed = space.fixed().iter().filter(|(parameter, _, _)| !parameter.is_extension()).copied().collect();
    Space::new(free, fixed)
}

/// Returns what is certainly free: of a motor that is fixed as a whole, its extensions.
pub(super) fn asked_space(records: &[Record], spec: &IdentifySpec) -> Result<Space> {
    match (&spec.with, held_motor(spec)) {
        (With::These(list), Some(motor)) => extended_space(records, spec, &spec.space, (list, &motor)),
        (With::Auto, Some(_)) => {
            let what = "compares fits of the linear motor with others";
            let message = text!("every parameter is held, and " [With = "auto"] " {what}");
            let hint = text!("Name the extensions, as in " [With = "load"] ", or leave a parameter free.");
            Err(Error::usage(message, hint))
        }
        _ => Ok(spec.space.clone()),
    }
}

/// R, L, K, B and J, where all are held.
fn held_motor(spec: &IdentifySpec) -> Option<[f64; 5]> {
    let [r, l, k, b, j] = Parameter::ALL.map(|parameter| spec.fixed(parameter));
    Some([r?, l?, k?, b?, j?])
}
