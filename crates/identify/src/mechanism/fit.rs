//! The output-error fit of a mechanism, and its feedback gains.

use super::checks::{MOVING, checks};
use super::delay::{BIC_MIN, Selected, with_delay};
use super::kind::MechanismKind;
use super::regression::{MechanismRegression, mechanism_regression};
use super::signals::Signals;
use super::unit::PositionUnit;
use crate::ParameterEstimate;
use crate::analysis::{Controller, FeedbackGains, FeedbackWeights, position_feedback, velocity_feedback};
use crate::model::{ModelIdentification, ModelProgress, ModelSpec};
use crate::{TrustLevel, TrustReason};
use motorfit_core::numeric::{extremes, peak, whole};
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_evaluate::model::ModelRecording;
use motorfit_model::{IntegrationMethod, Model};
use motorfit_record::warning::Warning;
use motorfit_record::{Quantity, Record};
use std::ops::ControlFlow;

/// Settings of an identification of a mechanism.
#[derive(Debug, Clone, Copy, Default)]
pub struct MechanismSpec {
    /// Gravity of the mechanism; `None` selects it by a regression.
    pub kind: Option<MechanismKind>,
    /// True if the position is a length, false if it is an angle.
    pub is_linear: bool,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// The result of an identification of a mechanism. Its characteristics are per radian or metre.
#[derive(Debug, Clone)]
pub struct MechanismFit {
    /// Gravity of the mechanism.
    pub kind: MechanismKind,
    /// True if the regression selected the kind.
    pub is_selected: bool,
    /// Unit of the position in the log.
    pub unit: PositionUnit,
    /// Equations of the fit.
    pub model: Model,
    /// Tests as the model takes them.
    pub recordings: Vec<ModelRecording>,
    /// Regressions of the kinds that were considered.
    pub regressions: Vec<MechanismRegression>,
    /// Settings of the fit.
    pub spec: ModelSpec,
    /// Result of the fit; warnings about the tests are among its warnings and the reasons of its trust.
    pub found: ModelIdentification,
    /// True for each recording that was fitted; one in which nothing moves is not.
    pub is_fitted: Vec<bool>,
    /// Decrease of the Bayesian information criterion by a delay; the delay is 0 unless it is above [`BIC_MIN`].
    pub delay_gain: f64,
}

/// Longest delay that is considered \[s\]; the slowest known filter of a motor controller has 0.112 s.
const DELAY_MAX: f64 = 0.15;
/// Largest voltage against friction, relative to the peak voltage: a mechanism that moves has less.
const FRICTION_MAX: f64 = 0.9;
/// Smallest voltage against gravity that selects a kind with gravity, relative to the peak voltage: a smaller one may be friction that
/// differs between the directions.
const GRAVITY_MIN: f64 = 0.02;
/// Longest substep of a search on an irregular clock, relative to the time constant of the regression, and the largest number of them;
/// the refinement halves them until the estimates do not depend on them.
const STIFFNESS_OF_STEP: f64 = 0.7;
const SUBSTEPS_MAX: usize = 8;

/// Gains with their standard errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Feedback {
    /// Gains in the units of the controller, per unit of position of the log.
    pub gains: FeedbackGains,
    /// Standard errors of kP and kD by the delta method; `None` if those of kV or kA are unknown.
    pub std_error: [Option<f64>; 2],
}

impl MechanismFit {
    /// Returns the recordings that were fitted, of those that were given.
    #[must_use]
    pub fn fitted(&self, records: &[Record]) -> Vec<Record> {
        let is_fitted = |n: usize| self.is_fitted.get(n).copied().unwrap_or(true);
        records.iter().enumerate().filter(|(n, _)| is_fitted(*n)).map(|(_, record)| record.clone()).collect()
    }

    /// Returns the estimate of a parameter of the model, per radian or metre.
    #[must_use]
    pub fn estimate(&self, name: &str) -> Option<&ParameterEstimate> {
        self.found.estimates.iter().find(|estimate| estimate.name == name)
    }

    /// Returns value, standard error and 95 % confidence interval of a characteristic per unit of position of the log.
    #[must_use]
    pub fn in_unit(&self, name: &str) -> Option<(f64, Option<f64>, Option<[f64; 2]>)> {
        let estimate = self.estimate(name)?;
        let factor = match name {
            "kV" | "kA" => self.unit.factor,
            "offset" => 1.0 / self.unit.factor,
            _ => 1.0,
        };
        let scaled = |value: f64| value * factor;
        Some((scaled(estimate.value?), estimate.std_error.map(scaled), estimate.ci95.map(|ci| ci.map(scaled))))
    }

