//! The signals of a recording as pages and files show them, of any machine.

use motorfit_evaluate::model::ModelRecording;
use motorfit_model::{Model, ModelInput, ModelOutput};
use motorfit_record::{Quantity, Record};

/// The signals of a recording with their labels.
#[derive(Debug, Clone)]
pub struct Recorded {
    /// Times of the samples \[s\].
    pub time_s: Vec<f64>,
    /// Inputs.
    pub inputs: Vec<RecordedInput>,
    /// Outputs that are no input, measured or not.
    pub outputs: Vec<RecordedOutput>,
}

/// An input of a recording.
#[derive(Debug, Clone)]
pub struct RecordedInput {
    /// Label with the unit, as `voltage [V]`.
    pub label: String,
    /// Values at the samples.
    pub values: Vec<f64>,
    /// True if the input is linear between samples, false if it is constant.
    pub is_linear: bool,
    /// True if it is drawn: a constant input of a model is not.
    pub is_drawn: bool,
}

/// An output of a recording.
#[derive(Debug, Clone)]
pub struct RecordedOutput {
    /// Number of the output.
    pub number: usize,
    /// Name.
    pub name: String,
    /// Label with the unit, as `speed [rad/s]`.
    pub label: String,
    /// Label of its residuals with the unit.
    pub residual: String,
    /// Measured values, NaN at samples between those of a slow sensor; `None` if the output was not measured.
    pub measured: Option<Vec<f64>>,
    /// True for each sample that is not masked; empty if none is.
    pub counting: Vec<bool>,
}

impl RecordedOutput {
    /// Returns true if a sample was measured and is not masked.
    #[cfg(feature = "pages")]
    pub(super) fn counts(&self, n: usize) -> bool {
        let is_measured = self.measured.as_ref().and_then(|of| of.get(n)).is_some_and(|value| value.is_finite());
        is_measured && self.counting.get(n).copied().unwrap_or(true)
    }
}

/// Labels of current and speed, and of their residuals.
const CHANNELS: [[&str; 3]; 2] = [
    ["current", "current [A]", "residual of the current [A]"],
    ["speed", "speed [rad/s]", "residual of the speed [rad/s]"],
];

impl From<&Record> for Recorded {
    /// Returns the signals of a recording of the DC motor.
    fn from(record: &Record) -> Self {
        let by_current = record.driver() == Quantity::Current;
        let label = if by_current { "current [A], the input" } else { "voltage [V]" };
        let is_linear = !record.slope().is_empty();
        let mut inputs =
            vec![RecordedInput { label: label.to_owned(), values: record.input().to_vec(), is_linear, is_drawn: true }];
        inputs.extend(record.samples().torque.as_ref().map(|torque| RecordedInput {
            label: "load torque [N m]".to_owned(),
            values: torque.clone(),
            is_linear: false,
            is_drawn: true,
        }));
        let counting = record.counting();
        let output = |(number, [name, label, residual]): (usize, [&str; 3])| RecordedOutput {
            number,
            name: name.to_owned(),
            label: label.to_owned(),
            residual: residual.to_owned(),
            measured: record.measured()[number].map(|values| at_own(record, number, values)),
            counting: counting.iter().map(|counts| counts[number]).collect(),
        };
        let outputs = CHANNELS.into_iter().enumerate().skip(usize::from(by_current)).map(output).collect();
        Self { time_s: record.samples().time_s.clone(), inputs, outputs }
    }
}

/// Returns the values of an output of the DC motor at the samples at which it was measured, and NaN at those between.
pub(super) fn at_own(record: &Record, channel: usize, values: &[f64]) -> Vec<f64> {
    let quantity = [Quantity::Current, Quantity::Speed][channel.min(1)];
    let of = |(n, value): (usize, &f64)| if record.is_measured(quantity, n) { *value } else { f64::NAN };
    values.iter().enumerate().map(of).collect()
}

impl Recorded {
    /// Returns the inputs that are drawn.
    #[cfg(feature = "pages")]
    pub(super) fn drawn(&self) -> impl Iterator<Item = &RecordedInput> {
        self.inputs.iter().filter(|input| input.is_drawn)
    }

    /// Returns the signals of a recording of a model.
    #[must_use]
    pub fn of_model(model: &Model, recording: &ModelRecording, is_linear: bool) -> Self {
        let label = |name: &str, unit: &str| format!("{name} [{}]", unit.replace('*', "·"));
        let varies = |values: &[f64]| values.windows(2).any(|pair| pair[0].to_bits() != pair[1].to_bits());
        let input = |(input, values): (&ModelInput, &Vec<f64>)| RecordedInput {
            label: label(&input.name, &input.unit.text),
            values: values.clone(),
            is_linear,
            is_drawn: varies(values),
        };
        let output = |(number, (output, measured)): (usize, (&ModelOutput, &Option<Vec<f64>>))| {
            let is_scattered = recording.is_scattered(number);
            let own = |(n, value): (usize, &f64)| match is_scattered && !recording.counts(number, n) {
                true => f64::NAN,
                false => *value,
            };
            let label = label(&output.name, &output.unit.text);
            RecordedOutput {
                number,
                name: output.name.clone(),
                residual: format!("residual of {label}"),
                label,
                measured: measured.as_ref().map(|values| values.iter().enumerate().map(own).collect()),
                counting: recording.counting.get(number).cloned().unwrap_or_default(),
            }
        };
        let inputs = model.inputs().iter().zip(&recording.inputs);
        Self {
            time_s: recording.time_s.clone(),
            inputs: inputs.map(input).collect(),
            outputs: model.outputs().iter().zip(&recording.measured).enumerate().map(output).collect(),
        }
    }
}
