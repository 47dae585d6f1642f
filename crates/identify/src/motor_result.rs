//! The result of an identification of the DC motor, and its validation on held-out recordings.

use super::dc_motor::DcMotor;
use super::estimates::{Combination, ParameterEstimate, side};
use super::repeated::validation_repeats;
use super::result::{Identification, SearchOutcome};
use super::search::SearchResult;
use super::spec::IdentifySpec;
use crate::analysis::{self, Characteristic, Characteristics, FittedMotor, Output, Validation, noise_floor};
use crate::trust::judge_validation;
use motorfit_core::channels::NAMES;
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_estimate::{Refined, Uncertainty, fit_problem, student95};
use motorfit_evaluate::{Problem, Scalar};
use motorfit_motor::{Axis, Extension, Input, Parameter, Scope, With};
use motorfit_record::Record;

/// Units of the outputs of the DC motor.
const UNITS: [&str; 2] = ["A", "rad/s"];

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
            identified: Vec::new(),
            space: problem.space().clone(),
            initial: problem.signals().iter().map(|signals| signals.initial).collect(),
            validation: None,
            regressions: Vec::new(),
            noise_floor: None,
        };
        let outputs =
            NAMES.iter().zip(UNITS).map(|(name, unit)| Output { name: (*name).to_owned(), unit: unit.to_owned() });
        let with = problem.space().features().extensions().into_iter().map(|of| of.name().to_owned()).collect();
        Self {
            with,
            outputs: outputs.collect(),
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

    /// Returns all estimates: R, L, K, B and J, then those of extensions, each in the order of the recordings.
    pub(super) fn listed(&self) -> Vec<ParameterEstimate> {
        let uncertainty = self.uncertainty.as_ref();
        let free = self.space.free().iter().zip(&self.values).enumerate().map(|(n, (axis, value))| {
            let estimate = ParameterEstimate {
                std_error: uncertainty.and_then(|u| *u.std_error.get(n)?),
                ci95: uncertainty.and_then(|u| *u.ci95.get(n)?),
                at_bound: side([axis.min, axis.max], *value),
                bounds: Some([axis.min, axis.max]),
                ..ParameterEstimate::of_motor(axis.parameter, axis.scope, Some(*value))
            };
            ((axis.parameter, axis.scope), estimate)
        });
        let fixed = self.space.fixed().iter().map(|&(parameter, scope, value)| {
            let estimate =
                ParameterEstimate { fixed: true, ..ParameterEstimate::of_motor(parameter, scope, Some(value)) };
            ((parameter, scope), estimate)
        });
        let mut all: Vec<((Parameter, Scope), ParameterEstimate)> = free.chain(fixed).collect();
        for ((parameter, scope), unknown) in &mut all {
            if self.unidentified.contains(&(*parameter, *scope)) {
                *unknown = ParameterEstimate::of_motor(*parameter, *scope, None);
            }
        }
        all.sort_by_key(|((parameter, scope), _)| scope.order(*parameter));
        all.into_iter().map(|(_, estimate)| estimate).collect()
    }

    /// Returns the feedforward characteristics that recordings identify if they do not identify R, K or J, without a voltage K or J; empty
    /// if they do.
    pub(super) fn identified_characteristics(&self, records: &[Record]) -> Vec<Combination> {
        let is_open = |p: &Parameter| self.unidentified.iter().any(|(of, _)| of == p);
        let own = match self.input {
            Input::Voltage => &[Parameter::R, Parameter::K, Parameter::J][..],
            Input::Current => &[Parameter::K, Parameter::J],
        };
        if !own.iter().any(is_open) {
            return Vec::new();
        }
        let values: usize = records.iter().flat_map(Record::measured).flatten().map(<[f64]>::len).sum();
        let quantile = student95(values.saturating_sub(self.space.free().len()));
        let one = |(name, unit, of): (&str, &str, Option<Characteristic>)| {
            let Characteristic { value, std_error } = of?;
            let std_error = std_error.filter(|error| *error > 0.0)?;
            let ci95 = [value - quantile * std_error, value + quantile * std_error];
            Some(Combination { name: name.to_owned(), value, unit: unit.to_owned(), std_error, ci95 })
        };
        // The gain is 1/kV.
        Characteristics::named_of(self).into_iter().filter(|of| of.0 != "gain").filter_map(one).collect()
    }

    /// Returns the extensions of the identified motor.
    #[must_use]
    pub fn extensions(&self) -> Vec<Extension> {
        self.space.features().extensions()
    }

    /// Simulates current \[A\] and speed \[rad/s\] of the recordings of the fit, one value per sample. The current is NaN where
    /// it is the input.
    ///
    /// # Errors
    /// Propagates the errors of [`fit_problem`].
    pub fn modelled(&self, records: &[Record]) -> Result<Vec<[Vec<f64>; 2]>> {
        let problem = fit_problem(records, &self.space, self.model)?;
        let initial = |n: usize| self.initial.get(n).copied().unwrap_or_default();
        let mut shown: Vec<_> = (0..records.len()).map(|n| problem.simulate(&self.values, n, initial(n))).collect();
        if self.input == Input::Current {
            shown.iter_mut().for_each(|[current, _]| current.fill(f64::NAN));
        }
        Ok(shown)
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
        add_validation(found, held_out, spec)?;
    }
    Ok(())
}

/// Adds the validation on held-out recordings to a result, and its judgement to the level of trust.
///
/// # Errors
/// Returns the same errors as [`validate`].
pub fn add_validation(found: &mut Identification, held_out: &[Record], spec: &IdentifySpec) -> Result<()> {
    let validation = validate(held_out, spec, found)?;
    let next = || match spec.with {
        With::Auto => {
            "Fit the held-out recordings too; check whether the motor, its load or its supply changed.".into()
        }
        With::These(_) => text!([With = "auto"]),
    };
    judge_validation(found, (&validation.fit_percent, &validation.residual_sigma), next);
    found.machine.validation = Some(validation);
    Ok(())
}
