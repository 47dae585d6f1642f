//! Detection of the intersample behaviour of the input by likelihood.
//!
//! A voltage that a drive sets at each sample has a zero-order hold; a continuous voltage that a sensor samples is better
//! described by a first-order hold. Confusing the two shifts the input by half a period. Both are fitted, and the likelihoods
//! of the outputs are compared.

use super::fitted::FittedMotor;
use super::recording::warnings_of_records;
use super::speed_guess::guess_by_speed;
use motorfit_core::Result;
use motorfit_core::numeric;
use motorfit_core::setting::text;
use motorfit_core::text::{engineering, significant};
use motorfit_estimate::{RefineOptions, Refined, refine};
use motorfit_evaluate::{Initial, Model};
use motorfit_motor::{Axis, Discretization, Input, Parameter, Scope, Space};
use motorfit_record::warning::{Location, Warning};
use motorfit_record::{Quantity, Record};

/// An intersample behaviour that fits better than the assumed one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intersample {
    /// Discretization that fits better.
    pub better: Discretization,
    /// Log-likelihood ratio of the better discretization to the assumed one, at the effective sample size.
    pub log_likelihood: f64,
    /// Smallest ratio, over the channels, of the residual deviation under the better discretization to that under the assumed
    /// one.
    pub sigma_ratio: f64,
}

/// Smallest ratio of samples at which the input changes. Below it, the two holds differ by little more than a delay of half a
/// period, which a dead time absorbs.
const LIVELY: f64 = 0.3;
/// Smallest log-likelihood ratio, at the effective sample size, at which a difference is reported.
const LOG_LIKELIHOOD: f64 = 5.0;

/// Returns true if the input changes at enough samples for its intersample behaviour to be detected, and was not resampled.
pub(crate) fn is_lively(record: &Record) -> bool {
    let voltage = record.input();
    let changes = voltage.windows(2).filter(|v| v[0].to_bits() != v[1].to_bits()).count();
    let part = numeric::count(changes) / numeric::count(voltage.len());
    part > LIVELY && record.slope().is_empty()
}

/// Returns the alternative intersample behaviour: first-order hold for zero-order hold and the reverse; `None` for others.
fn other(method: Discretization) -> Option<Discretization> {
    match method {
        Discretization::Zoh => Some(Discretization::Foh),
        Discretization::Foh => Some(Discretization::Zoh),
        _ => None,
    }
}

/// Compares the fits under the assumed and the alternative intersample behaviour; `None` if the alternative is not better.
fn compared(here: &Refined, there: &Refined, better: Discretization, count: usize) -> Option<Intersample> {
    let count = numeric::count(count) / there.uncertainty.variance_inflation();
    let (mut log_likelihood, mut sigma_ratio) = (0.0, f64::INFINITY);
    for (here, there) in here.sigma.iter().zip(&there.sigma) {
        let (Some(here), Some(there)) = (here, there) else { continue };
        log_likelihood += count * (here / there).ln();
        sigma_ratio = f64::min(sigma_ratio, there / here);
    }
    let is_better = log_likelihood > LOG_LIKELIHOOD && sigma_ratio < 1.0;
    is_better.then_some(Intersample { better, log_likelihood, sigma_ratio })
}

/// Tests whether another intersample behaviour of the voltage than `method` fits a recording better. The model is the linear
/// motor with all five parameters, started at `start`, or without a start the normalized model of the speed alone. Returns
/// `None` if `method` fits as well, or if the recording does not allow the test.
///
/// # Errors
/// Propagates the errors of the refinement and of the initial estimate from the speed.
pub fn detect_intersample(
    record: &Record,
    start: Option<&[f64; 5]>,
    method: Discretization,
) -> Result<Option<Intersample>> {
    let by_voltage = record.driver() == Quantity::Voltage;
    let Some(better) = other(method).filter(|_| by_voltage && is_lively(record)) else { return Ok(None) };
    let alone = (start.is_none() && record.measured()[1].is_some()).then(|| record.without_current());
    let record = alone.as_ref().unwrap_or(record);
    let records = std::slice::from_ref(record);
    let options =
        |discretization| RefineOptions { model: Model { discretization, initial: Initial::Auto }, sigma: None };
    let (space, start) = match (start, record.measured()) {
        (Some(start), _) => {
            let free = Parameter::ALL.into_iter().zip(start).map(|(p, value)| axis(p, *value, [1e-2, 1e2]));
            (Space::new(free.collect(), Vec::new())?, start.to_vec())
        }
        (None, [None, Some(_)]) => by_speed(record)?,
        _ => return Ok(None),
    };
    let here = refine(records, &space, &start, &options(method))?;
    let there = refine(records, &space, &here.values, &options(better))?;
    Ok(compared(&here, &there, better, record.len()))
}

/// Returns the axis of a parameter between two multiples of a value.
fn axis(parameter: Parameter, value: f64, [low, high]: [f64; 2]) -> Axis {
    Axis { parameter, scope: Scope::Shared, min: low * value, max: high * value }
}

