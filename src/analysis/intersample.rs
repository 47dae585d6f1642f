//! Tests whether a voltage is held between samples or was sampled while it went on: what the outputs say.
//!
//! A drive that sets a new voltage at each sample holds it; a voltage that a sensor samples goes on in between. Taking
//! the one for the other shifts the input by half a period. Both are tried, and the likelihood of the outputs tells.

use super::fitted::FittedMotor;
use super::recording::warnings_of_records;
use super::residuals::variance_inflation;
use super::speed_guess::guess_by_speed;
use crate::Result;
use crate::estimate::{RefineOptions, Refined, refine};
use crate::evaluate::{Initial, Model};
use crate::motor::{Axis, Discretization, Input, Parameter, Scope, Space};
use crate::numeric;
use crate::record::{Quantity, Record};
use crate::setting::text;
use crate::text::{engineering, significant};
use crate::warning::{Place, Warning};

/// Between samples, the voltage goes on as this rather than as that which was assumed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intersample {
    /// The discretization that explains the outputs better.
    pub better: Discretization,
    /// The logarithm of how many times likelier they make it.
    pub log_likelihood: f64,
    /// σ of the worst channel's residuals, relative to that of what was assumed.
    pub sigma_ratio: f64,
}

/// Where the voltage changes at fewer samples than this part of them, a line between samples is a delay by half a period, which
/// a dead time stands for as well.
const LIVELY: f64 = 0.3;
/// The gain from which a difference is reported: a factor of e⁵ in likelihood, of residuals that count as far as they are not
/// correlated from sample to sample.
const LOG_LIKELIHOOD: f64 = 5.0;

/// Returns whether the voltage changes at so many samples that its course between them can be seen.
pub(crate) fn is_lively(record: &Record) -> bool {
    let voltage = record.input();
    let changes = voltage.windows(2).filter(|v| v[0].to_bits() != v[1].to_bits()).count();
    let part = numeric::count(changes) / numeric::count(voltage.len());
    part > LIVELY && record.slope().is_empty()
}

/// The other way on, where there is one.
fn other(method: Discretization) -> Option<Discretization> {
    match method {
        Discretization::Zoh => Some(Discretization::Foh),
        Discretization::Foh => Some(Discretization::Zoh),
        _ => None,
    }
}

/// Compares two fits of the same recordings.
fn judged(here: &Refined, there: &Refined, better: Discretization, count: usize) -> Option<Intersample> {
    let count = numeric::count(count) / variance_inflation(&there.uncertainty);
    let (mut log_likelihood, mut sigma_ratio) = (0.0, f64::INFINITY);
    for (here, there) in here.sigma.iter().zip(&there.sigma) {
        let (Some(here), Some(there)) = (here, there) else { continue };
        log_likelihood += count * (here / there).ln();
        sigma_ratio = f64::min(sigma_ratio, there / here);
    }
    let told = log_likelihood > LOG_LIKELIHOOD && sigma_ratio < 1.0;
    told.then_some(Intersample { better, log_likelihood, sigma_ratio })
}

/// Returns whether recordings speak for another course of the voltage between samples than `method`: by all five parameters
/// where current and speed were measured, else by gain and time constant.
///
/// # Errors
/// As a refinement.
pub fn detect_intersample(
    record: &Record,
    start: Option<&[f64; 5]>,
    method: Discretization,
) -> Result<Option<Intersample>> {
    let by_voltage = record.driver() == Quantity::Voltage;
    let Some(better) = other(method).filter(|_| by_voltage && is_lively(record)) else { return Ok(None) };
    let alone = (start.is_none() && record.measured()[1].is_some()).then(|| record.speed_alone());
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
    Ok(judged(&here, &there, better, record.len()))
}

/// The axis between two multiples of a value.
fn axis(parameter: Parameter, value: f64, [low, high]: [f64; 2]) -> Axis {
    Axis { parameter, scope: Scope::Shared, min: low * value, max: high * value }
}

