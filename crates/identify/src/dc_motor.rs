//! What a result has of the DC motor beside what results of all machines have, and its validation on held-out recordings.

use super::models::{Alternative, SelectionStep};
use super::repeated::validation_repeats;
use super::result::{Identification, Output, SearchOutcome, side};
use super::search::SearchResult;
use super::spec::IdentifySpec;
use crate::analysis::{self, FittedMotor, NoiseFloor, Regression, Validation, noise_floor};
use motorfit_core::{Error, Result};
use motorfit_estimate::{Refined, Uncertainty};
use motorfit_evaluate::{Model, Problem, Scalar};
use motorfit_motor::{Axis, Input, Parameter, Parameters, Scope, Space};
use motorfit_record::Record;

/// Outputs of the DC motor: names and units.
const OUTPUTS: [(&str, &str); 2] = [("current", "A"), ("speed", "rad/s")];

/// The DC motor of a result.
#[derive(Debug, Clone, PartialEq)]
pub struct DcMotor {
    /// Input of the recordings: voltage or current.
    pub input: Input,
    /// Simulation model: that of the spec, possibly with another intersample behaviour if that was selected automatically.
    pub model: Model,
    /// R, L, K, B and J of the first recording, fixed ones included.
    pub parameters: Parameters,
    /// Parameters that the recordings do not identify, those that only a missing channel would identify included.
    pub unidentified: Vec<(Parameter, Scope)>,
    /// Models that the forward selection fitted, in their order; `None` if the extensions were given.
    pub selection: Option<Vec<SelectionStep>>,
    /// Other models that fit the recordings equally well.
    pub alternatives: Vec<Alternative>,
    /// Search space with the bounds as they were used.
    pub space: Space,
    /// Initial state `[i, ω]` of each recording \[A, rad/s\].
    pub initial: Vec<[f64; 2]>,
    /// Fit of held-out recordings, if there are any.
    pub validation: Option<Validation>,
    /// Feedforward characteristics by regression, for comparison with
    /// [`Characteristics::of`](crate::analysis::Characteristics::of).
    pub regressions: Vec<Regression>,
    /// Noise floor, if recordings have the same input.
    pub noise_floor: Option<NoiseFloor>,
}

impl Identification<DcMotor> {
    /// Makes the result of a search and of its refinement, if there was one. The problem has the space and the initial states
    /// of the refinement. The fit and the warnings are left empty.
    pub(super) fn new(problem: &Problem, found: SearchResult, refined: Option<Refined>) -> Self {
        let parameters = problem.parameters(&found.values, 0);
        let parameters = Parameter::ALL.map(|p| (p.symbol().to_owned(), parameters.get(p))).to_vec();
        let has_population = found.has_population;
        let searched =
            SearchOutcome { method: found.method, is_fallback: false, has_population, parameters, cost: f64::NAN };
        let converged = refined.as_ref().is_none_or(|refined| refined.converged);
        let (values, residual_sigma, uncertainty) = match refined {
            Some(refined) => (refined.values, refined.sigma, Some(refined.uncertainty)),
            None => (found.values, vec![None; 2], None),
        };
        let machine = DcMotor {
            input: problem.input(),
            model: *problem.model(),
            parameters: problem.parameters(&values, 0),
            unidentified: Vec::new(),
            selection: None,
            alternatives: Vec::new(),
            space: problem.space().clone(),
            initial: problem.signals().iter().map(|signals| signals.initial).collect(),
            validation: None,
            regressions: Vec::new(),
            noise_floor: None,
        };
        Self {
            outputs: OUTPUTS.map(|(name, unit)| Output { name: name.to_owned(), unit: unit.to_owned() }).to_vec(),
            cost: Scalar::cost(problem, &values),
            values,
            searched,
            uncertainty,
            residual_sigma,
            converged,
            fit_percent: vec![None; 2],
            stop: found.stop,
            evaluations: found.evaluations,
            history: found.history,
            device: found.device,
            cost_difference: found.cost_difference,
            ..Self::of(machine)
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

impl<'a> From<&'a Identification> for FittedMotor<'a> {
    fn from(found: &'a Identification) -> Self {
        Self {
            input: found.input,
            parameters: &found.parameters,
            space: &found.space,
            values: &found.values,
            unidentified: &found.unidentified,
            uncertainty: found.uncertainty.as_ref(),
            residual_sigma: &found.residual_sigma,
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
        found.machine.noise_floor = noise_floor(&all, found.model)?;
        found.machine.validation = Some(validate(held_out, spec, found)?);
    }
    Ok(())
}
