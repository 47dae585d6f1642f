//! The result of an identification, and its validation on held-out recordings.

use super::models::{Alternative, SelectionStep};
use super::repeated::validation_repeats;
use super::search::SearchResult;
use super::spec::IdentifySpec;
use super::trust_level::Trust;
use super::verify::Verification;
use crate::analysis::{self, FittedMotor, NoiseFloor, Regression, ResidualTests, Validation, noise_floor};
use crate::device::DeviceUsed;
use motorfit_core::{Error, Result};
use motorfit_estimate::{Refined, Uncertainty};
use motorfit_evaluate::{Model, Problem, Scalar};
use motorfit_motor::{Axis, Input, Parameter, Parameters, Scope, Space};
use motorfit_optimize::Stop;
use motorfit_record::warning::Warning;
use motorfit_record::{Excluded, Record};
use serde::Serialize;

/// The first optimum that a method found, before the refinement.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SearchOutcome {
    /// Name of the method: the requested one, or the one that [`Method::Auto`](super::Method::Auto) selected.
    pub method: &'static str,
    /// True if a population search replaced the initial estimates of [`Method::Auto`](super::Method::Auto) because these are
    /// not applicable or lead to a poor fit.
    #[serde(skip)]
    pub is_fallback: bool,
    /// True if a population search was run, also if its result was not used.
    #[serde(skip)]
    pub has_population: bool,
    /// Parameters of the first optimum, fixed ones included.
    pub parameters: Parameters,
    /// Cost of these parameters in the criterion of the spec, by the scalar evaluator.
    pub cost: f64,
}

/// A run of samples that were excluded from a fit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LeftOut {
    /// Index of the recording, from 0.
    #[serde(rename = "record")]
    pub recording: usize,
    /// Time of the first excluded sample \[s\].
    pub from_s: f64,
    /// Time of the last excluded sample \[s\].
    pub to_s: f64,
    /// Number of excluded samples.
    pub samples: usize,
}

/// Returns the samples that are excluded in `used` and not in `records`, which are the same recordings.
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
    /// Level of trust in the result with its reasons.
    pub trust: Trust,
    /// Input of the recordings: voltage or current.
    pub input: Input,
    /// Simulation model: that of the spec, possibly with another intersample behaviour if that was selected automatically.
    pub model: Model,
    /// Samples that were excluded automatically.
    pub left_out: Vec<LeftOut>,
    /// Parameters after the polish, fixed ones included.
    pub parameters: Parameters,
    /// Values of all free parameters in the order of the space, with those of extensions and of single recordings.
    pub values: Vec<f64>,
    /// Parameters that the recordings do not identify. Their values in `parameters` are arbitrary: others fit equally well.
    pub unidentified: Vec<(Parameter, Scope)>,
    /// Models of the model selection in their order; `None` if the extensions were given.
    pub selection: Option<Vec<SelectionStep>>,
    /// Other models that fit the recordings equally well; empty if the extensions were given.
    pub alternatives: Vec<Alternative>,
    /// Cost of the parameters in the criterion of the spec, by the scalar evaluator.
    pub cost: f64,
    /// First optimum, before the refinement.
    pub searched: SearchOutcome,
    /// Search space with the bounds as they were used.
    pub space: Space,
    /// Initial state `[i, ω]` of each recording \[A, rad/s\].
    pub initial: Vec<[f64; 2]>,
    /// Uncertainty of the parameters; `None` without a refinement.
    pub uncertainty: Option<Uncertainty>,
    /// Standard deviation of the residuals of current \[A\] and speed \[rad/s\]; `None` for a channel that was not measured.
    pub residual_sigma: [Option<f64>; 2],
    /// True if the polish converged.
    pub converged: bool,
    /// Fit `100 (1 − ‖y − ŷ‖/‖y − mean y‖)` of current and speed over all recordings \[%\]; `None` for a channel that was not
    /// measured.
    pub fit_percent: [Option<f64>; 2],
    /// Fit of current and speed of each recording \[%\].
    pub fit_percent_by_recording: Vec<[Option<f64>; 2]>,
    /// Comparison of the result with references.
    pub verification: Verification,
    /// Warnings about the recordings, the spec and the result.
    pub warnings: Vec<Warning>,
    /// Reason for which the search ended.
    pub stop: Stop,
    /// Number of evaluated candidates.
    pub evaluations: u64,
    /// Lowest cost after each generation; empty without a population search.
    pub history: Vec<f64>,
    /// Device that evaluated.
    pub device: DeviceUsed,
    /// Cost of the best candidate on the device minus that of the scalar evaluator; `None` on the CPU.
    pub cost_difference: Option<f64>,
    /// Fit of held-out recordings, if there are any.
    pub validation: Option<Validation>,
    /// Residual tests of each recording; empty without a polish.
    pub residual_tests: Vec<ResidualTests>,
    /// Feedforward characteristics by regression, for comparison with
    /// [`Characteristics::of`](crate::analysis::Characteristics::of).
    pub regressions: Vec<Regression>,
    /// Noise floor, if recordings have the same input.
    pub noise_floor: Option<NoiseFloor>,
    /// Duration of the estimation \[s\].
    pub seconds: f64,
}

