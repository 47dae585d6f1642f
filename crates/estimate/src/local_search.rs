//! Levenberg–Marquardt in the criterion of a search: the local search of a multistart.
//!
//! Residuals are divided by the scale of the criterion, so that its weighted sum of squares is minimized, with the initial states of
//! the search. Criteria of magnitudes and with weights over time are evaluated at the optimum of the squares.

use super::descent::Descent;
use super::fit::Fit;
use super::fitted::Sigma;
use motorfit_core::numeric::{count, index};
use motorfit_evaluate::{Problem, Scalar, Signals};
use std::sync::Arc;

/// Length of a step, relative to the root of the weighted squares of the measured signals, below which a descent ends: the next one
/// would change the cost by less than rounding.
const TOLERANCE: f64 = 1e-9;

/// Descends from `start` with at most `evaluations` evaluations, where a simulation with derivatives counts as one and one more for
/// each free parameter. Returns the values of the end, its cost, and the number of evaluations. The cost is +∞ if there are too few
/// evaluations, or if the motor diverges at the start.
#[must_use]
pub fn descend(problem: &Problem, start: &[f64], evaluations: u64) -> (Vec<f64>, f64, u64) {
    let each = 1 + problem.space().free().len() as u64;
    let failed = |evaluations: u64| (start.to_vec(), f64::INFINITY, evaluations);
    // The cost of the end is one more evaluation.
    let simulations = evaluations.saturating_sub(1) / each;
    if simulations == 0 || start.len() != problem.space().free().len() {
        return failed(0);
    }
    let problem = problem.with_known_initial();
    let fit = Fit::new(&problem);
    let sigma = scales(&problem);
    let Some(descent) = Descent::new(&fit, &fit.start(start), &sigma) else { return failed(each) };
    let mut descent = descent.at_most(index(simulations - 1));
    descent.run(TOLERANCE * signal_length(&problem, &sigma));
    let (values, simulations) = (fit.values(&descent.at), descent.evaluations);
    let cost = Scalar::cost(&problem, &values);
    let cost = if cost.is_nan() { f64::INFINITY } else { cost };
    (values, cost, 1 + simulations as u64 * each)
}

/// Returns the divisors of the residuals of each recording and channel.
fn scales(problem: &Problem) -> Sigma {
    // The sum of magnitudes is divided by the scale, that of squares by its square.
    let is_absolute = problem.criterion().is_absolute();
    let divisor = |factor: f64| match factor > 0.0 {
        true if is_absolute => 1.0 / factor,
        true => 1.0 / factor.sqrt(),
        false => 1.0,
    };
    problem.signals().iter().map(|signals| signals.factor.map(divisor).to_vec()).collect()
}

/// Returns the root of the squares of the measured signals, weighted as the residuals.
fn signal_length(problem: &Problem, sigma: &Sigma) -> f64 {
    let one = |(signals, sigma): (&Arc<Signals>, &Vec<f64>)| {
        let channel = |channel: usize| {
            let length = signals.rms(channel) / sigma[channel];
            if signals.has(channel) { length * length * count(signals.count(channel)) } else { 0.0 }
        };
        channel(0) + channel(1)
    };
    problem.signals().iter().zip(sigma).map(one).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulated::simulated;
    use motorfit_evaluate::Model;
    use motorfit_evaluate::criterion::{Criterion, Norm};
    use motorfit_motor::{Parameters, Space};
    use motorfit_record::{Record, Samples};

    /// Returns a recording of a step with noise that is white by its sequence: the sine of squares.
    fn record() -> Record {
        let time_s: Vec<f64> = (0..801).map(|n| f64::from(n) * 0.001).collect();
        let voltage = (0..801).map(|n| if n < 100 { 0.0 } else { 10.5 }).collect();
        let clean = simulated(time_s, voltage, None).samples().clone();
        let noisy = |signal: Option<Vec<f64>>, sigma: f64| {
            let noise = |(n, value): (usize, f64)| value + sigma * (count(n) * count(n)).sin();
            signal.map(|signal| signal.into_iter().enumerate().map(noise).collect())
        };
        let (current, speed) = (noisy(clean.current, 0.2), noisy(clean.speed, 1.5));
        Record::new(Samples {
            time_s: clean.time_s,
            voltage: clean.voltage,
            torque: None,
            current,
            speed,
            ..Samples::default()
        })
        .unwrap()
    }

    #[test]
    fn a_descent_ends_at_an_optimum_of_the_criterion() {
        let start = [0.5, 0.01, 0.06, 5e-4, 2e-4];
        for norm in [Norm::Nrmse, Norm::Euclidean, Norm::Ise, Norm::Mse] {
            let criterion = Criterion { norm, ..Criterion::default() };
            let problem = Problem::new(&[record()], Model::default(), Space::table2(), criterion).unwrap();
            let (values, cost, evaluations) = descend(&problem, &start, 10_000);
            assert!(evaluations < 400 && evaluations % 6 == 1, "{norm:?}: {evaluations}");
            assert!((cost / Scalar::cost(&problem, &values) - 1.0).abs() < 1e-15);
            assert!(cost < Scalar::cost(&problem, &Parameters::M2.to_array()), "below that of the true parameters");
            for axis in 0..5 {
                for factor in [0.9999, 1.0001] {
                    let mut beside = values.clone();
                    beside[axis] *= factor;
                    assert!(Scalar::cost(&problem, &beside) > cost, "{norm:?}: axis {axis} by {factor}");
                }
            }
        }
    }

    #[test]
    fn magnitudes_are_divided_by_the_scale() {
        // The optimum of the squares is the same, whatever the norm that is evaluated there.
        let values = |norm: Norm| {
            let criterion = Criterion { norm, ..Criterion::default() };
            let problem = Problem::new(&[record()], Model::default(), Space::table2(), criterion).unwrap();
            descend(&problem, &[0.5, 0.01, 0.06, 5e-4, 2e-4], 10_000).0
        };
        for (squares, magnitudes) in values(Norm::Ise).iter().zip(values(Norm::Iae)) {
            assert!((squares / magnitudes - 1.0).abs() < 1e-7, "{squares} {magnitudes}");
        }
    }

    #[test]
    fn evaluations_are_limited_and_initial_states_are_kept() {
        let problem = Problem::new(&[record()], Model::default(), Space::table2(), Criterion::default()).unwrap();
        let start = [0.5, 0.01, 0.06, 5e-4, 2e-4];
        assert_eq!(descend(&problem, &start, 6), (start.to_vec(), f64::INFINITY, 0));
        assert_eq!(descend(&problem, &start, 7).2, 7);
        assert!(descend(&problem, &start, 20).2 <= 20);
        // A recording that begins in motion: a search simulates it from the measured state.
        let whole = record();
        let samples = whole.samples();
        let from = |signal: &Option<Vec<f64>>| signal.as_ref().map(|signal| signal[150..].to_vec());
        let (time_s, voltage) = (samples.time_s[150..].to_vec(), samples.voltage[150..].to_vec());
        let (current, speed) = (from(&samples.current), from(&samples.speed));
        let moving =
            Record::new(Samples { time_s, voltage, torque: None, current, speed, ..Samples::default() }).unwrap();
        let problem = Problem::new(&[moving], Model::default(), Space::table2(), Criterion::default()).unwrap();
        assert!(problem.signals()[0].initial_is_free);
        let (values, cost, _) = descend(&problem, &start, 10_000);
        assert!((cost / Scalar::cost(&problem, &values) - 1.0).abs() < 1e-15);
    }
}