    /// Returns the gains of a velocity (`is_position` false) or position regulator; `None` if kV or kA is not identifiable, or there is
    /// no regulator.
    #[must_use]
    pub fn feedback(&self, is_position: bool, weights: &FeedbackWeights, controller: &Controller) -> Option<Feedback> {
        let [(kv, kv_error, _), (ka, ka_error, _)] = [self.in_unit("kV")?, self.in_unit("kA")?];
        let of = |kv: f64, ka: f64| match is_position {
            true => position_feedback([kv, ka], weights, controller),
            false => velocity_feedback([kv, ka], weights, controller),
        };
        let gains = of(kv, ka)?;
        /// Relative step of the derivatives.
        const STEP: f64 = 1e-4;
        let slope = |by: [f64; 2]| {
            let [above, below] = [STEP, -STEP].map(|step| of(kv * (1.0 + step * by[0]), ka * (1.0 + step * by[1])));
            let width = 2.0 * STEP * (kv * by[0] + ka * by[1]);
            let (above, below) = above.zip(below)?;
            Some([(above.kp - below.kp) / width, (above.kd - below.kd) / width])
        };
        let error = |n: usize| {
            let [by_kv, by_ka] = [slope([1.0, 0.0])?[n], slope([0.0, 1.0])?[n]];
            let (kv, ka) = (by_kv * kv_error?, by_ka * ka_error?);
            let variance = kv * kv + ka * ka + 2.0 * kv * ka * self.correlation("kV", "kA")?;
            Some(variance.max(0.0).sqrt()).filter(|error| error.is_finite())
        };
        Some(Feedback { gains, std_error: [error(0), error(1)] })
    }

    /// Returns the correlation of the estimates of two parameters.
    fn correlation(&self, a: &str, b: &str) -> Option<f64> {
        let at = |name: &str| {
            let is = |axis: &motorfit_evaluate::model::ModelAxis| {
                self.model.parameters().get(axis.parameter).is_some_and(|parameter| parameter.name == name)
            };
            self.found.space.free.iter().position(is)
        };
        *self.found.uncertainty.as_ref()?.correlation.get(at(a)?)?.get(at(b)?)?
    }
}

/// Identifies a mechanism from recordings that were read with [`mechanism_signals`](super::mechanism_signals); `observe` may end the
/// search.
///
/// # Errors
/// Returns `Data` if voltage or velocity is missing, nothing moves, or a sensor is reversed; `NotIdentified` if too few samples move;
/// and the errors of [`identify_model`](crate::model::identify_model).
pub fn identify_mechanism(
    records: &[Record],
    spec: &MechanismSpec,
    observe: &mut dyn FnMut(ModelProgress) -> ControlFlow<()>,
) -> Result<MechanismFit> {
    let at_slowest = |record: &Record| record.at_slowest_output().map_or_else(|| record.clone(), |(slow, _)| slow);
    let slow: Vec<Record> = records.iter().map(at_slowest).collect();
    let (mut warnings, is_fitted) = checks(&slow)?;
    // A test in which nothing moves, of a motor that was off, has no part in the fit.
    let fitted = |all: &[Record]| -> Vec<Record> {
        all.iter().zip(&is_fitted).filter(|(_, is_fitted)| **is_fitted).map(|(record, _)| record.clone()).collect()
    };
    let (records, slow) = (&fitted(records)[..], fitted(&slow));
    warnings.extend(assumed_unit(records));
    let has_one_direction = warnings.iter().any(|warning| warning.code == "one_direction");
    let regressions = considered(&slow, spec, has_one_direction)?;
    let chosen = chosen(&regressions, peak_voltage(records));
    let kind = chosen.kind;
    let model = kind.model(spec.is_linear)?;
    let trimmed = if kind.has_gravity() { moving_parts(records) } else { records.to_vec() };
    let records = trimmed.as_slice();
    // Of assumed units that of the velocity has a warning of its own; voltages of robots are in volts.
    let taken = |record: &Record| Ok(ModelRecording { assumed: None, ..ModelRecording::new(&model, record)? });
    let recordings: Vec<ModelRecording> = records.iter().map(taken).collect::<Result<_>>()?;
    let settings = model_spec(&chosen, records, spec.seed);
    let period = records.iter().map(Record::period_s).fold(0.0, f64::max);
    let Selected { mut found, spec: fitted, recordings, gain } =
        with_delay(&model, recordings, (&settings, period), observe)?;
    advise(&mut found);
    add(&mut found, warnings);
    let unit = PositionUnit::of_velocity(velocity_unit(records), spec.is_linear);
    let is_selected = spec.kind.is_none();
    Ok(MechanismFit {
        kind,
        is_selected,
        unit,
        model,
        recordings,
        regressions,
        spec: fitted,
        found,
        is_fitted,
        delay_gain: gain,
    })
}

