//! Validation: how well parameters explain recordings that they were not fitted to.

use super::fit_metrics::FitMetrics;
use super::fitted::FittedMotor;
use super::residuals::{ResidualTests, moved, residual_tests};
use crate::criterion::Criterion;
use crate::estimate::{best_start, explained, fit_problem, initial_states, signal_deviations};
use crate::evaluate::{Model, Problem};
use crate::motor::{Axis, Input, Parameter, Scope, Space};
use crate::record::{Quantity, Record};
use crate::setting::text;
use crate::{Error, Result, channels};
use serde::{Serialize, Serializer};
use std::sync::Arc;

/// A recording that was held out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeldOut {
    /// The recording.
    pub record: Record,
    /// 100 (1 − ‖y − ŷ‖/‖y − mean y‖) of current and speed; `None` for a channel not measured.
    #[serde(serialize_with = "channels::by_name")]
    pub fit_percent: [Option<f64>; 2],
    /// Standard deviation of the residuals of both.
    #[serde(serialize_with = "channels::by_name")]
    pub residual_sigma: [Option<f64>; 2],
    /// The residuals of both, tested.
    #[serde(rename = "residuals", serialize_with = "channels::by_name")]
    pub residual_tests: ResidualTests,
    /// The state `[i, ω]` at its start.
    #[serde(rename = "initial_state", serialize_with = "channels::by_name")]
    pub initial: [f64; 2],
    /// True if that was estimated from the recording.
    #[serde(rename = "initial_state_estimated")]
    pub initial_is_estimated: bool,
    /// Parameters that each recording has for itself, estimated from this one: what else is, is its initial state.
    #[serde(rename = "estimated", serialize_with = "by_symbol")]
    pub own: Vec<(Parameter, f64)>,
    /// Simulated current and speed, one value a sample.
    #[serde(skip)]
    pub simulated: [Vec<f64>; 2],
}

/// The fit of parameters on held-out recordings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Validation {
    /// The fit over all of them. Where they hardly move there is little to explain, and the residuals tell more.
    #[serde(serialize_with = "channels::by_name")]
    pub fit_percent: [Option<f64>; 2],
    /// Standard deviation of the residuals over all of them.
    #[serde(serialize_with = "channels::by_name")]
    pub residual_sigma: [Option<f64>; 2],
    /// One by one.
    #[serde(rename = "records")]
    pub held_out: Vec<HeldOut>,
}

fn by_symbol<S: Serializer>(values: &[(Parameter, f64)], serializer: S) -> std::result::Result<S::Ok, S::Error> {
    serializer.collect_map(values.iter().map(|(parameter, value)| (parameter.symbol(), value)))
}

/// The first parts of recordings, which are fitted; the rest is added to what is held out.
///
/// # Errors
/// As [`Record::split`].
pub fn split(records: Vec<Record>, fraction: f64, held_out: &mut Vec<Record>) -> Result<Vec<Record>> {
    let mut first = Vec::with_capacity(records.len());
    for record in records {
        let [fitted, rest] = record.split(fraction)?;
        first.push(fitted);
        held_out.push(rest);
    }
    Ok(first)
}

/// Validates a fitted motor, as [`crate::identify::validate`] has it.
pub(crate) fn validate(
    records: &[Record],
    found: &FittedMotor<'_>,
    model: Model,
    criterion: Criterion,
) -> Result<Validation> {
    let mut held_out = Vec::with_capacity(records.len());
    let mut sums = FitMetrics::default();
    let moved = moved(found);
    for record in records {
        check_input(record, found)?;
        let (problem, values, own) = settle(record, found, model, criterion)?;
        let alone = std::slice::from_ref(record);
        let one = FitMetrics::of(alone, &problem, &values);
        sums = sums.and(one);
        let signals = &problem.signals()[0];
        held_out.push(HeldOut {
            record: record.clone(),
            initial: signals.initial,
            initial_is_estimated: signals.initial_is_free,
            own,
            simulated: problem.simulate(&values, 0, signals.initial),
            fit_percent: one.fit_percent(),
            residual_sigma: one.residual_sigma(),
            residual_tests: residual_tests(alone, &problem, &values, &moved)[0],
        });
    }
    Ok(Validation { held_out, fit_percent: sums.fit_percent(), residual_sigma: sums.residual_sigma() })
}

/// A motor that was found without a voltage says nothing of one, nor the other way round.
fn check_input(record: &Record, found: &FittedMotor<'_>) -> Result<()> {
    if (record.driver() == Quantity::Current) == (found.input == Input::Current) {
        return Ok(());
    }
    let (message, remedy) = match found.input {
        Input::Current => (
            "has a voltage, but the motor was fitted to recordings without one, whose input is the current",
            text!("Leave its voltage out (" [Columns = "voltage=-"] "), or fit recordings with a voltage."),
        ),
        Input::Voltage => (
            "has no voltage, but the motor was fitted to recordings with one",
            text!("Hold out recordings with a voltage, or fit all without it (" [Columns = "voltage=-"] ")."),
        ),
    };
    Err(record.source().path.iter().fold(Error::data(message, remedy), |error, path| error.in_file(path)))
}

/// A problem, the values of its candidate, and parameters with their values.
type Settled = (Problem, Vec<f64>, Vec<(Parameter, f64)>);

/// Returns the problem of one recording from its own initial state, with the shared parameters free, their values, and the
/// parameters of this recording alone.
fn settle(record: &Record, found: &FittedMotor<'_>, model: Model, criterion: Criterion) -> Result<Settled> {
    let alone = std::slice::from_ref(record);
    let (mut free, mut values, mut own): (Vec<Axis>, Vec<f64>, Vec<Axis>) = Default::default();
    for (axis, value) in found.space.free().iter().zip(found.values) {
        if axis.scope == Scope::Shared {
            free.push(*axis);
            values.push(*value);
        } else if own.iter().all(|known| known.parameter != axis.parameter) {
            own.push(Axis { scope: Scope::Shared, ..*axis });
        }
    }
    let held = found.space.fixed().iter().filter(|(_, scope, _)| *scope == Scope::Shared);
    let mut fixed: Vec<(Parameter, Scope, f64)> = held.copied().collect();
    let mut estimated = Vec::new();
    let mut initial = None;
    if !own.is_empty() {
        let known = free.iter().zip(&values).map(|(axis, value)| (axis.parameter, Scope::Shared, *value));
        let space = Space::new(own.clone(), fixed.iter().copied().chain(known).collect())?;
        let plain = fit_problem(alone, &space, model)?;
        let problem = Arc::new(Problem::new(alone, model, space, criterion)?);
        let starts = explained(&problem, &[found.parameters.to_array()])?;
        let settled = best_start(&plain, &starts, &signal_deviations(alone));
        initial = settled.as_ref().map(|settled| settled.initial.clone());
        let of_own = settled.map(|settled| settled.values).or_else(|| starts.into_iter().next()).unwrap_or_default();
        estimated = own.iter().map(|axis| axis.parameter).zip(of_own).collect();
        fixed.extend(estimated.iter().map(|(parameter, value)| (*parameter, Scope::Shared, *value)));
    }
    let problem = fit_problem(alone, &Space::unchecked(free, fixed), model)?;
    let initial = match initial {
        Some(initial) => initial,
        None => {
            let sigma = found.residual_sigma.map(|sigma| sigma.filter(|s| *s > 0.0).unwrap_or(1.0));
            initial_states(&problem, &values, sigma)?
        }
    };
    Ok((problem.starting_from(&initial), values, estimated))
}
