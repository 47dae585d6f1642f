//! The result of an identification.

use super::models::{Alternative, SelectionStep};
use super::repeated::validation_repeats;
use super::search::SearchResult;
use super::spec::IdentifySpec;
use super::trust_level::Trust;
use super::verify::Verification;
use crate::analysis::{self, FittedMotor, NoiseFloor, Regression, ResidualTests, Validation, noise_floor};
use crate::estimate::{Refined, Uncertainty};
use crate::evaluate::{Model, Problem, Scalar};
use crate::motor::{Axis, Input, Parameter, Parameters, Scope, Space};
use crate::optimize::Stop;
use crate::record::{Excluded, Record};
use crate::warning::Warning;
use crate::{Error, Result};
use serde::Serialize;

/// The result of a method, before the refinement.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SearchOutcome {
    /// The method that found it: the one asked for, or what `auto` took.
    pub method: &'static str,
    /// True if it took over where Steiglitz–McBride cannot serve.
    #[serde(skip)]
    pub is_fallback: bool,
    /// True where a population was searched, also where what it found was not taken.
    #[serde(skip)]
    pub has_population: bool,
    /// The parameters, those held included.
    pub parameters: Parameters,
    /// Their cost in the chosen criterion, by the scalar oracle.
    pub cost: f64,
}

/// Samples that were left out of a fit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LeftOut {
    /// The number of the recording, from 0 on.
    #[serde(rename = "record")]
    pub recording: usize,
    /// The time of the first of them \[s\].
    pub from_s: f64,
    /// The time of the last of them \[s\].
    pub to_s: f64,
    /// Their number.
    pub samples: usize,
}

/// Returns the samples of `records` that do not count in `used`, which are the same recordings.
pub(super) fn left_out(records: &[Record], used: &[Record]) -> Vec<LeftOut> {
    let of = |(recording, (record, used)): (usize, (&Record, &Record))| {
        let more = used.excluded().iter().filter(|excluded| !record.excluded().contains(excluded));
        let time = &record.samples().time_s;
        let one = |e: &Excluded| LeftOut {
            recording,
            from_s: time[e.start],
            to_s: time[e.end - 1],
            samples: e.end - e.start,
        };
        more.map(one).collect::<Vec<_>>()
    };
    records.iter().zip(used).enumerate().flat_map(of).collect()
}

/// The result of an identification.
#[derive(Debug, Clone, PartialEq)]
pub struct Identification {
    /// The level of trust in the result, with its reasons.
    pub trust: Trust,
    /// The input of the recordings.
    pub input: Input,
    /// The method of the simulation: the spec's or, where `auto` chose, with another course of the voltage between samples.
    pub model: Model,
    /// Samples that `auto` left out.
    pub left_out: Vec<LeftOut>,
    /// The parameters after the polish, those held included.
    pub parameters: Parameters,
    /// Values of what is free, in the order of the space; extensions and what belongs to one recording are among them.
    pub values: Vec<f64>,
    /// Parameters that the recordings do not tell: what stands for them in `parameters` does the same and says nothing.
    pub unidentified: Vec<(Parameter, Scope)>,
    /// The models that were tried, in their order, where extensions were to be chosen.
    pub selection: Option<Vec<SelectionStep>>,
    /// Other models that explain the recordings as well, where extensions were to be chosen.
    pub alternatives: Vec<Alternative>,
    /// Their cost in the chosen criterion, by the scalar oracle.
    pub cost: f64,
    /// The result of the method.
    pub searched: SearchOutcome,
    /// The space, its bounds as they were used.
    pub space: Space,
    /// The state `[i, ω]` at the start of each recording.
    pub initial: Vec<[f64; 2]>,
    /// The uncertainty of the parameters; `None` without a refinement.
    pub uncertainty: Option<Uncertainty>,
    /// σ of the residuals of current and speed; `None` for a channel not measured.
    pub residual_sigma: [Option<f64>; 2],
    /// True if the polish came to its end.
    pub converged: bool,
    /// 100 (1 − ‖y − ŷ‖/‖y − mean y‖) of current and speed over all recordings; `None` for a channel not measured.
    pub fit_percent: [Option<f64>; 2],
    /// The same of each recording.
    pub fit_percent_by_recording: Vec<[Option<f64>; 2]>,
    /// The result against the references.
    pub verification: Verification,
    /// Warnings for the reader.
    pub warnings: Vec<Warning>,
    /// Why the search ended.
    pub stop: Stop,
    /// Candidates evaluated.
    pub evaluations: u64,
    /// Lowest cost after each generation; empty without a population.
    pub history: Vec<f64>,
    /// The device that evaluated: cpu or gpu.
    pub device_kind: &'static str,
    /// Its name.
    pub device: String,
    /// The numbers of the evaluation.
    pub precision: &'static str,
    /// The winner's cost by the device less that by the oracle; `None` where the CPU evaluated.
    pub cost_difference: Option<f64>,
    /// The fit on held-out recordings, where there are any.
    pub validation: Option<Validation>,
    /// The residuals of each recording, tested; empty without a polish.
    pub residual_tests: Vec<ResidualTests>,
    /// Feedforward characteristics by regression, to hold against [`Characteristics::of`](crate::analysis::Characteristics::of).
    pub regressions: Vec<Regression>,
    /// The noise floor, where recordings have the same input.
    pub noise_floor: Option<NoiseFloor>,
    /// Seconds of the estimation alone.
    pub seconds: f64,
}