/// Returns the parts of recordings from the first to the last sample that moves: before and after, a stop may hold the weight.
fn moving_parts(records: &[Record]) -> Vec<Record> {
    /// Smallest number of samples of a part.
    const SAMPLES_MIN: usize = 20;
    let peaks = records.iter().filter_map(Signals::of).map(|test| peak(test.velocity));
    let threshold = MOVING * peaks.fold(0.0, f64::max);
    let part = |record: &Record| {
        let velocity = Signals::of(record)?.velocity;
        let moves = |value: &f64| value.abs() > threshold;
        let (first, last) = (velocity.iter().position(moves)?, velocity.iter().rposition(moves)?);
        (last - first >= SAMPLES_MIN).then(|| record.slice(first..last + 1).ok())?
    };
    records.iter().map(|record| part(record).unwrap_or_else(|| record.clone())).collect()
}

/// Returns a warning if no unit of the velocity is given.
fn assumed_unit(records: &[Record]) -> Option<Warning> {
    let columns = records.iter().flat_map(|record| &record.source().columns);
    let velocity = columns.into_iter().find(|column| column.quantity == Quantity::Signal(1))?;
    if velocity.unit_named {
        return None;
    }
    let message = format!("{} has no unit and is taken in {}", velocity.heading, velocity.unit);
    let remedy = text!("Name its unit: " [Columns = "speed=\"{}\":rpm", velocity.heading] ".");
    Some(Warning { remedy: Some(remedy), ..Warning::new("unit_assumed", message) })
}

/// Returns the unit of the velocity in the log.
fn velocity_unit(records: &[Record]) -> &str {
    let columns = records.iter().flat_map(|record| &record.source().columns);
    columns.into_iter().find(|column| column.quantity == Quantity::Signal(1)).map_or("", |column| &column.unit)
}

/// Returns the regressions of the kinds that the spec and the recordings allow.
fn considered(records: &[Record], spec: &MechanismSpec, has_one_direction: bool) -> Result<Vec<MechanismRegression>> {
    let is_allowed = |kind: MechanismKind| match (spec.kind, kind) {
        (Some(given), kind) => given == kind,
        // Friction in one direction looks like a weight.
        (None, MechanismKind::Elevator) => !has_one_direction,
        (None, MechanismKind::Arm) => !spec.is_linear && !has_one_direction && is_arm(records),
        (None, MechanismKind::Simple) => true,
    };
    let kinds = MechanismKind::ALL.into_iter().filter(|kind| is_allowed(*kind));
    let found: Vec<MechanismRegression> = kinds.filter_map(|kind| mechanism_regression(records, kind)).collect();
    if found.is_empty() {
        let (message, hint) = match spec.kind {
            Some(MechanismKind::Arm) if !has_position(records) => (
                "the arm has no position, on which its gravity depends",
                text!("Log the position, or name its column: " [Columns = "position=HEADING:UNIT"] "."),
            ),
            _ => (
                "too few samples move to identify the mechanism, or they do not vary",
                "Let each test run until the mechanism has moved for a second or more.".into(),
            ),
        };
        return Err(Error::not_identified(message, hint));
    }
    Ok(found)
}

fn has_position(records: &[Record]) -> bool {
    records.iter().all(|record| record.samples().named.iter().any(|signal| signal.number == 2))
}

/// Returns true if the recordings have a position that stays within one turn.
fn is_arm(records: &[Record]) -> bool {
    let within = |record: &Record| {
        let position = record.samples().named.iter().find(|signal| signal.number == 2);
        position.is_some_and(|position| {
            let [low, high] = extremes(&position.values);
            high - low < std::f64::consts::TAU
        })
    };
    !records.is_empty() && records.iter().all(within)
}