/// Returns the normalized model of speed alone: R = 1 Ω and no friction, so that the gain is 1/K, the time constants J/K² and
/// L/R.
fn by_speed(record: &Record) -> Result<(Space, Vec<f64>)> {
    let start = guess_by_speed(record)?;
    let [_, k, _] = start;
    let fixed = vec![(Parameter::R, Scope::Shared, 1.0), (Parameter::B, Scope::Shared, 1e-6 * k * k)];
    let free = [Parameter::L, Parameter::K, Parameter::J].into_iter().zip(start).map(|(p, v)| axis(p, v, [1e-3, 1e3]));
    Ok((Space::new(free.collect(), fixed)?, start.to_vec()))
}

impl Intersample {
    /// Returns it as a warning about what drives the motor, with the setting that follows it.
    #[must_use]
    pub fn warning(&self, driver: Quantity) -> Warning {
        let (what, follows) = match self.better {
            Discretization::Foh => ("as if it had been sampled while it went on in between", "foh"),
            _ => ("as if it had been held in between", "zoh"),
        };
        let smaller = significant(100.0 * (1.0 - self.sigma_ratio), 2);
        Warning {
            remedy: Some(text!("Use " [Discretization = "{follows}"] ".")),
            place: Some(Place { quantity: Some(driver), ..Place::default() }),
            ..Warning::new(
                "between_samples",
                format!("the motor follows the {driver} {what}: residuals are {smaller} % smaller"),
            )
        }
    }
}

/// Returns possible reasons why recordings give no result: findings, and a voltage that was interpolated wrongly.
#[must_use]
pub fn suspicions(records: &[Record], method: Discretization) -> Vec<Warning> {
    let mut warnings = warnings_of_records(records);
    let between = |record: &Record| detect_intersample(record, None, method).ok().flatten();
    warnings.extend(records.iter().find_map(between).map(|between| between.warning(Quantity::Voltage)));
    warnings
}

/// A period longer than these parts of the fastest time constant is too coarse: for a voltage made of lines over it,
/// and for values between samples. Measured on the M2 motor and one six times as fast: biases of a standard error.
const COARSE_LINES: f64 = 0.7;
const COARSE_BETWEEN: f64 = 0.2;

/// The warning for a recording that was brought to a rate at which the motor's fastest motion is not seen.
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
    let what = if record.is_interpolated() { "what stands between samples" } else { "what the input does within" };
    let [period, fastest] = [record.period_s(), fastest].map(|seconds| engineering(seconds, "s", 3));
    let message = text!(
        "{period} between samples is long against the fastest time constant, {fastest}: {what} is not known well enough, "
        "and the parameters are off by more than their errors; give a higher " [Rate] ", decimate less, or leave both out"
    );
    Some(Warning::new("coarse_rate", message))
}

/// The warning for a result whose voltage was taken to go on otherwise than the outputs say.
pub(crate) fn intersample_of_voltage(records: &[Record], model: Model, found: &FittedMotor<'_>) -> Option<Warning> {
    let [record] = records else { return None };
    found.uncertainty?;
    let all_free = found.space.fixed().is_empty();
    let start = found.parameters.to_array();
    let between = detect_intersample(record, all_free.then_some(&start), model.discretization);
    between.ok().flatten().map(|between| between.warning(Quantity::Voltage))
}

/// The same where the current is the input.
pub(crate) fn intersample_of_current(records: &[Record], model: Model, found: &FittedMotor<'_>) -> Option<Warning> {
    let [record] = records else { return None };
    let applies = found.input == Input::Current && found.uncertainty.is_some() && is_lively(record);
    let method = model.discretization;
    let better = other(method).filter(|_| applies)?;
    let refined = |discretization| {
        let options = RefineOptions { model: Model { discretization, ..model }, sigma: None };
        refine(records, found.space, found.values, &options).ok()
    };
    let between = judged(&refined(method)?, &refined(better)?, better, record.len())?;
    Some(between.warning(Quantity::Current))
}
