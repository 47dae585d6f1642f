//! Stage 2, start: initial estimates of the motor, and automatic bounds around them.
//!
//! The linear motor starts from the Steiglitz–McBride estimate, on an irregular clock of copies that are resampled at even
//! steps. Other models start from Steiglitz–McBride estimates with the voltage delayed by several lags, from the gain and time
//! constant of the only measured channel, or from a global search.

use super::extension_bounds::extended_space;
use super::method::Method;
use super::missing_channel::guess;
use super::prepare::Prepared;
use super::spec::IdentifySpec;
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_estimate::{
    Estimate, SmFailure, delayed_estimates, global_reference, steiglitz_mcbride as estimated, steiglitz_mcbride_on,
    steiglitz_mcbride_resampled,
};
use motorfit_evaluate::{Problem, Scalar};
use motorfit_motor::{Axis, Parameter, Space, With};
use motorfit_record::Record;

/// The start of an identification.
pub(super) struct Start {
    /// Steiglitz–McBride estimate of the linear motor. It may come from a resampled copy unless the method is requested by
    /// name.
    pub estimate: std::result::Result<Estimate, SmFailure>,
    /// Initial estimates of R, L, K, B and J, the most likely first; empty for the linear motor.
    pub motors: Vec<[f64; 5]>,
    /// Search space of the linear motor around the initial estimates.
    pub space: Space,
}

/// Computes the initial estimates and the search space of the linear motor.
///
/// # Errors
/// Propagates the errors of the Steiglitz–McBride estimates, of the global search and of the space.
pub(super) fn start(prepared: &Prepared<'_>) -> Result<Start> {
    if !prepared.is_linear() {
        let (motors, space) = near(prepared)?;
        return Ok(Start { estimate: Err(SmFailure::NotLinear), motors, space });
    }
    let estimate = on_any_clock(prepared.records, &prepared.spec, prepared.plain())?;
    let space = match &estimate {
        Ok(estimate) => around(&prepared.spec, &[estimate.parameters.to_array()])?,
        Err(_) => prepared.spec.space.clone(),
    };
    Ok(Start { estimate, motors: Vec::new(), space })
}

/// Returns the Steiglitz–McBride estimate. If it fails on an irregular clock, copies resampled at even steps are used, unless
/// the method is requested by name. `plain` is the problem of a fit to the recordings.
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

/// Computes the Steiglitz–McBride estimate of each recording and returns the one with the lowest cost on all of them. `plain`
/// is the problem of a fit to the recordings.
pub(super) fn steiglitz_mcbride(
    records: &[Record],
    spec: &IdentifySpec,
    plain: &Problem,
) -> Result<std::result::Result<Estimate, SmFailure>> {
    // The problem of the fit has another discretization if the recordings contain slopes of the voltage.
    let is_same = *plain.model() == spec.model;
    let one = |(n, record): (usize, &Record)| match is_same {
        true => steiglitz_mcbride_on(plain, n),
        false => estimated(record, spec.model),
    };
    best_of(records, spec, one)
}

/// Applies `one` to each recording and returns the estimate with the lowest cost on all of them.
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
    // Rounded sampling times are accurate enough to compare estimates.
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

/// Returns the space of the spec with automatic bounds of the motor's parameters set to one decade on each side of `motors`.
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

/// Returns initial estimates of the motor, the most likely first, and the space of the linear motor around them.
fn near(prepared: &Prepared<'_>) -> Result<(Vec<[f64; 5]>, Space)> {
    let (records, spec) = (prepared.records, prepared.spec.as_ref());
    if let Some(model) = &prepared.normalized {
        return Ok((vec![model.motor], model.space.clone()));
    }
    if let Some(motor) = fixed_motor(spec) {
        return Ok((vec![motor], spec.space.clone()));
    }
    let mut motors = delayed_estimates(records, spec.model);
    motors.extend(guess(records, spec));
    if motors.is_empty() {
        let linear = linear(&spec.space)?;
        let found = global_reference(&prepared.fitted(&linear), prepared.deviations())?;
        motors.push(linear.parameters(&found.refined.values, 0).to_array());
    }
    let space = around(spec, &motors)?;
    Ok((motors, space))
}

/// Returns a space without the parameters of extensions.
fn linear(space: &Space) -> Result<Space> {
    let free = space.free().iter().filter(|axis| !axis.parameter.is_extension()).copied().collect();
    let fixed = space.fixed().iter().filter(|(parameter, _, _)| !parameter.is_extension()).copied().collect();
    Space::new(free, fixed)
}

/// Returns the space whose identifiability is checked before the fit: that of the spec, with the named extensions if all
/// parameters of the motor are fixed.
///
/// # Errors
/// Returns `Usage` if the extensions are to be selected for a motor with all parameters fixed.
pub(super) fn requested_space(records: &[Record], spec: &IdentifySpec) -> Result<Space> {
    match (&spec.with, fixed_motor(spec)) {
        (With::These(list), Some(motor)) => extended_space(records, spec, &spec.space, (list, &motor)),
        (With::Auto, Some(_)) => {
            let what = "compares fits of the linear motor with others";
            let message = text!("every parameter is fixed, and " [With = "auto"] " {what}");
            let hint = text!("Name the extensions, as in " [With = "load"] ", or leave a parameter free.");
            Err(Error::usage(message, hint))
        }
        _ => Ok(spec.space.clone()),
    }
}

/// Returns R, L, K, B and J if all are fixed.
fn fixed_motor(spec: &IdentifySpec) -> Option<[f64; 5]> {
    let [r, l, k, b, j] = Parameter::ALL.map(|parameter| spec.fixed(parameter));
    Some([r?, l?, k?, b?, j?])
}