impl Identification {
    /// Makes the result of a search and of its refinement, if there was one. The problem has the space and the initial states
    /// of the refinement. The fit and the warnings are left empty.
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
            Some(refined) => {
                (refined.values, [0, 1].map(|channel: usize| refined.sigma[channel]), Some(refined.uncertainty))
            }
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
            device: found.device,
            cost_difference: found.cost_difference,
            validation: None,
            residual_tests: Vec::new(),
            regressions: Vec::new(),
            noise_floor: None,
            seconds: 0.0,
        }
    }

    /// Returns the correlation matrix of R, L, K, B and J; `None` for fixed and unidentified parameters.
    pub(super) fn correlation(&self, uncertainty: &Uncertainty) -> [[Option<f64>; 5]; 5] {
        let index = |p: Parameter| self.space.free().iter().position(|axis| axis.parameter == p);
        let entry = |a: Parameter, b: Parameter| *uncertainty.correlation.get(index(a)?)?.get(index(b)?)?;
        Parameter::ALL.map(|a| Parameter::ALL.map(|b| entry(a, b)))
    }

    /// Returns the bound, `min` or `max`, at which a shared free parameter ended: within 1e-4 of the range and 1 % of the
    /// bound.
    #[must_use]
    pub fn at_bound(&self, parameter: Parameter) -> Option<&'static str> {
        let shared = |(axis, _): &(&Axis, &f64)| axis.parameter == parameter && axis.scope == Scope::Shared;
        let (axis, value) = self.space.free().iter().zip(&self.values).find(shared)?;
        side([axis.min, axis.max], *value)
    }
}

/// Returns the bound at which a value is, by the tolerances of [`Identification::at_bound`].
pub fn side([min, max]: [f64; 2], value: f64) -> Option<&'static str> {
    let near = 1e-4 * (max - min);
    // A bound of zero has no relative tolerance.
    let by_size = |bound: f64| if bound == 0.0 { near } else { near.min(0.01 * bound.abs()) };
    if value - min <= by_size(min) {
        Some("min")
    } else if max - value <= by_size(max) {
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

/// Validates a result on held-out recordings by simulation with the identified parameters. Only the initial state of a
/// recording that begins in motion, and parameters with one value per recording, are estimated from the recording itself.
///
/// # Errors
/// Returns `Usage` if there is no recording and `Data` for a recording with another input than those of the fit; propagates the
/// errors of [`Problem::new`].
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

/// Adds the validation on held-out recordings and the noise floor of all recordings to the result of `records`. Without
/// held-out recordings the result remains unchanged.
///
/// # Errors
/// Returns the same errors as [`validate`].
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
