//! Search problems of a user's model.

use super::engine::{Engine, Look};
use super::parameter::ComparedParameter;
use super::reference::Reference;
use super::spec::CompareSpec;
use super::subject::ComparedModel;
use motorfit_core::candidates::Candidates;
use motorfit_core::setting::{Text, text};
use motorfit_core::{Error, Result};
use motorfit_evaluate::criterion::Criterion;
use motorfit_evaluate::model::ModelProblem;
use motorfit_identify::Method;
use motorfit_identify::device::{DeviceSpec, DeviceUsed, ModelDevice, PrecisionSpec};
use motorfit_identify::model::{ModelProgress, ModelSpec, identify_model};
use motorfit_optimize::{Evaluate, Stop};
use motorfit_record::warning::Warning;

/// Operations between two calls of the observer: some tenths of a second on two cores.
const SLICE_OPERATIONS: usize = 2_000_000_000;
/// Largest number of candidates between two calls of the observer.
const SLICE_MAX: usize = 1 << 14;

/// Multiple of the candidates that are evaluated side by side, at which a large population is divided.
const BLOCK: usize = 64;

/// The problem of a criterion on its device.
struct Prepared {
    criterion: Criterion,
    problem: ModelProblem,
    device: ModelDevice,
}

/// Search problems of a model by criterion, and their evaluators.
pub(super) struct ModelEngine<'a> {
    of: &'a ComparedModel,
    prepared: Vec<Prepared>,
    /// Index of the problem of each setting.
    problems: Vec<usize>,
    /// Index of the problem of each run that is evaluated.
    runs: Vec<usize>,
}

impl<'a> ModelEngine<'a> {
    pub(super) fn open(of: &'a ComparedModel, spec: &CompareSpec) -> Result<Self> {
        if spec.steiglitz_mcbride {
            let message = "Steiglitz\u{2013}McBride is a method of the linear DC motor and does not estimate a model";
            return Err(Error::usage(message, text!("Leave it out of " [Methods] ".")));
        }
        let (mut prepared, mut problems): (Vec<Prepared>, Vec<usize>) = (Vec::new(), Vec::new());
        for setting in &spec.settings {
            let criterion = setting.criterion;
            let known = prepared.iter().position(|known| known.criterion == criterion);
            problems.push(known.unwrap_or(prepared.len()));
            if known.is_none() {
                let problem = of.problem(criterion)?;
                let device = ModelDevice::open(&spec.device, spec.precision, &problem)?;
                prepared.push(Prepared { criterion, problem, device });
            }
        }
        let engine = Self { of, prepared, problems, runs: Vec::new() };
        if engine.bounds().is_empty() {
            return Err(Error::usage("every parameter is fixed", text!("Leave one out of " [Fix] ".")));
        }
        Ok(engine)
    }

    /// Returns the first problem; the others differ in the criterion.
    fn problem(&self) -> &ModelProblem {
        &self.prepared[0].problem
    }
}

impl Evaluate for ModelEngine<'_> {
    /// Evaluates the candidates of all runs with the same problem as one batch: the cost of a candidate does not depend on the others.
    fn finish(&mut self, populations: &[Candidates<'_>], costs: &mut [f64]) -> Result<()> {
        let own = |run: usize| self.runs.get(run).copied().unwrap_or(0);
        let mut ends = 0;
        let places = populations.iter().enumerate().map(|(run, population)| {
            ends += population.count();
            (own(run), *population, ends - population.count()..ends)
        });
        let places: Vec<_> = places.collect();
        for (number, Prepared { problem, device, .. }) in self.prepared.iter_mut().enumerate() {
            let of: Vec<_> = places.iter().filter(|(own, ..)| *own == number).collect();
            let values: Vec<f64> =
                of.iter().flat_map(|(_, population, _)| population.values().iter().copied()).collect();
            if values.is_empty() {
                continue;
            }
            let mut found = vec![f64::INFINITY; of.iter().map(|(.., range)| range.len()).sum()];
            device.evaluator.costs(problem, Candidates::new(&values, problem.space().free.len()), &mut found)?;
            let mut rest = &found[..];
            for (.., range) in of {
                let (one, others) = rest.split_at(range.len());
                costs[range.clone()].copy_from_slice(one);
                rest = others;
            }
        }
        Ok(())
    }
}

impl Engine for ModelEngine<'_> {
    fn parameters(&self) -> Vec<ComparedParameter> {
        ComparedParameter::of_model(&self.of.model, self.problem().space())
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        self.problem().space().free.iter().map(|axis| (axis.min, axis.max)).collect()
    }

    fn set_runs(&mut self, settings: &[usize]) {
        self.runs = settings.iter().map(|setting| self.problems[*setting]).collect();
    }

    fn evaluator(&mut self) -> &mut dyn Evaluate {
        self
    }

    fn slice(&self) -> usize {
        let samples: usize = self.of.recordings.iter().map(|recording| recording.len()).sum();
        let operations = samples.saturating_mul(self.problem().work()).max(1);
        (SLICE_OPERATIONS / operations).clamp(1, SLICE_MAX).next_multiple_of(BLOCK)
    }

    fn cost(&self, setting: usize, candidate: &[f64]) -> f64 {
        let mut cost = [f64::INFINITY];
        let problem = &self.prepared[self.problems[setting]].problem;
        // A candidate of another length has no cost.
        let _ = problem.costs(Candidates::new(candidate, candidate.len().max(1)), &mut cost);
        cost[0]
    }

    fn reference(&self, look: &mut Look<'_>) -> std::result::Result<Reference, Text> {
        let (device, precision) = (DeviceSpec::Cpu, PrecisionSpec::Auto);
        let spec = ModelSpec { method: Method::Auto, is_polished: true, device, precision, ..self.of.spec.clone() };
        let mut observe = |_: ModelProgress| look();
        let found =
            identify_model(&self.of.model, &self.of.recordings, &spec, &mut observe).map_err(|error| error.text())?;
        match found.stop {
            Stop::Interrupted => Err("interrupted before its end".into()),
            _ => Ok(Reference::Model(Box::new(found))),
        }
    }

    /// Returns the cost of the estimate as a candidate of the searches, which have the initial states as measured.
    fn reference_cost(&self, setting: usize, reference: &Reference) -> Option<f64> {
        Some(self.cost(setting, &reference.model()?.values)).filter(|cost| cost.is_finite())
    }

    /// Returns no bound: a multistart evaluates thousands of candidates.
    fn reference_work(&self) -> usize {
        usize::MAX
    }

    fn device(&self) -> DeviceUsed {
        self.prepared[0].device.used()
    }

    fn warnings(&self) -> Vec<Warning> {
        self.prepared[0].device.warnings.clone()
    }

    fn initial(&self) -> Vec<[f64; 2]> {
        Vec::new()
    }
}
