//! Test for a voltage that is recorded late, so that the outputs move before it changes. A logger that is not synchronized with
//! the drive records a change up to one sampling period late. If this is ignored, the relative error of the inertia is up to
//! the period divided by the time constant.

use super::bic::effective;
use super::extension_bounds::extended_space;
use super::prepare::Prepared;
use super::refine::Fit;
use crate::analysis::is_lively;
use motorfit_core::setting::text;
use motorfit_core::text::significant;
use motorfit_estimate::{Refined, best_start, coordinate_search, transferred};
use motorfit_evaluate::Scalar;
use motorfit_motor::{Axis, Extension, Input, Parameter, Space};
use motorfit_record::warning::{Location, Warning};
use motorfit_record::{Quantity, Record};
use std::sync::Arc;

/// Threshold of the decrease of the sum of squares in units of σ²: χ² with one degree of freedom exceeds it with a one-sided
/// probability of 1e-3.
const STATISTIC: f64 = 9.5;
/// Smallest decrease with the other parameters fixed at which the refinement is worthwhile: even if the others absorb 95 % of
/// the effect of a shift, a significant one decreases the sum of squares by this much.
const DECREASE_MIN: f64 = 0.5;
/// Smallest shift of a parameter at which a late voltage matters \[standard errors\].
const SHIFT: f64 = 1.0;

/// A time shift of the voltage with which the model fits better.
pub(super) struct LateVoltage {
    /// Time by which the outputs lead the recorded voltage \[s\].
    seconds: f64,
    /// Standard error of this time \[s\].
    error: Option<f64>,
    /// Time by which the outputs lead the recorded voltage \[sampling periods\].
    periods: f64,
}

/// Tests whether the outputs of a finished fit lead the recorded voltage, by a fit with a dead time between minus one period
/// and zero. The intersample behaviour of the voltage is that of the fit.
pub(super) fn late_voltage(prepared: &Prepared<'_>, fit: &Fit) -> Option<LateVoltage> {
    let model = prepared.plain().model();
    let has_delay = fit.space.features().has(Parameter::DeadTime);
    if has_delay || prepared.plain().method().input != Input::Voltage || !model.discretization.is_exact() {
        return None;
    }
    let records = prepared.records;
    // For a linear motor under a voltage that changes at most samples the intersample behaviour is tested instead.
    if prepared.is_linear() && records.len() == 1 && is_lively(&records[0]) {
        return None;
    }
    let period_s = records.iter().map(Record::period_s).fold(0.0, f64::max);
    let (space, index) = with_early_input(prepared, fit, period_s)?;
    let plain = prepared.fitted(&space);
    let sigma = &fit.refined.weights;
    let weighted = Arc::new(plain.clone().starting_from(&fit.refined.initial).weighted_by(sigma));
    let there = transferred(&weighted, (&fit.space, &fit.refined.values));
    let before = Scalar::cost(&weighted, &there);
    let (after, moved) = coordinate_search(&weighted, there, &[index], 1).ok()?;
    // A cost is the root of a sum of squares in units of σ².
    if moved[index] >= 0.0 || before * before - after * after < DECREASE_MIN {
        return None;
    }
    let refined = best_start(&plain, &[moved], sigma)?;
    let [seconds, error] = [-refined.values[index], refined.uncertainty.std_error[index].unwrap_or(f64::NAN)];
    // The decrease must be significant under the weights of both fits, at the effective sample size of correlated residuals.
    let decrease = |by: &Refined| fit.refined.weighted(&by.weights) - refined.weighted(&by.weights);
    let (effective_ratio, _) = effective(&plain, &refined);
    let is_shown = effective_ratio * decrease(&fit.refined).min(decrease(&refined)) > STATISTIC && seconds > 0.0;
    let moves = |(value, error): (&f64, &Option<f64>), new: f64| error.is_some_and(|e| (value - new).abs() > SHIFT * e);
    let errors = fit.refined.values.iter().zip(&fit.refined.uncertainty.std_error);
    let is_of_consequence = errors.zip(&refined.values).any(|(one, new)| moves(one, *new));
    let error = error.is_finite().then_some(error);
    (is_shown && is_of_consequence).then_some(LateVoltage { seconds, error, periods: seconds / period_s })
}

/// Returns the space of a fit with a dead time between minus one period and zero, and the index of that axis.
fn with_early_input(prepared: &Prepared<'_>, fit: &Fit, period_s: f64) -> Option<(Space, usize)> {
    let motor = fit.motor();
    let list = [Extension::DeadTime];
    let space = extended_space(prepared.records, &prepared.spec, &fit.space, (&list, &motor)).ok()?;
    let index = space.free().iter().position(|axis| axis.parameter == Parameter::DeadTime)?;
    let mut free: Vec<Axis> = space.free().to_vec();
    (free[index].min, free[index].max) = (-period_s, 0.0);
    Some((Space::new(free, space.fixed().to_vec()).ok()?, index))
}

impl LateVoltage {
    /// Returns the warning for a model with the extensions `with`; `is_selected` is true if the model selection chose them.
    pub(super) fn warning(&self, with: &[Extension], is_selected: bool) -> Warning {
        let error = self.error.map_or(String::new(), |error| format!(" ± {}", significant(1e3 * error, 2)));
        let (shown, periods) = (significant(1e3 * self.seconds, 3), significant(self.periods, 2));
        let message = format!(
            "the motor moves {shown}{error} ms, {periods} of a period, before the recorded voltage changes: the voltage \
             is recorded late"
        );
        let all: Vec<&str> = with.iter().chain([&Extension::DeadTime]).map(|e| e.name()).collect();
        let named = text!("Use " [With = "{}", all.join(",")] ", which may be negative");
        let remedy = if is_selected { named.and(".") } else { named.and(text!(", or " [With = "auto"] ".")) };
        Warning {
            remedy: Some(remedy),
            place: Some(Location { quantity: Some(Quantity::Voltage), ..Location::default() }),
            ..Warning::new("late_voltage", message)
        }
    }
}