/// Returns the normalized model of speed alone with initial values. With R = 1 Ω and negligible friction the gain is 1/K and
/// the time constants are J/K² and L/R.
fn by_speed(record: &Record) -> Result<(Space, Vec<f64>)> {
    let start = guess_by_speed(record)?;
    let [_, k, _] = start;
    let fixed = vec![(Parameter::R, Scope::Shared, 1.0), (Parameter::B, Scope::Shared, 1e-6 * k * k)];
    let free = [Parameter::L, Parameter::K, Parameter::J].into_iter().zip(start).map(|(p, v)| axis(p, v, [1e-3, 1e3]));
    Ok((Space::new(free.collect(), fixed)?, start.to_vec()))
}

impl Intersample {
    /// Returns the warning about the input `driver`, with the better discretization as the remedy.
    #[must_use]
    pub fn warning(&self, driver: Quantity) -> Warning {
        let (what, follows) = match self.better {
            Discretization::Foh => ("as with a first-order hold between samples", "foh"),
            _ => ("as with a zero-order hold between samples", "zoh"),
        };
        let smaller = significant(100.0 * (1.0 - self.sigma_ratio), 2);
        Warning {
            remedy: Some(text!("Use " [Discretization = "{follows}"] ".")),
            place: Some(Location { quantity: Some(driver), ..Location::default() }),
            ..Warning::new(
                "between_samples",
                format!("the motor follows the {driver} {what}: residuals are {smaller} % smaller"),
            )
        }
    }
}

/// Returns possible reasons for a failed identification: findings about the recordings, and a wrong intersample behaviour.
#[must_use]
pub fn suspicions(records: &[Record], method: Discretization) -> Vec<Warning> {
    let mut warnings = warnings_of_records(records);
    let between = |record: &Record| detect_intersample(record, None, method).ok().flatten();
    warnings.extend(records.iter().find_map(between).map(|between| between.warning(Quantity::Voltage)));
    warnings
}

/// Largest ratio of the period to the fastest time constant for a decimated recording, whose voltage has a slope over each
/// period. At this ratio the bias was one standard error, on the M2 motor and on one six times as fast.
const COARSE_LINES: f64 = 0.7;
/// Largest ratio of the period to the fastest time constant for an interpolated recording, at the same bias.
const COARSE_BETWEEN: f64 = 0.2;

/// Returns the warning about a resampled recording whose rate is too low for the fastest time constant of the motor.
pub(crate) fn coarse_rate(records: &[Record], found: &FittedMotor<'_>) -> Option<Warning> {
    let [r, l, k, b, j] = found.parameters.to_array();
    let (sum, product) = (r / l + b / j, (r * b + k * k) / (l * j));
    let root = (sum * sum / 4.0 - product).max(0.0).sqrt();
    let fastest = match found.input {
        Input::Current => j / b,
        Input::Voltage if root > 0.0 => 1.0 / (sum / 2.0 + root),
        Input::Voltage => 1.0 / product.sqrt(),
    };
    let limit = |record: &Record| if record.is_interpolated() { COARSE_BETWEEN } else { COARSE_LINES };
    let record = records.iter().find(|r| !r.slope().is_empty() && r.period_s() > limit(r) * fastest)?;
    let what = if record.is_interpolated() { "the interpolated values" } else { "the input within a period" };
    let [period, fastest] = [record.period_s(), fastest].map(|seconds| engineering(seconds, "s", 3));
    let message = text!(
        "{period} between samples is long compared with the fastest time constant, {fastest}: the bias from {what} exceeds "
        "the standard errors of the parameters; give a higher " [Rate] ", decimate less, or leave both out"
    );
    Some(Warning::new("coarse_rate", message))
}

/// Returns the warning about a result whose voltage has another intersample behaviour than the model.
pub(crate) fn intersample_of_voltage(records: &[Record], model: Model, found: &FittedMotor<'_>) -> Option<Warning> {
    let [record] = records else { return None };
    found.uncertainty?;
    let all_free = found.space.fixed().is_empty();
    let start = found.parameters.to_array();
    let between = detect_intersample(record, all_free.then_some(&start), model.discretization);
    between.ok().flatten().map(|between| between.warning(Quantity::Voltage))
}

/// Returns the warning about a result whose input current has another intersample behaviour than the model.
pub(crate) fn intersample_of_current(records: &[Record], model: Model, found: &FittedMotor<'_>) -> Option<Warning> {
    let [record] = records else { return None };
    let applies = found.input == Input::Current && found.uncertainty.is_some() && is_lively(record);
    let method = model.discretization;
    let better = other(method).filter(|_| applies)?;
    let refined = |discretization| {
        let options = RefineOptions { model: Model { discretization, ..model }, sigma: None };
        refine(records, found.space, found.values, &options).ok()
    };
    let between = compared(&refined(method)?, &refined(better)?, better, record.len())?;
    Some(between.warning(Quantity::Current))
}