impl Identification {
    /// Makes the result of a search and, where there was one, of the refinement of its optimum. The problem is in the space of
    /// the refinement and starts from its initial states. Fit and warnings are left empty.
    pub(super) fn new(problem: &Problem, found: SearchResult, refined: Option<Refined>) -> Self {
        let searched = SearchOutcome {
            method: found.method,
            is_fallback: false,
            has_population: found.has_population,
            parameters: problem.parameters(&found.values, 0),
            cost: f64::NAN,
        };
        let converged = refined.as_ref().is_none_or(|refined| refined.converged);
        let (values, residual_sigma, uncertainty) = match refined {
            Some(refined) => (refined.values, refined.sigma, Some(refined.uncertainty)),
            None => (found.values, [None; 2], None),
        };
        Self {
            trust: Trust::default(),
            input: problem.input(),
            model: *problem.model(),
            left_out: Vec::new(),
            parameters: problem.parameters(&values, 0),
            unidentified: Vec::new(),
            selection: None,
            alternatives: Vec::new(),
            cost: Scalar::cost(problem, &values),
            values,
            searched,
            space: problem.space().clone(),
            initial: problem.signals().iter().map(|signals| signals.initial).collect(),
            uncertainty,
            residual_sigma,
            converged,
            fit_percent: [None; 2],
            fit_percent_by_recording: Vec::new(),
            verification: Verification::none(),
            warnings: Vec::new(),
            stop: found.stop,
            evaluations: found.evaluations,
            history: found.history,
            device_kind: found.device_kind,
            device: found.device,
            precision: found.precision,
            cost_difference: found.cost_difference,
            validation: None,
            residual_tests: Vec::new(),
            regressions: Vec::new(),
            noise_floor: None,
            seconds: 0.0,
        }
    }

    /// Correlations of R, L, K, B and J, `None` for those held or unknown.
    pub(super) fn correlation(&self, uncertainty: &Uncertainty) -> [[Option<f64>; 5]; 5] {
        let place = |p: Parameter| self.space.free().iter().position(|axis| axis.parameter == p);
        let entry = |a: Parameter, b: Parameter| *uncertainty.correlation.get(place(a)?)?.get(place(b)?)?;
        Parameter::ALL.map(|a| Parameter::ALL.map(|b| entry(a, b)))
    }

    /// The bound, `min` or `max`, that a free parameter ended at: nearer to it than 1e-4 of the range and 1 % of
    /// itself.
    #[must_use]
    pub fn at_bound(&self, parameter: Parameter) -> Option<&'static str> {
        let shared = |(axis, _): &(&Axis, &f64)| axis.parameter == parameter && axis.scope == Scope::Shared;
        let (axis, value) = self.space.free().iter().zip(&self.values).find(shared)?;
        side(axis, *value)
    }
}

/// The bound that a value stands at, as [`Identification::at_bound`] has it.
pub(super) fn side(axis: &Axis, value: f64) -> Option<&'static str> {
    let near = 1e-4 * (axis.max - axis.min);
    // A bound of zero has no size of its own.
    let by_size = |bound: f64| if bound == 0.0 { near } else { near.min(0.01 * bound.abs()) };
    if value - axis.min <= by_size(axis.min) {
        Some("min")
    } else if axis.max - value <= by_size(axis.max) {
        Some("max")
    } else {
        None
    }
}

impl<'a> From<&'a Identification> for FittedMotor<'a> {
    fn from(found: &'a Identification) -> Self {
        Self {
            input: found.input,
            parameters: &found.parameters,
            space: &found.space,
            values: &found.values,
            unidentified: &found.unidentified,
            uncertainty: found.uncertainty.as_ref(),
            residual_sigma: found.residual_sigma,
        }
    }
}

/// Simulates held-out recordings with the parameters that were found, without another fit: what belongs to a recording
/// alone is estimated from it, its state at the start where it begins in motion and the parameters that each has for
/// itself.
///
/// # Errors
/// `Usage` when there is no recording; as for a problem of these recordings.
pub fn validate(records: &[Record], spec: &IdentifySpec, found: &Identification) -> Result<Validation> {
    if records.is_empty() {
        return Err(Error::usage("no held-out recording was given", "Give at least one."));
    }
    let validated = |records: &[Record]| analysis::validate(records, &found.into(), found.model, spec.criterion);
    if found.left_out.is_empty() {
        return validated(records);
    }
    let own = |record: &Record| record.without_undersampled().unwrap_or_else(|| record.clone());
    validated(&records.iter().map(own).collect::<Vec<_>>())
}

/// Adds to a result of `records` what held-out recordings say of it, where there are any: how well it explains them, and how
/// well any model could.
///
/// # Errors
/// As [`validate`].
pub fn hold_out(
    found: &mut Identification,
    records: &[Record],
    held_out: &[Record],
    spec: &IdentifySpec,
) -> Result<()> {
    if !held_out.is_empty() {
        found.warnings.extend(validation_repeats(records, held_out));
        let all: Vec<&Record> = records.iter().chain(held_out).collect();
        found.noise_floor = noise_floor(&all, found.model)?;
        found.validation = Some(validate(held_out, spec, found)?);
    }
    Ok(())
}
