//! Responses of the best runs of a comparison: the step response of a DC motor's current, the fit of the outputs of a model, and
//! the signals of the first recording.

use super::cells::{fixed, percent};
use super::parameters::best;
use crate::signals::model;
use crate::table::{Table, dash};
use motorfit_core::text::decimals;
use motorfit_evaluate::criterion::Criterion;
use motorfit_evaluate::model::ModelProblem;
use motorfit_identify::model::fit_percent;
use motorfit_motor::{Parameters, StepResponse, response, simulate};
use motorfit_study::compare::{Block, ComparedMachine, ComparedModel, ComparedParameter, Comparison};

/// Returns the table of the responses of the best runs: of the current of a DC motor, or the fit of the outputs of a model.
pub(super) fn responses(comparison: &Comparison, block: &Block) -> Option<Table> {
    match &comparison.subject.machine {
        ComparedMachine::Motor { .. } => of_current(comparison, block),
        ComparedMachine::Model(of) => fits(of, comparison, block),
    }
}

/// Returns the candidate with these values of all parameters; `None` if it is not one of the problem.
fn candidate(problem: &ModelProblem, parameters: &[ComparedParameter], values: &[f64]) -> Option<Vec<f64>> {
    let candidate = ComparedParameter::candidate(parameters, values);
    (candidate.len() == problem.space().free.len() && problem.recordings() > 0).then_some(candidate)
}

/// Returns the table of the fits of the outputs of a model over all recordings.
fn fits(of: &ComparedModel, comparison: &Comparison, block: &Block) -> Option<Table> {
    let problem = of.problem(block.setting.criterion).ok()?;
    let outputs = of.model.outputs().iter().map(|output| output.name.as_str());
    let heads: Vec<&str> = std::iter::once("method").chain(outputs).collect();
    let mut table = Table::new("fit", "Fit of the outputs, best run [%]", &heads);
    let refined = comparison.reference.as_ref().ok().map(|found| ("refined", found.values(&comparison.parameters)));
    for (name, values) in best(comparison, block).into_iter().chain(refined) {
        let candidate = candidate(&problem, &comparison.parameters, &values)?;
        let cells = fit_percent(&problem, &candidate).into_iter();
        table.named_row(name, cells.map(|fit| fit.map_or_else(dash, percent)));
    }
    table.note(
        "100 (1 − ‖y − ŷ‖/‖y − mean y‖) over all recordings, simulated from the initial states as measured, as in the searches.",
    );
    Some(table)
}

