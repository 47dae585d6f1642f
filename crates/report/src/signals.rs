//! Signals as figures show them: simulated outputs, and the form of the input.

use super::chart::Form;
use motorfit_evaluate::criterion::{Criterion, Scale};
use motorfit_evaluate::{Initial, Model, Problem};
use motorfit_motor::{Discretization, Parameters, Space, simulate};
use motorfit_record::Record;

/// Simulates a motor under the input of a recording and returns current \[A\] and speed \[rad/s\]; both are empty if the
/// recording cannot be simulated.
#[must_use]
pub fn model(record: &Record, parameters: &Parameters, initial: [f64; 2], how: Discretization) -> [Vec<f64>; 2] {
    // The inputs are taken from a problem, as in the fit, because preparation may have changed them.
    let criterion = Criterion { scale: Scale::None, ..Criterion::default() };
    let model = Model { discretization: how, initial: Initial::Measured };
    let Ok(problem) = Problem::new(std::slice::from_ref(record), model, Space::table2(), criterion) else {
        return Default::default();
    };
    simulate(parameters, &problem.signals()[0].drive(), initial, problem.model().discretization)
}

/// Returns the form in which the input is drawn: straight lines if it changes linearly between samples.
pub(super) fn input_form(record: &Record) -> Form {
    if record.slope().is_empty() { Form::Steps } else { Form::Line }
}
