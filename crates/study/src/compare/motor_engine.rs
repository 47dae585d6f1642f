//! Search problems of the DC motor.

use super::engine::{Engine, Look};
use super::parameter::ComparedParameter;
use super::reference::Reference;
use super::spec::{CompareSpec, ComparisonSetting};
use motorfit_core::Result;
use motorfit_core::setting::Text;
use motorfit_evaluate::{Problem, Scalar};
use motorfit_identify::device::{BatchSearchEvaluator, DeviceSpec, DeviceUsed};
use motorfit_identify::{Identification, IdentifySpec, identify, needs_voltage};
use motorfit_motor::{Parameters, Space};
use motorfit_optimize::Evaluate;
use motorfit_record::Record;
use motorfit_record::warning::Warning;
use std::sync::Arc;

/// Work of the refined estimate, relative to Steiglitz–McBride on one record with new noise.
pub(super) const REFERENCE: usize = 20;

/// Search problems of the DC motor by setting, and their evaluator.
pub(super) struct MotorEngine<'a> {
    records: &'a [Record],
    spec: &'a CompareSpec,
    problems: Vec<Arc<Problem>>,
    searches: BatchSearchEvaluator,
}

impl<'a> MotorEngine<'a> {
    pub(super) fn open(records: &'a [Record], spec: &'a CompareSpec) -> Result<Self> {
        needs_voltage(records)?;
        let problem =
            |s: &ComparisonSetting| Problem::new(records, spec.model, spec.space.clone(), s.criterion).map(Arc::new);
        let problems: Vec<Arc<Problem>> = spec.settings.iter().map(problem).collect::<Result<_>>()?;
        let one = |s: &ComparisonSetting| s.population.saturating_mul(s.methods.len()).saturating_mul(spec.runs);
        let agents = spec.settings.iter().map(one).fold(0, usize::saturating_add);
        let generations = spec.settings.iter().map(|s| s.generations).max().unwrap_or(1);
        let searches = BatchSearchEvaluator::open(&spec.search(agents, generations), problems.clone())?;
        Ok(Self { records, spec, problems, searches })
    }
}

/// Returns the cost of a motor in the criterion of a setting. All five parameters are free here: the motor may differ from the values
/// that the searches fix.
pub(super) fn cost_of(
    records: &[Record],
    spec: &CompareSpec,
    setting: &ComparisonSetting,
    motor: &Parameters,
) -> Option<f64> {
    let problem = Problem::new(records, spec.model, Space::table2(), setting.criterion).ok()?;
    Some(Scalar::cost(&problem, &motor.to_array())).filter(|cost| cost.is_finite())
}

impl Engine for MotorEngine<'_> {
    fn parameters(&self) -> Vec<ComparedParameter> {
        ComparedParameter::of_motor(&self.spec.space)
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        self.spec.space.bounds()
    }

    fn set_runs(&mut self, settings: &[usize]) {
        self.searches.set_problems(settings.iter().map(|setting| self.problems[*setting].clone()).collect());
    }

    fn evaluator(&mut self) -> &mut dyn Evaluate {
        &mut self.searches
    }

    fn slice(&self) -> usize {
        self.searches.slice()
    }

    fn cost(&self, setting: usize, candidate: &[f64]) -> f64 {
        Scalar::cost(&self.problems[setting], candidate)
    }

    fn reference(&self, _: &mut Look<'_>) -> std::result::Result<Reference, Text> {
        let auto = IdentifySpec {
            model: self.spec.model,
            space: self.spec.space.clone(),
            auto_bounds: Vec::new(),
            device: DeviceSpec::Cpu,
            ..IdentifySpec::default()
        };
        let found = identify(self.records, &auto).map_err(|error| error.text())?;
        Ok(Reference::Motor(Box::new(found)))
    }

    fn reference_cost(&self, setting: usize, reference: &Reference) -> Option<f64> {
        // Costs compare only under the same initial states, which the refinement may have estimated.
        let initial = self.initial();
        let is_same = |found: &&Identification| found.initial.iter().flatten().eq(initial.iter().flatten());
        let found = reference.motor().filter(is_same)?;
        cost_of(self.records, self.spec, &self.spec.settings[setting], &found.parameters)
    }

    fn reference_work(&self) -> usize {
        let samples: usize = self.records.iter().map(Record::len).sum();
        samples.saturating_mul(REFERENCE)
    }

    fn device(&self) -> DeviceUsed {
        self.searches.device()
    }

    fn warnings(&self) -> Vec<Warning> {
        self.searches.warnings().to_vec()
    }

    fn initial(&self) -> Vec<[f64; 2]> {
        let signals = self.problems.first().map_or(&[][..], |problem| problem.signals());
        signals.iter().map(|signals| signals.initial).collect()
    }
}
