//! The machine that a throughput benchmark evaluates: the DC motor, or a user's model.

use motorfit_core::candidates::Candidates;
use motorfit_core::numeric::count;
use motorfit_core::{Error, Result};
use motorfit_evaluate::criterion::Criterion;
use motorfit_evaluate::experiment::{Excitation, simulated};
use motorfit_evaluate::model::{ModelAxis, ModelEvaluator, ModelProblem, ModelRecording, ModelSettings, ModelSpace};
use motorfit_evaluate::{Batch, Evaluator, Group, Model, Problem};
use motorfit_model::Model as OwnModel;
use motorfit_motor::{Discretization, Parameters, Space};
use motorfit_optimize::{Sample, Sampling};
use std::sync::Arc;

/// Machine of a benchmark.
pub enum BenchSubject {
    /// The linear DC motor.
    Motor,
    /// A model.
    Model(Box<OwnModel>),
}

/// Sampling period of the recordings \[s\].
const PERIOD_S: f64 = 1e-3;
/// Number of times that the inputs of a model change sign in a recording.
const EDGES: usize = 8;

impl BenchSubject {
    /// Returns the problem of a recording with `samples` samples.
    pub(super) fn problem(&self, samples: usize) -> Result<BenchProblem> {
        match self {
            Self::Motor => motor(samples).map(BenchProblem::Motor),
            Self::Model(model) => model_problem(model, samples).map(BenchProblem::Model),
        }
    }
}

/// A problem that is evaluated.
pub(super) enum BenchProblem {
    Motor(Arc<Problem>),
    Model(Box<ModelProblem>),
}

impl BenchProblem {
    /// Returns the number of free parameters.
    pub(super) fn width(&self) -> usize {
        match self {
            Self::Motor(problem) => problem.space().free().len(),
            Self::Model(problem) => problem.space().free.len(),
        }
    }

    /// Returns the values of candidates spread over the box, shape `[population, free parameters]`.
    pub(super) fn values(&self, population: usize) -> Result<Vec<f64>> {
        let width = self.width();
        let mut values = vec![0.0; population * width];
        match self {
            Self::Motor(problem) => {
                Sample::new(Sampling::Uniform, population as u64, problem.space().bounds(), 1)?.fill(0, &mut values);
            }
            Self::Model(problem) => {
                let unit = vec![(0.0, 1.0); width];
                Sample::new(Sampling::Uniform, population as u64, unit, 1)?.fill(0, &mut values);
                for (value, axis) in values.iter_mut().zip(problem.space().free.iter().cycle()) {
                    *value = axis.at(*value);
                }
            }
        }
        Ok(values)
    }
}

/// An evaluator of a benchmark.
pub(super) enum Engine {
    Motor(Box<dyn Evaluator>),
    Model(Box<dyn ModelEvaluator>),
}

impl Engine {
    /// Evaluates the candidates of a problem once.
    pub(super) fn evaluate(&mut self, problem: &BenchProblem, values: &[f64], costs: &mut [f64]) -> Result<()> {
        let candidates = Candidates::new(values, problem.width());
        match (self, problem) {
            (Self::Motor(evaluator), BenchProblem::Motor(problem)) => {
                let groups = [Group { problem, candidates, reference: None }];
                evaluator.evaluate(&Batch { groups: &groups }, costs)
            }
            (Self::Model(evaluator), BenchProblem::Model(problem)) => evaluator.costs(problem, candidates, costs),
            _ => Err(Error::usage("the evaluator is of another machine", "Measure evaluators of the same machine.")),
        }
    }

    /// Evaluates the candidates of a problem once and returns the time that the device computed \[s\]; `None` if it has no clock.
    pub(super) fn evaluate_timed(
        &mut self,
        problem: &BenchProblem,
        values: &[f64],
        costs: &mut [f64],
    ) -> Result<Option<f64>> {
        match (self, problem) {
            (Self::Motor(evaluator), BenchProblem::Motor(problem)) => {
                let candidates = Candidates::new(values, problem.space().free().len());
                let groups = [Group { problem, candidates, reference: None }];
                evaluator.evaluate_timed(&Batch { groups: &groups }, costs)
            }
            (own, problem) => own.evaluate(problem, values, costs).map(|()| None),
        }
    }
}

/// Returns the problem of the paper's motor M2 under a voltage step at the first sample, so that every sample is
/// simulated.
fn motor(samples: usize) -> Result<Arc<Problem>> {
    let excitation = Excitation::step(10.5, 0.0, count(samples - 1) * PERIOD_S, PERIOD_S)?;
    let record = simulated(&Parameters::M2, &excitation, Discretization::Zoh)?;
    Ok(Arc::new(Problem::new(&[record], Model::default(), Space::table2(), Criterion::default())?))
}

/// Returns the problem of a model whose inputs are square waves of magnitude 1 in their units, those with a default constant, and
/// whose outputs are simulated with the middle of the box.
pub(super) fn model_problem(model: &OwnModel, samples: usize) -> Result<Box<ModelProblem>> {
    let time_s: Vec<f64> = (0..samples).map(|n| count(n) * PERIOD_S).collect();
    let square = |n: usize| if (n * EDGES / samples.max(1)).is_multiple_of(2) { 1.0 } else { -1.0 };
    let inputs = model.inputs().iter().map(|input| match input.default {
        Some(value) => vec![value; samples],
        None => (0..samples).map(square).collect(),
    });
    let mut recording = ModelRecording {
        step_s: vec![PERIOD_S],
        inputs: inputs.collect(),
        measured: model.outputs().iter().map(|_| Some(time_s.clone())).collect(),
        counting: Vec::new(),
        effective_sample_ratio: 1.0,
        name: None,
        time_s,
    };
    let space = ModelSpace::new(model, 1);
    let middle: Vec<f64> = space.free.iter().map(|axis: &ModelAxis| axis.at(0.5)).collect();
    let problem = ModelProblem::new(model, space.clone(), vec![recording.clone()], ModelSettings::default())?;
    let open = problem.open_initial(0).to_vec();
    for (measured, simulated) in recording.measured.iter_mut().zip(problem.simulate(&middle, 0, &open).outputs) {
        // An output that diverges keeps the time, which varies.
        if simulated.iter().all(|value| value.is_finite()) && simulated.windows(2).any(|pair| pair[0] < pair[1]) {
            *measured = Some(simulated);
        }
    }
    Ok(Box::new(ModelProblem::new(model, space, vec![recording], ModelSettings::default())?))
}
