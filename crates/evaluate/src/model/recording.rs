//! Recordings as a model needs them: its inputs and measured outputs, in its units.

use motorfit_core::numeric::count;
use motorfit_core::setting::text;
use motorfit_core::text::quoted;
use motorfit_core::{Error, Result};
use motorfit_model::step::open_states;
use motorfit_model::{BuiltIn, InitialState, Model};
use motorfit_record::warning::name_of;
use motorfit_record::{AssumedUnits, Quantity, Record, SignalRequest, step_lengths};

/// Returns the signals that the import reads for a model: its inputs, then its outputs.
#[must_use]
pub fn signal_requests(model: &Model) -> Vec<SignalRequest> {
    let inputs = model.inputs().iter().map(|input| SignalRequest {
        name: input.name.clone(),
        column: input.column.clone(),
        unit_text: input.unit.text.clone(),
        unit: input.unit.unit,
        is_input: true,
        is_optional: input.default.is_some(),
    });
    let outputs = model.outputs().iter().map(|output| SignalRequest {
        name: output.name.clone(),
        column: output.column.clone(),
        unit_text: output.unit.text.clone(),
        unit: output.unit.unit,
        is_input: false,
        is_optional: true,
    });
    inputs.chain(outputs).collect()
}

/// Returns the name of a quantity in requests for the columns of a model.
fn name_of_signal(model: &Model, quantity: Quantity) -> String {
    let mut names =
        model.inputs().iter().map(|input| &input.name).chain(model.outputs().iter().map(|output| &output.name));
    match quantity {
        Quantity::Signal(number) => names.nth(usize::from(number)).cloned().unwrap_or_default(),
        other => other.key().to_owned(),
    }
}

/// Returns the initial values of the states that are measured or free, in their units: the first sample, or 0.
pub(super) fn open_initial(model: &Model, recording: &ModelRecording) -> Vec<f64> {
    let value = |state: &usize| {
        let state = &model.states[*state];
        let InitialState::Measured(output) = state.initial else { return 0.0 };
        let Some(first) = recording.measured[output].as_ref().and_then(|values| values.first()) else { return 0.0 };
        let (factor, offset) = model.outputs[output].unit.unit.to(&state.unit.unit).unwrap_or((1.0, 0.0));
        first * factor + offset
    };
    open_states(model).iter().map(value).collect()
}

/// A recording of a model: inputs and measured outputs of equal length, in the units of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelRecording {
    /// Time of the samples \[s\].
    pub time_s: Vec<f64>,
    /// Step after each sample \[s\]; one value if the clock is regular.
    pub step_s: Vec<f64>,
    /// Values of the inputs, shape `[inputs][samples]`.
    pub inputs: Vec<Vec<f64>>,
    /// Measured outputs, shape `[outputs][samples]`; `None` for an output that was not measured.
    pub measured: Vec<Option<Vec<f64>>>,
    /// True for each sample of an output whose residual counts, shape `[outputs][samples]`; empty if all count.
    pub counting: Vec<Vec<bool>>,
    /// Effective sample size over the number of samples.
    pub effective_sample_ratio: f64,
    /// Name in messages, as that of its file; `None` for its number.
    pub name: Option<String>,
    /// Units that no heading of the file names.
    pub assumed: Option<AssumedUnits>,
}

impl ModelRecording {
    /// Takes the signals of a model from a recording that was read with [`signal_requests`].
    ///
    /// # Errors
    /// Returns `Data` if the recording lacks an input without a default, or all outputs.
    pub fn new(model: &Model, record: &Record) -> Result<Self> {
        let located = |error: Error| record.source().path.iter().fold(error, |error, path| error.in_file(path));
        let samples = record.samples();
        let signal = |number: usize| samples.named.iter().find(|signal| signal.number == number).map(|s| &s.values);
        let mut inputs = Vec::new();
        for (number, input) in model.inputs().iter().enumerate() {
            inputs.push(match (signal(number), input.default) {
                (Some(values), _) => values.clone(),
                (None, Some(value)) => vec![value; record.len()],
                (None, None) => {
                    let hint = text!("Name its column: " [Columns = "{}=HEADING:{}", input.name, input.unit.text] ".");
                    let message = format!("the input {} was not recorded", quoted(&input.name));
                    return Err(located(Error::data(message, hint)));
                }
            });
        }
        let first = model.inputs().len();
        let measured: Vec<Option<Vec<f64>>> =
            (0..model.outputs().len()).map(|number| signal(first + number).cloned()).collect();
        if measured.iter().all(Option::is_none) {
            let hint = "Record at least one of its outputs.";
            return Err(located(Error::data("no output of the model was recorded", hint)));
        }
        let counting = counting(record, first, measured.len());
        let steps = record.steps();
        let step_s = if steps.step_index.is_empty() {
            vec![steps.period_s]
        } else {
            (0..record.len()).map(|n| steps.step(n)).collect()
        };
        let effective_sample_ratio = record.effective_sample_ratio();
        let name = record.source().path.as_ref().map(|_| name_of(record));
        // The text of a user's model names the units of its columns.
        let is_general = BuiltIn::ALL.iter().any(|of| of.source() == model.text());
        let key = |quantity| name_of_signal(model, quantity);
        let assumed = is_general.then(|| AssumedUnits::of(record, &key)).flatten();
        let time_s = samples.time_s.clone();
        Ok(Self { time_s, step_s, inputs, measured, counting, effective_sample_ratio, name, assumed })
    }

