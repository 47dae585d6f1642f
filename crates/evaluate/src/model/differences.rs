//! Derivatives of trajectories by parameters beside differences, for tests.

use super::{ModelProblem, Unknown};

/// The derivative of an output by a parameter, times its value, over the samples.
pub(super) struct Derivative {
    /// Number of the parameter.
    pub parameter: usize,
    /// Number of the output.
    pub output: usize,
    /// As the program computes it.
    pub own: Vec<f64>,
    /// Central difference over 2e-6 of the value.
    pub difference: Vec<f64>,
}

/// Returns the derivatives of all outputs by all parameters on the first recording, for a model without open initial states.
pub(super) fn derivatives(problem: &ModelProblem, values: &[f64]) -> Vec<Derivative> {
    let unknowns: Vec<Unknown> = values.iter().enumerate().map(|(n, value)| Unknown::Parameter(n, *value)).collect();
    let found = problem.trajectory(values, 0, &[], &unknowns);
    let mut all = Vec::new();
    for parameter in 0..values.len() {
        let moved = |step: f64| {
            let mut values = values.to_vec();
            values[parameter] *= 1.0 + step;
            problem.simulate(&values, 0, &[]).outputs
        };
        let (after, before) = (moved(1e-6), moved(-1e-6));
        for (output, (after, before)) in after.iter().zip(&before).enumerate() {
            let own = found.sensitivities[output].iter().skip(parameter).step_by(values.len()).copied().collect();
            let difference = after.iter().zip(before).map(|(a, b)| (a - b) / 2e-6).collect();
            all.push(Derivative { parameter, output, own, difference });
        }
    }
    all
}
