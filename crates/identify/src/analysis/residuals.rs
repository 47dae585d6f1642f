//! Residual tests of each recording of the DC motor, whose input is the voltage, or the current if that is the input; their document.

use super::fitted::FittedMotor;
use super::output_residuals::{OutputResiduals, ResidualInputs, ResidualTest, ResidualTests, part};
use super::outputs::{Output, by_output};
use motorfit_estimate::{EFFECTIVE_RATIO_MIN, Uncertainty};
use motorfit_evaluate::Problem;
use motorfit_motor::{Axis, Discretization, Scope};
use motorfit_record::{Quantity, Record};
use nalgebra::DMatrix;
use serde_json::Value;

/// Tests the residuals of each recording of a problem. For recordings that were not fitted, `moved` are candidates that differ
/// from `values` by one independent error of the parameters each, as from [`moved`].
pub(crate) fn residual_tests(
    records: &[Record],
    problem: &Problem,
    values: &[f64],
    moved: &[Vec<f64>],
) -> Vec<ResidualTests> {
    let of = |(recording, record): (usize, &Record)| {
        let signals = &problem.signals()[recording];
        let simulated = |values: &[f64]| problem.simulate(values, recording, signals.initial);
        let model = simulated(values);
        let moved: Vec<[Vec<f64>; 2]> = moved.iter().map(|values| simulated(values)).collect();
        let input = record.input();
        let inputs = ResidualInputs::new(vec![input]);
        let is_held = problem.model().discretization != Discretization::Foh;
        let test = |channel: usize| {
            // Residuals of low-pass filtered signals are correlated even if the model is complete.
            let measured =
                record.measured()[channel].filter(|_| signals.effective_sample_ratio >= EFFECTIVE_RATIO_MIN)?;
            let less = |from: &[f64]| from.iter().zip(&model[channel]).map(|(a, b)| a - b).collect::<Vec<f64>>();
            let counts = |n: usize| signals.counts(channel, n);
            let residuals = OutputResiduals {
                values: &less(measured),
                counting: &if record.excluded().is_empty() {
                    Vec::new()
                } else {
                    (0..record.len()).map(counts).collect()
                },
                own: record.own_samples([Quantity::Current, Quantity::Speed][channel]),
                sensitivities: moved.iter().map(|signals| less(&signals[channel])).collect(),
                rms: signals.rms(channel),
            };
            inputs.test(&residuals, |_| is_held)
        };
        [0, 1].map(test).to_vec()
    };
    records.iter().enumerate().map(of).collect()
}

/// Returns the key `residuals` of a result: for each channel the whiteness of the fit and the input test with the largest ratio
/// of statistic to threshold, then the tests of each recording.
pub(crate) fn document(outputs: &[Output], tests: &[ResidualTests], uncertainty: &Uncertainty) -> Value {
    let worst = |channel: usize| {
        let all = tests.iter().filter_map(|tests| (*tests.get(channel)?)?.voltage);
        let voltage = all.max_by(|a, b| part(a).total_cmp(&part(b)));
        let whiteness = uncertainty.whiteness.get(channel).copied().flatten();
        whiteness.map(|whiteness| ResidualTest { whiteness, voltage })
    };
    let mut document = by_output(outputs, &(0..outputs.len()).map(worst).collect::<Vec<_>>());
    document["records"] = tests.iter().map(|tests| by_output(outputs, tests)).collect();
    document
}

/// Returns candidates (values of the shared parameters) that differ from the fitted ones by one independent error each.
///
/// The errors are the columns of the Cholesky factor of the covariance in the coordinates of the axes, without parameters whose
/// standard error is unknown. Standard errors that were not widened for correlated residuals are multiplied by the root of the
/// variance inflation.
pub(super) fn moved(found: &FittedMotor<'_>) -> Vec<Vec<f64>> {
    let Some(uncertainty) = found.uncertainty else { return Vec::new() };
    let (axes, values) = (found.space.free(), found.values);
    let sizes = [values.len(), uncertainty.std_error.len(), uncertainty.correlation.len()];
    if sizes != [axes.len(); 3] || uncertainty.correlation.iter().any(|row| row.len() != axes.len()) {
        return Vec::new();
    }
    let shared: Vec<usize> = (0..axes.len()).filter(|n| axes[*n].scope == Scope::Shared).collect();
    let known: Vec<(usize, f64)> =
        shared.iter().filter_map(|&n| Some((n, uncertainty.std_error[n]? / axes[n].slope(values[n])))).collect();
    let more = if uncertainty.widened_by > 1.0 { 1.0 } else { uncertainty.variance_inflation() };
    let covariance = DMatrix::from_fn(known.len(), known.len(), |a, b| {
        let ((row, of_row), (column, of_column)) = (known[a], known[b]);
        more * of_row * of_column * uncertainty.correlation[row][column].unwrap_or(0.0)
    });
    let Some(root) = covariance.cholesky() else { return Vec::new() };
    let root = root.l();
    let one = |column: usize| {
        let mut values = values.to_vec();
        let shifted = |axis: &Axis, value: f64, by: f64| axis.value(axis.coordinate(value) + by);
        known
            .iter()
            .enumerate()
            .for_each(|(row, (n, _))| values[*n] = shifted(&axes[*n], values[*n], root[(row, column)]));
        shared.iter().map(|n| values[*n]).collect()
    };
    (0..known.len()).map(one).collect()
}