/// Returns the regression with the lowest criterion; one with gravity only if the evidence for it is very strong.
fn chosen(regressions: &[MechanismRegression], volts: f64) -> MechanismRegression {
    let score = |of: &MechanismRegression| match of.kind.has_gravity() {
        true if of.kg.abs() < GRAVITY_MIN * volts => f64::INFINITY,
        true => of.bic + BIC_MIN,
        false => of.bic,
    };
    let mut best = regressions[0];
    for other in &regressions[1..] {
        if score(other) < score(&best) {
            best = *other;
        }
    }
    best
}

/// Returns the largest voltage of the tests \[V\].
fn peak_voltage(records: &[Record]) -> f64 {
    let voltages = records.iter().flat_map(|record| record.samples().named.iter().filter(|of| of.number == 0));
    voltages.flat_map(|signal| &signal.values).fold(0.0, |most: f64, volts| most.max(volts.abs()))
}

/// Replaces the next step of a result with a model by one that the tests of a mechanism allow.
fn advise(found: &mut ModelIdentification) {
    let Some(reason) = found.trust.reasons.first() else { return };
    let next = match reason.code {
        "at_bound" => {
            "Check the units and that voltage and velocity are of one motor; repeat the tests with a larger voltage."
        }
        "not_accurate" => "Log voltage, velocity and position in shorter periods.",
        "outliers" => "Look at the samples far from the model, and leave them out.",
        "few_samples" => "Let each test run longer, or log in shorter periods.",
        "not_identifiable" => "Run all four tests, each until the mechanism moves fast.",
        _ => {
            "Check that the voltage is that of this motor, that its wheels do not slip, and that no current limit acts."
        }
    };
    found.trust.next = Some(next.into());
}

/// Returns bounds and start of the fit.
fn model_spec(from: &MechanismRegression, records: &[Record], seed: u64) -> ModelSpec {
    let volts = peak_voltage(records);
    let period = records.iter().map(Record::period_s).fold(0.0, f64::max);
    let kv = from.kv.abs().max(1e-6);
    // Noise lowers the acceleration's share; a short time constant is not above zero by regression.
    let ka = from.ka.max(0.05 * period * kv);
    let delay = DELAY_MAX;
    let of = |name: &str, range: [f64; 2]| (name.to_owned(), range);
    let mut bounds = vec![
        of("kS", [0.0, FRICTION_MAX * volts.max(1e-3)]),
        of("kV", [kv / 20.0, kv * 20.0]),
        of("kA", [ka / 50.0, ka * 50.0]),
        of("td", [0.0, delay]),
    ];
    let mut start = vec![
        ("kS".to_owned(), from.ks.clamp(0.0, FRICTION_MAX * volts)),
        ("kV".to_owned(), kv),
        ("kA".to_owned(), ka),
        ("td".to_owned(), 0.1 * delay),
    ];
    match from.kind {
        MechanismKind::Simple => {}
        MechanismKind::Elevator => {
            bounds.push(of("kG", [-volts, volts]));
            start.push(("kG".to_owned(), from.kg.clamp(-volts, volts)));
        }
        MechanismKind::Arm => {
            bounds.push(of("kG", [0.0, volts]));
            start.push(("kG".to_owned(), from.kg.clamp(0.0, volts)));
            start.push(("offset".to_owned(), from.offset));
        }
    }
    // The bounds include time constants far shorter than that of the regression, for which a search would take many substeps.
    let longest = records.iter().flat_map(|record| &record.steps().step_s).fold(0.0, |most: f64, step| most.max(*step));
    let substeps = whole((longest * kv / ka / STIFFNESS_OF_STEP).ceil()).clamp(1, SUBSTEPS_MAX);
    let is_even = records.iter().all(|record| record.steps().step_index.is_empty());
    let integration = (!is_even).then_some((IntegrationMethod::RungeKutta, substeps));
    ModelSpec { bounds, starts: vec![start], seed, integration, ..ModelSpec::default() }
}

/// Adds warnings about the tests to a result, and the reasons that they are against its trust.
fn add(found: &mut ModelIdentification, warnings: Vec<Warning>) {
    for warning in &warnings {
        let level = if warning.code == "units_disagree" { TrustLevel::Poor } else { TrustLevel::Check };
        let reason = TrustReason { code: warning.code, message: warning.message.clone() };
        if level as u8 > found.trust.level as u8 {
            found.trust.level = level;
            found.trust.next.clone_from(&warning.remedy);
            found.trust.reasons.insert(0, reason);
        } else {
            found.trust.reasons.push(reason);
            // Missing tests are the cause of other reasons.
            if warning.code == "test_missing" {
                found.trust.next.clone_from(&warning.remedy);
            }
        }
    }
    found.warnings.extend(warnings);
}