/// Simulates machines with these values of the parameters on the first recording. Returns the outputs of each, shape
/// `[machines][outputs][samples]`: current \[A\] and speed \[rad/s\] of a DC motor, or those of the model in their units. One that
/// cannot be simulated has none.
pub(crate) fn modelled(comparison: &Comparison, all: &[(&'static str, Vec<f64>)]) -> Vec<Vec<Vec<f64>>> {
    match &comparison.subject.machine {
        ComparedMachine::Motor { .. } => {
            let how = comparison.spec.model.discretization;
            let initial = comparison.initial.first().copied().unwrap_or_default();
            let one = |values: &[f64]| {
                Some(model(comparison.subject.records.first()?, &motor(values)?, initial, how).to_vec())
            };
            all.iter().map(|(_, values)| one(values).unwrap_or_default()).collect()
        }
        ComparedMachine::Model(of) => {
            let problem = of.problem(Criterion::default()).ok();
            let one = |values: &[f64]| {
                let problem = problem.as_ref()?;
                let candidate = candidate(problem, &comparison.parameters, values)?;
                Some(problem.simulate(&candidate, 0, problem.open_initial(0)).outputs)
            };
            all.iter().map(|(_, values)| one(values).unwrap_or_default()).collect()
        }
    }
}

/// Returns the columns of the first recording with their headings, and of its simulations by the best run of each method of the first
/// block.
#[must_use]
pub fn curves(comparison: &Comparison) -> (Vec<String>, Vec<Vec<f64>>) {
    let (mut heads, mut columns) = recorded(comparison);
    let all = comparison.blocks.first().map_or_else(Vec::new, |block| best(comparison, block));
    for ((name, _), outputs) in all.iter().zip(modelled(comparison, &all)) {
        match comparison.subject.model() {
            None => heads.extend(["current_A", "speed_rad_s"].map(|of| format!("{name}_{of}"))),
            Some(of) => heads.extend(
                of.model.outputs().iter().map(|output| format!("{} {name} [{}]", output.name, output.unit.text)),
            ),
        }
        columns.extend(outputs);
    }
    (heads, columns)
}

/// Returns the columns of the first recording with their headings.
fn recorded(comparison: &Comparison) -> (Vec<String>, Vec<Vec<f64>>) {
    let mut heads = vec!["time_s".to_owned()];
    if let Some(of) = comparison.subject.model() {
        let Some(recording) = of.recordings.first() else { return Default::default() };
        let none = || vec![f64::NAN; recording.len()];
        let inputs = of.model.inputs().iter().map(|input| format!("{} [{}]", input.name, input.unit.text));
        let outputs = of.model.outputs().iter().map(|output| format!("{} [{}]", output.name, output.unit.text));
        heads.extend(inputs.chain(outputs));
        let measured = recording.measured.iter().map(|measured| measured.clone().unwrap_or_else(none));
        let signals = recording.inputs.iter().cloned().chain(measured);
        return (heads, std::iter::once(recording.time_s.clone()).chain(signals).collect());
    }
    let Some(record) = comparison.subject.records.first() else { return Default::default() };
    let samples = record.samples();
    let none = || vec![f64::NAN; record.len()];
    heads.extend(["voltage_V", "current_A", "speed_rad_s"].map(str::to_owned));
    let (current, speed) = (samples.current.clone(), samples.speed.clone());
    let signals = [current.unwrap_or_else(none), speed.unwrap_or_else(none)];
    (heads, [vec![samples.time_s.clone(), samples.voltage.clone()], signals.to_vec()].concat())
}

/// Returns the DC motor with these values of the parameters; `None` unless there are five.
pub(super) fn motor(values: &[f64]) -> Option<Parameters> {
    values.try_into().ok().map(Parameters::from_array)
}

/// Simulates a motor under the input of the first recording; returns current \[A\] and speed \[rad/s\].
pub(super) fn simulated(comparison: &Comparison, motor: &Parameters) -> Option<[Vec<f64>; 2]> {
    let drive = motorfit_evaluate::experiment::drive(comparison.subject.records.first()?);
    let initial = comparison.initial.first().copied().unwrap_or_default();
    Some(simulate(motor, &drive, initial, comparison.spec.model.discretization))
}

/// Returns the response of the current of a motor under the input of the first recording, with settling bands of 2 %
/// and 5 %.
pub(super) fn current_of(comparison: &Comparison, motor: &Parameters) -> Option<[StepResponse; 2]> {
    in_bands(&comparison.subject.records.first()?.samples().time_s, &simulated(comparison, motor)?[0])
}

fn in_bands(time: &[f64], current: &[f64]) -> Option<[StepResponse; 2]> {
    Some([response(time, current, 0.02)?, response(time, current, 0.05)?])
}

/// Formats a settling time.
pub(super) fn settled(time: Option<f64>) -> String {
    time.map_or("never".to_owned(), |t| decimals(t, 3))
}

/// Returns the table of peak, settling and steady state of the current.
fn of_current(comparison: &Comparison, block: &Block) -> Option<Table> {
    let samples = comparison.subject.records.first()?.samples();
    let measured = in_bands(&samples.time_s, samples.current.as_ref()?)?;
    let heads = ["method", "peak [A]", "at [s]", "over [%]", "2 % [s]", "5 % [s]", "steady [A]", "error [A]"];
    let mut table = Table::new("response", "Current of the first recording, best run", &heads);
    let found = best(comparison, block).into_iter();
    let found = found.filter_map(|(name, values)| Some((name, current_of(comparison, &motor(&values)?)?)));
    for (name, [two, five]) in std::iter::once(("measured", measured)).chain(found) {
        table.named_row(
            name,
            [
                decimals(two.peak, 4),
                decimals(two.peak_time_s, 3),
                two.overshoot_percent.map_or_else(dash, |o| decimals(o, 0)),
                settled(two.settling_time_s),
                settled(five.settling_time_s),
                decimals(two.steady_state, 4),
                fixed(two.steady_state - measured[0].steady_state),
            ],
        );
    }
    table.note(
        "over: overshoot. 2 % and 5 %: settling times into these bands around the mean over the last tenth of the recording.",
    );
    Some(table)
}
