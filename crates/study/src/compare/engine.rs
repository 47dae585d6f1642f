//! The search problems of a comparison on the device that evaluates them, for any machine.

use super::parameter::ComparedParameter;
use super::reference::Reference;
use super::spec::{CompareSpec, ComparisonSetting};
use super::subject::{ComparedMachine, ComparisonSubject};
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_evaluate::criterion::Criterion;
use motorfit_evaluate::{Problem, Scalar, SearchProblem};
use motorfit_identify::device::{BatchSearchEvaluator, DeviceProblem, EvaluatorSpec, SearchEvaluator};
use motorfit_identify::{Identification, IdentifySpec, needs_voltage};
use motorfit_motor::{Parameters, Space};
use motorfit_record::Record;
use std::sync::Arc;

/// The search problems of the settings of a comparison, and their evaluator.
pub(super) struct Engine {
    /// Problem of each setting.
    problems: Vec<Arc<dyn SearchProblem>>,
    /// The evaluator of populations, each on the problem of a setting.
    pub searches: Box<dyn SearchEvaluator>,
    /// Parameters of the machine.
    pub parameters: Vec<ComparedParameter>,
    /// Initial state `[i, ω]` of a DC motor in each recording \[A, rad/s\]; empty for a model.
    pub initial: Vec<[f64; 2]>,
}

impl Engine {
    /// Prepares the problems of a comparison and opens their device.
    pub fn open(subject: &ComparisonSubject, spec: &CompareSpec) -> Result<Self> {
        let one = |s: &ComparisonSetting| s.population.saturating_mul(s.methods.len()).saturating_mul(spec.runs);
        let agents = spec.settings.iter().map(one).fold(0, usize::saturating_add);
        let generations = spec.settings.iter().map(|s| s.generations).max().unwrap_or(1);
        let device = spec.search(agents, generations);
        match &subject.machine {
            ComparedMachine::Motor { .. } => {
                let records = &subject.records;
                needs_voltage(records)?;
                let of = |criterion| Problem::new(records, spec.model, spec.space.clone(), criterion);
                let problems = problems(spec, of)?;
                let initial = problems[0].signals().iter().map(|signals| signals.initial).collect();
                Self::on(problems, &device, (ComparedParameter::of_motor(&spec.space), initial))
            }
            ComparedMachine::Model(of) => {
                if spec.steiglitz_mcbride {
                    let message =
                        "Steiglitz\u{2013}McBride is a method of the linear DC motor and does not estimate a model";
                    return Err(Error::usage(message, text!("Leave it out of " [Methods] ".")));
                }
                let problems = problems(spec, |criterion| of.problem(criterion))?;
                let parameters = ComparedParameter::of_model(&of.model, problems[0].space());
                let device = IdentifySpec { evaluator: EvaluatorSpec::Auto, ..device };
                let own = Self::on(problems, &device, (parameters, Vec::new()))?;
                if own.bounds().is_empty() {
                    return Err(Error::usage("every parameter is fixed", text!("Leave one out of " [Fix] ".")));
                }
                Ok(own)
            }
        }
    }

    fn on<P: DeviceProblem>(
        problems: Vec<Arc<P>>,
        device: &IdentifySpec,
        (parameters, initial): (Vec<ComparedParameter>, Vec<[f64; 2]>),
    ) -> Result<Self> {
        let searches = Box::new(BatchSearchEvaluator::open(device, problems.clone())?);
        let problems = problems.into_iter().map(|problem| -> Arc<dyn SearchProblem> { problem }).collect();
        Ok(Self { problems, searches, parameters, initial })
    }

    /// Returns the box of the search, `(min, max)` for each value of a candidate.
    pub fn bounds(&self) -> Vec<(f64, f64)> {
        self.problems[0].bounds()
    }

    /// Returns the cost of a candidate in the criterion of a setting, computed on the CPU in f64; +∞ for one that diverges.
    pub fn cost(&self, setting: usize, candidate: &[f64]) -> f64 {
        self.problems[setting].cost_of(candidate)
    }

    /// Returns the cost of the refined estimate in the criterion of a setting; `None` if it does not compare with those of the searches.
    pub fn reference_cost(
        &self,
        (subject, spec): (&ComparisonSubject, &CompareSpec),
        setting: usize,
        reference: &Reference,
    ) -> Option<f64> {
        match reference {
            // Costs compare only under the same initial states, which the refinement may have estimated.
            Reference::Motor(found) => {
                let is_same =
                    |found: &&Identification| found.initial.iter().flatten().eq(self.initial.iter().flatten());
                let motor = &Some(found.as_ref()).filter(is_same)?.parameters;
                cost_of(&subject.records, spec, &spec.settings[setting], motor)
            }
            // As a candidate of the searches, which have the initial states as measured.
            Reference::Model(found) => Some(self.cost(setting, &found.values)).filter(|cost| cost.is_finite()),
        }
    }
}

/// Makes the problem of each setting; settings with the same criterion share one.
fn problems<P: SearchProblem>(spec: &CompareSpec, of: impl Fn(Criterion) -> Result<P>) -> Result<Vec<Arc<P>>> {
    let mut problems: Vec<Arc<P>> = Vec::new();
    for setting in &spec.settings {
        let known = problems.iter().find(|known| *known.criterion() == setting.criterion).cloned();
        problems.push(known.map_or_else(|| of(setting.criterion).map(Arc::new), Ok)?);
    }
    Ok(problems)
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
