//! How well a simulation fits.

use crate::criterion::mean;
use crate::evaluate::Problem;
use crate::record::Record;

/// 100 (1 − ‖y − ŷ‖/‖y − mean y‖) per channel, norms over all recordings, and the standard deviation of the residuals.
pub(super) fn of(records: &[Record], problem: &Problem, candidate: &[f64]) -> ([Option<f64>; 2], [Option<f64>; 2]) {
    let mut squares = [[0.0; 2]; 2];
    let mut count = [0.0; 2];
    for (recording, (record, signals)) in records.iter().zip(problem.signals()).enumerate() {
        let model = problem.simulate(candidate, recording, signals.initial());
        for (channel, (measured, simulated)) in record.measured().into_iter().zip(model).enumerate() {
            let Some(measured) = measured else { continue };
            let counting: Vec<f64> =
                measured.iter().enumerate().filter(|(n, _)| signals.counts(channel, *n)).map(|(_, y)| *y).collect();
            let mean = mean(&counting);
            for (_, (y, y_hat)) in
                measured.iter().zip(simulated).enumerate().filter(|(n, _)| signals.counts(channel, *n))
            {
                count[channel] += 1.0;
                squares[channel][0] += (y - y_hat) * (y - y_hat);
                squares[channel][1] += (y - mean) * (y - mean);
            }
        }
    }
    let finite = |value: f64, channel: usize| (count[channel] > 0.0 && value.is_finite()).then_some(value);
    (
        [0, 1].map(|c| finite(100.0 * (1.0 - (squares[c][0] / squares[c][1]).sqrt()), c)),
        [0, 1].map(|c| finite((squares[c][0] / count[c]).sqrt(), c)),
    )
}
