//! Validation: the fit of identified parameters on held-out recordings.

use super::fit_metrics::FitMetrics;
use super::fitted::FittedMotor;
use super::output_residuals::ResidualTests;
use super::residuals::{moved, residual_tests};
use motorfit_core::channels;
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_estimate::{best_start, delay_starts, fit_problem, initial_states, signal_deviations};
use motorfit_evaluate::criterion::Criterion;
use motorfit_evaluate::{Model, Problem};
use motorfit_motor::{Axis, Input, Parameter, Scope, Space};
use motorfit_record::{Quantity, Record};
use serde::{Serialize, Serializer};
use std::sync::Arc;

/// The validation on one held-out recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeldOut {
    /// Held-out recording.
    pub record: Record,
    /// Fit `100 (1 − ‖y − ŷ‖/‖y − mean y‖)` of current and speed \[%\]; `None` for a constant or missing channel.
    #[serde(serialize_with = "channels::by_name")]
    pub fit_percent: Vec<Option<f64>>,
    /// Standard deviation of the residuals of current \[A\] and speed \[rad/s\].
    #[serde(serialize_with = "channels::by_name")]
    pub residual_sigma: Vec<Option<f64>>,
    /// Residual tests of current and speed.
    #[serde(rename = "residuals", serialize_with = "channels::by_name")]
    pub residual_tests: ResidualTests,
    /// Initial state `[i, ω]` \[A, rad/s\].
    #[serde(rename = "initial_state", serialize_with = "channels::by_name")]
    pub initial: [f64; 2],
    /// True if the initial state was estimated from the recording.
    #[serde(rename = "initial_state_estimated")]
    pub initial_is_estimated: bool,
    /// Parameters with one value per recording, estimated from this recording.
    #[serde(rename = "estimated", serialize_with = "by_symbol")]
    pub own: Vec<(Parameter, f64)>,
    /// Simulated current \[A\] and speed \[rad/s\], one value per sample.
    #[serde(skip)]
    pub simulated: [Vec<f64>; 2],
}

/// The validation of a result on held-out recordings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Validation {
    /// Fit of current and speed over all recordings \[%\]. It is low if the outputs hardly vary; compare the residuals then.
    #[serde(serialize_with = "channels::by_name")]
    pub fit_percent: Vec<Option<f64>>,
    /// Standard deviation of the residuals of current \[A\] and speed \[rad/s\] over all recordings.
    #[serde(serialize_with = "channels::by_name")]
    pub residual_sigma: Vec<Option<f64>>,
    /// Validation on each recording.
    #[serde(rename = "records")]
    pub held_out: Vec<HeldOut>,
}

fn by_symbol<S: Serializer>(values: &[(Parameter, f64)], serializer: S) -> std::result::Result<S::Ok, S::Error> {
    serializer.collect_map(values.iter().map(|(parameter, value)| (parameter.symbol(), value)))
}

/// Splits each recording at a fraction of its samples. Returns the first parts, which are to be fitted, and adds the second
/// parts to `held_out`.
///
/// # Errors
/// Returns the same errors as [`Record::split`].
pub fn split(records: Vec<Record>, fraction: f64, held_out: &mut Vec<Record>) -> Result<Vec<Record>> {
    let mut first = Vec::with_capacity(records.len());
    for record in records {
        let [fitted, rest] = record.split(fraction)?;
        first.push(fitted);
        held_out.push(rest);
    }
    Ok(first)
}

/// Validates a fitted motor on held-out recordings.
///
/// # Errors
/// Returns `Data` for a recording with another input than that of the fit; propagates the errors of [`Problem::new`].
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
        let one = FitMetrics::of(&problem, &values);
        sums = sums.and(one.clone());
        let signals = &problem.signals()[0];
        held_out.push(HeldOut {
            record: record.clone(),
            initial: signals.initial,
            initial_is_estimated: signals.initial_is_free,
            own,
            simulated: problem.simulate(&values, 0, signals.initial),
            fit_percent: one.fit_percent(),
            residual_sigma: one.residual_sigma(),
            residual_tests: residual_tests(alone, &problem, &values, &moved).pop().unwrap_or_default(),
        });
    }
    Ok(Validation { held_out, fit_percent: sums.fit_percent(), residual_sigma: sums.residual_sigma() })
}

/// Checks that a recording has the same input, voltage or current, as the fitted motor.
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

/// A problem, the values of its free parameters, and the estimated parameters of the recording.
type Settled = (Problem, Vec<f64>, Vec<(Parameter, f64)>);

/// Returns the problem of one recording with its initial state, the values of the shared parameters, which are the free ones,
/// and the parameters with one value per recording, estimated from this recording.
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
    let shared = found.space.fixed().iter().filter(|(_, scope, _)| *scope == Scope::Shared);
    let mut fixed: Vec<(Parameter, Scope, f64)> = shared.copied().collect();
    let mut estimated = Vec::new();
    let mut initial = None;
    if !own.is_empty() {
        let known = free.iter().zip(&values).map(|(axis, value)| (axis.parameter, Scope::Shared, *value));
        let space = Space::new(own.clone(), fixed.iter().copied().chain(known).collect())?;
        let plain = fit_problem(alone, &space, model)?;
        let problem = Arc::new(Problem::new(alone, model, space, criterion)?);
        let starts = delay_starts(&problem, &[found.parameters.to_array()])?;
        let settled = best_start(&plain, &starts, &signal_deviations(alone));
        initial = settled.as_ref().map(|settled| vec![settled.state(0)]);
        let of_own = settled.map(|settled| settled.values).or_else(|| starts.into_iter().next()).unwrap_or_default();
        estimated = own.iter().map(|axis| axis.parameter).zip(of_own).collect();
        fixed.extend(estimated.iter().map(|(parameter, value)| (*parameter, Scope::Shared, *value)));
    }
    let problem = fit_problem(alone, &Space::unchecked(free, fixed), model)?;
    let initial = match initial {
        Some(initial) => initial,
        None => {
            let sigma = [0, 1].map(|channel| found.sigma(channel).filter(|s| *s > 0.0).unwrap_or(1.0));
            initial_states(&problem, &values, sigma)?
        }
    };
    Ok((problem.starting_from(&initial), values, estimated))
}
