//! A voltage that is logged late: the outputs move before it. Loggers that run at times of their own log a change up to a period
//! after the drive made it; with the voltage taken as it stands the inertia is off by up to a period over the time constant.

use super::bic::effective;
use super::extension_bounds::extended_space;
use super::prepare::Prepared;
use super::refine::Fit;
use crate::analysis::is_lively;
use crate::estimate::{Refined, best_start, carried, descended};
use crate::evaluate::Scalar;
use crate::motor::{Axis, Extension, Input, Parameter, Space};
use crate::record::{Quantity, Record};
use crate::setting::text;
use crate::text::significant;
use crate::warning::{Place, Warning};
use std::sync::Arc;

/// A sum of squares in units of σ² that falls by more than this shows a shift: χ² with one degree of freedom exceeds it, on one
/// side, once in a thousand times.
const STATISTIC: f64 = 9.5;
/// A sum of squares that falls by less while the other parameters stay as they are is not worth a refinement: where these take up
/// nineteen parts of twenty of a shift, one that shows falls by that much.
const FALL: f64 = 0.5;
/// Shifts that move each parameter by less than this are of no consequence \[standard errors\].
const SHIFT: f64 = 1.0;

/// A shift of the voltage that explains the outputs better.
pub(super) struct LateVoltage {
    /// The time by which the outputs move before the logged voltage \[s\], and its standard error.
    seconds: f64,
    error: Option<f64>,
    periods: f64,
}

/// Tests whether the outputs of a finished fit move before the logged voltage: a dead time from minus one period to zero then
/// explains them better. The course of the voltage between samples is that of the fit.
pub(super) fn late_voltage(prepared: &Prepared<'_>, fit: &Fit) -> Option<LateVoltage> {
    let model = prepared.plain().model();
    let has_delay = fit.space.features().has(Parameter::DeadTime);
    if has_delay || prepared.plain().method().input != Input::Voltage || !model.discretization.is_exact() {
        return None;
    }
    let records = prepared.records;
    // Where a linear motor is driven by a voltage that changes all the time, both courses between samples are compared.
    if prepared.is_linear() && records.len() == 1 && is_lively(&records[0]) {
        return None;
    }
    let period_s = records.iter().map(Record::period_s).fold(0.0, f64::max);
    let (space, place) = with_early_input(prepared, fit, period_s)?;
    let plain = prepared.fitted(&space);
    let sigma = &fit.refined.weights;
    let weighted = Arc::new(plain.clone().starting_from(&fit.refined.initial).weighted_by(sigma));
    let there = carried(&weighted, (&fit.space, &fit.refined.values));
    let before = Scalar::cost(&weighted, &there);
    let (after, moved) = descended(&weighted, there, &[place], 1).ok()?;
    // Costs are roots of sums of squares in units of σ².
    if moved[place] >= 0.0 || before * before - after * after < FALL {
        return None;
    }
    let refined = best_start(&plain, &[moved], sigma)?;
    let [seconds, error] = [-refined.values[place], refined.uncertainty.std_error[place].unwrap_or(f64::NAN)];
    // Correlated residuals count for less; under either weights the fit must be better.
    let fall = |by: &Refined| fit.refined.weighted(&by.weights) - refined.weighted(&by.weights);
    let (independent, _) = effective(&plain, &refined);
    let is_shown = independent * fall(&fit.refined).min(fall(&refined)) > STATISTIC && seconds > 0.0;
    let moves = |(value, error): (&f64, &Option<f64>), new: f64| error.is_some_and(|e| (value - new).abs() > SHIFT * e);
    let errors = fit.refined.values.iter().zip(&fit.refined.uncertainty.std_error);
    let is_of_consequence = errors.zip(&refined.values).any(|(one, new)| moves(one, *new));
    let error = error.is_finite().then_some(error);
    (is_shown && is_of_consequence).then_some(LateVoltage { seconds, error, periods: seconds / period_s })
}

/// Returns the space of a fit with a dead time between minus one period and zero, and its place in it.
fn with_early_input(prepared: &Prepared<'_>, fit: &Fit, period_s: f64) -> Option<(Space, usize)> {
    let motor = Parameter::ALL.map(|p| fit.refined.parameters.get(p));
    let list = [Extension::DeadTime];
    let space = extended_space(prepared.records, &prepared.spec, &fit.space, (&list, &motor)).ok()?;
    let place = space.free().iter().position(|axis| axis.parameter == Parameter::DeadTime)?;
    let mut free: Vec<Axis> = space.free().to_vec();
    (free[place].min, free[place].max) = (-period_s, 0.0);
    Some((Space::new(free, space.fixed().to_vec()).ok()?, place))
}

impl LateVoltage {
    /// Returns it as a warning about a fit with some extensions, which `auto` has selected where that `is_selected`.
    pub(super) fn warning(&self, with: &[Extension], is_selected: bool) -> Warning {
        let error = self.error.map_or(String::new(), |error| format!(" ± {}", significant(1e3 * error, 2)));
        let (shown, periods) = (significant(1e3 * self.seconds, 3), significant(self.periods, 2));
        let message = format!(
            "the motor moves {shown}{error} ms, {periods} of a period, before the recorded voltage changes: the voltage is logged late"
        );
        let all: Vec<&str> = with.iter().chain([&Extension::DeadTime]).map(|e| e.name()).collect();
        let named = text!("Use " [With = "{}", all.join(",")] ", which may be negative");
        let remedy = if is_selected { named.and(".") } else { named.and(text!(", or " [With = "auto"] ".")) };
        Warning {
            remedy: Some(remedy),
            place: Some(Place { quantity: Some(Quantity::Voltage), ..Place::default() }),
            ..Warning::new("late_voltage", message)
        }
    }
}
