//! How well a simulation fits.

use crate::criterion::mean;
use crate::evaluate::Problem;
use crate::motor::simulate;
use crate::record::Record;

/// 100 (1 − ‖y − ŷ‖/‖y − mean y‖) per channel, norms over all recordings.
pub(super) fn fit_percent(records: &[Record], problem: &Problem, candidate: &[f64]) -> [Option<f64>; 2] {
    let mut squares = [[0.0; 2]; 2];
    let mut seen = [false; 2];
    for (recording, (record, signals)) in records.iter().zip(problem.signals()).enumerate() {
        let parameters = problem.parameters(candidate, recording);
        let model = simulate(&parameters, &signals.drive(), signals.initial(), problem.model().discretization);
        for (channel, (measured, simulated)) in
            record.measured().into_iter().zip([model.current, model.speed]).enumerate()
        {
            let Some(measured) = measured else { continue };
            seen[channel] = true;
            let mean = mean(measured);
            for (y, y_hat) in measured.iter().zip(simulated) {
                squares[channel][0] += (y - y_hat) * (y - y_hat);
                squares[channel][1] += (y - mean) * (y - mean);
            }
        }
    }
    [0, 1].map(|channel| {
        let [error, total] = squares[channel];
        let percent = 100.0 * (1.0 - (error / total).sqrt());
        (seen[channel] && percent.is_finite()).then_some(percent)
    })
}