    /// Makes a recording for a simulation from its times \[s\] and the inputs of a model. Its outputs are the times: a problem needs some
    /// that vary, and they are not used.
    ///
    /// # Errors
    /// Returns the errors of [`step_lengths`].
    #[doc(hidden)]
    pub fn to_simulate(model: &Model, time_s: Vec<f64>, inputs: Vec<Vec<f64>>) -> Result<Self> {
        let step_s = step_lengths(&time_s)?;
        let measured = model.outputs().iter().map(|_| Some(time_s.clone())).collect();
        let counting = Vec::new();
        let (name, assumed) = (None, None);
        Ok(Self { time_s, step_s, inputs, measured, counting, effective_sample_ratio: 1.0, name, assumed })
    }

    /// Returns the name in messages of the recording with a number: its own, or `recording 1` for the first.
    #[doc(hidden)]
    #[must_use]
    pub fn label(&self, number: usize) -> String {
        self.name.clone().unwrap_or_else(|| format!("recording {}", number + 1))
    }

    /// Returns the first samples.
    pub(super) fn first(&self, samples: usize) -> Self {
        let end = samples.min(self.len());
        let cut = |signal: &Vec<f64>| signal[..end].to_vec();
        Self {
            time_s: cut(&self.time_s),
            step_s: self.step_s[..self.step_s.len().min(end)].to_vec(),
            inputs: self.inputs.iter().map(cut).collect(),
            measured: self.measured.iter().map(|signal| signal.as_ref().map(cut)).collect(),
            counting: self.counting.iter().map(|counting| counting[..end].to_vec()).collect(),
            name: self.name.clone(),
            assumed: self.assumed.clone(),
            ..*self
        }
    }

    /// Returns the number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Returns true if there are no samples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// Returns the step \[s\] of a regular clock; `None` if the clock is irregular.
    #[must_use]
    pub fn regular_step_s(&self) -> Option<f64> {
        if self.step_s.len() == 1 { self.step_s.first().copied() } else { None }
    }

    /// Returns the longest step \[s\].
    #[must_use]
    pub fn longest_step_s(&self) -> f64 {
        self.step_s.iter().copied().fold(0.0, f64::max)
    }

    /// Returns the step after a sample \[s\].
    #[doc(hidden)]
    pub fn step(&self, n: usize) -> f64 {
        self.step_s.get(n).or(self.step_s.last()).copied().unwrap_or(0.0)
    }

    /// Returns true if the residual of an output at a sample counts.
    #[must_use]
    pub fn counts(&self, output: usize, n: usize) -> bool {
        self.counting.get(output).and_then(|counting| counting.get(n)).copied().unwrap_or(true)
    }

    /// Returns the number of samples of an output that count.
    #[must_use]
    pub fn count(&self, output: usize) -> usize {
        let counting = self.counting.get(output);
        counting.map_or(self.len(), |counting| counting.iter().filter(|counts| **counts).count())
    }

    /// Returns the largest number of samples of an output that count.
    #[doc(hidden)]
    pub fn count_most(&self) -> usize {
        (0..self.measured.len()).map(|output| self.count(output)).max().unwrap_or(0)
    }

    /// Returns true if the samples of an output that count are single ones between others, as of a sensor that is slower than the clock.
    #[doc(hidden)]
    pub fn is_scattered(&self, output: usize) -> bool {
        /// Fewest samples of a run that are not scattered.
        const RUN: usize = 20;
        let starts = |n: &usize| self.counts(output, *n) && (*n == 0 || !self.counts(output, n - 1));
        !self.counting.is_empty() && (0..self.len()).filter(starts).count() * RUN > self.count(output)
    }

    /// Returns the measured values of an output at the samples that count.
    #[must_use]
    pub fn counted(&self, output: usize) -> Option<Vec<f64>> {
        let measured = self.measured.get(output)?.as_ref()?;
        Some(measured.iter().enumerate().filter(|(n, _)| self.counts(output, *n)).map(|(_, value)| *value).collect())
    }

    /// Returns true if the start of a substep is the one nearest to a multiple of a period from the first sample on.
    pub(super) fn is_instant(&self, n: usize, (substep, substeps): (usize, usize), period_s: f64) -> bool {
        if n == 0 && substep == 0 {
            return true;
        }
        let before = self.step(if substep == 0 { n - 1 } else { n }) / count(substeps);
        let after = self.step(n) / count(substeps);
        let at = self.elapsed(n) + count(substep) * after;
        ((at + 0.5 * after) / period_s).floor() > ((at - 0.5 * before) / period_s).floor()
    }

    /// Returns the time since the first sample \[s\].
    pub(super) fn elapsed(&self, n: usize) -> f64 {
        match self.regular_step_s() {
            Some(step) => count(n) * step,
            None => self.time_s[n] - self.time_s[0],
        }
    }
}

/// Returns the samples of each output that count; the signals of the outputs have the numbers from `first` on.
fn counting(record: &Record, first: usize, outputs: usize) -> Vec<Vec<bool>> {
    if record.excluded().is_empty() && record.measured_at().is_empty() {
        return Vec::new();
    }
    let of = |output: usize| {
        let number = Quantity::Signal(u8::try_from(first + output).unwrap_or(u8::MAX));
        let own = record.measured_at().iter().find(|of| of.quantity == number);
        let mut counting = own.map_or_else(|| vec![true; record.len()], |of| of.samples.clone());
        for excluded in record.excluded() {
            counting[excluded.start..excluded.end].fill(false);
        }
        counting
    };
    (0..outputs).map(of).collect()
}
