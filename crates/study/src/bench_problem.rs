//! The problems that a throughput benchmark evaluates: of the DC motor, or of a user's model.

use motorfit_core::Result;
use motorfit_core::numeric::count;
use motorfit_evaluate::criterion::Criterion;
use motorfit_evaluate::experiment::{Excitation, simulated};
use motorfit_evaluate::model::{ModelAxis, ModelProblem, ModelRecording, ModelSettings, ModelSpace};
use motorfit_evaluate::{Model, Problem, SearchProblem};
use motorfit_model::Model as OwnModel;
use motorfit_motor::{Discretization, Parameters, Space};
use motorfit_optimize::{Sample, Sampling};

/// Sampling period of the recordings \[s\].
const PERIOD_S: f64 = 1e-3;
/// Number of times that the inputs of a model change sign in a recording.
const EDGES: usize = 8;

/// Returns the values of candidates spread over the box of a problem, shape `[population, free parameters]`.
pub(super) fn candidates(problem: &dyn SearchProblem, population: usize) -> Result<Vec<f64>> {
    let axes = problem.axes();
    let mut values = vec![0.0; population * axes.len()];
    Sample::new(Sampling::Uniform, population as u64, vec![(0.0, 1.0); axes.len()], 1)?.fill(0, &mut values);
    for (value, axis) in values.iter_mut().zip(axes.iter().cycle()) {
        *value = axis.at(*value);
    }
    Ok(values)
}

/// Returns the problem of the paper's motor M2 under a voltage step at the first sample, so that every sample is
/// simulated.
pub(super) fn motor_problem(samples: usize) -> Result<Problem> {
    let excitation = Excitation::step(10.5, 0.0, count(samples - 1) * PERIOD_S, PERIOD_S)?;
    let record = simulated(&Parameters::M2, &excitation, Discretization::Zoh)?;
    Problem::new(&[record], Model::default(), Space::table2(), Criterion::default())
}

/// Returns the problem of a model whose inputs are square waves of magnitude 1 in their units, those with a default constant, and
/// whose outputs are simulated with the middle of the box.
pub(super) fn model_problem(model: &OwnModel, samples: usize) -> Result<ModelProblem> {
    let time_s: Vec<f64> = (0..samples).map(|n| count(n) * PERIOD_S).collect();
    let square = |n: usize| if (n * EDGES / samples.max(1)).is_multiple_of(2) { 1.0 } else { -1.0 };
    let inputs = model.inputs().iter().map(|input| match input.default {
        Some(value) => vec![value; samples],
        None => (0..samples).map(square).collect(),
    });
    let mut recording = ModelRecording::to_simulate(model, time_s, inputs.collect())?;
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
    ModelProblem::new(model, space, vec![recording], ModelSettings::default())
}
