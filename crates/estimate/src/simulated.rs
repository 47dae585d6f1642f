//! Simulated recordings for tests.

use super::refine::fit_problem;
use motorfit_evaluate::Model;
use motorfit_motor::{Parameters, Space};
use motorfit_record::{Record, Samples};

/// Returns a noise-free recording of the M2 motor from rest under a voltage \[V\] and a torque \[N·m\].
pub(super) fn simulated(time_s: Vec<f64>, voltage: Vec<f64>, torque: Option<Vec<f64>>) -> Record {
    let samples = Samples { speed: Some(time_s.clone()), time_s, voltage, torque, ..Samples::default() };
    let problem = fit_problem(&[Record::new(samples.clone()).unwrap()], &Space::table2(), Model::default()).unwrap();
    let [current, speed] = problem.simulate(&Parameters::M2.to_array(), 0, [0.0; 2]);
    Record::new(Samples { current: Some(current), speed: Some(speed), ..samples }).unwrap()
}
