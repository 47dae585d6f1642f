//! Checks of the recordings of a model that is a DC motor, by the rules of the built-in motor.
//!
//! A model whose states are one current and one speed, with one voltage as input, is a DC motor whatever its friction and its drive; a
//! position, a spring or gravity would need a further state. For other models the rules do not hold.

use motorfit_core::setting::{Text, text};
use motorfit_core::text::{Shortest, significant};
use motorfit_core::units::{Dimension, Unit, parse_unit};
use motorfit_evaluate::model::{ModelProblem, ModelRecording};
use motorfit_model::Model;
use motorfit_record::warning::{Location, Warning, name_of};
use motorfit_record::{Finding, Quantity, Record, Samples, diagnose};
use std::ops::Range;

/// The signals of a DC motor among those of a model.
struct Motor<'a> {
    model: &'a Model,
    voltage: usize,
    torque: Option<usize>,
    /// Outputs that are the current and the speed.
    outputs: [Option<usize>; 2],
}

/// Returns the unit of a quantity in which the rules are written.
fn unit(quantity: Quantity) -> Unit {
    parse_unit(quantity.unit()).unwrap_or(Unit::ONE)
}

/// Returns the only item of a quantity; `None` if there is none, or an error if there are several.
fn only(units: impl Iterator<Item = Dimension>, quantity: Quantity) -> Result<Option<usize>, ()> {
    let mut own = units.enumerate().filter(|(_, of)| *of == unit(quantity).dimension).map(|(n, _)| n);
    let first = own.next();
    if own.next().is_some() { Err(()) } else { Ok(first) }
}

impl<'a> Motor<'a> {
    /// Returns the signals of a motor; `None` if the model is another machine.
    fn new(model: &'a Model) -> Option<Self> {
        let inputs = |quantity| only(model.inputs().iter().map(|of| of.unit.unit.dimension), quantity).ok();
        let outputs = |quantity| only(model.outputs().iter().map(|of| of.unit.unit.dimension), quantity).ok();
        let states = |quantity| only(model.states().iter().map(|of| of.unit.unit.dimension), quantity).ok();
        let is_motor =
            model.states().len() == 2 && states(Quantity::Current)?.is_some() && states(Quantity::Speed)?.is_some();
        let (voltage, torque) = (inputs(Quantity::Voltage)??, inputs(Quantity::Torque)?);
        let outputs = [outputs(Quantity::Current)?, outputs(Quantity::Speed)?];
        let is_whole = model.inputs().len() == 1 + usize::from(torque.is_some())
            && model.outputs().len() == outputs.iter().flatten().count();
        (is_motor && is_whole).then_some(Self { model, voltage, torque, outputs })
    }

    /// Returns a recording as one of the built-in motor; `None` if its samples are not those that were measured, as after a change of the
    /// rate, or if it is not a recording of a motor.
    fn record(&self, recording: &ModelRecording) -> Option<Record> {
        let is_scattered = (0..recording.measured.len()).any(|output| recording.is_scattered(output));
        if recording.effective_sample_ratio < 1.0 || is_scattered {
            return None;
        }
        let model = self.model;
        let input = |n: usize, of| taken(&recording.inputs[n], model.inputs()[n].unit.unit, of);
        let output = |n: usize, of| taken(recording.measured[n].as_ref()?, model.outputs()[n].unit.unit, of);
        let torque = self.torque.and_then(|n| input(n, Quantity::Torque));
        let samples = Samples {
            time_s: recording.time_s.clone(),
            voltage: input(self.voltage, Quantity::Voltage)?,
            torque: torque.filter(|torque| torque.iter().any(|value| *value != 0.0)),
            current: self.outputs[0].and_then(|n| output(n, Quantity::Current)),
            speed: self.outputs[1].and_then(|n| output(n, Quantity::Speed)),
            named: Vec::new(),
        };
        let masked = |n: &usize| !(0..recording.measured.len()).any(|output| recording.counts(output, *n));
        let masked: Vec<usize> = (0..recording.len()).filter(masked).collect();
        let runs = masked.chunk_by(|a, b| a + 1 == *b).map(|run| run[0]..run[run.len() - 1] + 1);
        Record::of_parts(samples, runs).ok()
    }

    /// Returns the name of a signal in the model.
    fn name(&self, quantity: Quantity) -> Option<&str> {
        let output = |n: usize| Some(self.model.outputs()[self.outputs[n]?].name.as_str());
        match quantity {
            Quantity::Voltage => Some(&self.model.inputs()[self.voltage].name),
            Quantity::Current => output(0),
            Quantity::Speed => output(1),
            _ => None,
        }
    }

    /// Returns the remedy of a finding in place of one that names settings of the built-in motor alone; `None` if its own holds.
    fn remedy(&self, finding: &Finding, recording: &ModelRecording) -> Option<Text> {
        let name = self.name(finding.quantity)?;
        // A column may be in another unit than the finding.
        let less = || text!([Columns = "{name}=HEADING-VALUE"] ".");
        let is_cut_off = finding.figures.iter().any(|(name, _)| *name == "samples");
        Some(match finding.code {
            "sign_reversed" => text!("Reverse its sign: " [Columns = "{name}=HEADING*-1"] "."),
            "units" => text!("If it is, name the unit: " [Columns = "{name}=HEADING:UNIT"] "."),
            "rest_offset" => text!("If it is the sensor's offset, subtract it: ").and(less()),
            "idle_input" => text!("If that is the drive's idle command, subtract it: ").and(less()),
            // A drive that limits the current has no such figure: there the recorded voltage is not that of the motor.
            "current_clipped" if is_cut_off => exclude(recording, finding.places.iter().cloned()),
            "undersampled_input" if !finding.places.is_empty() => exclude(recording, finding.places.iter().cloned()),
            "voltage_without_current" => {
                "Leave that part out, or record the voltage at the motor: a disabled drive does not short it.".into()
            }
            _ => return None,
        })
    }
}

/// Largest number of intervals in a suggested mask.
const INTERVALS: usize = 10;

/// Returns the remedy that excludes ranges of samples.
pub(super) fn exclude(recording: &ModelRecording, ranges: impl Iterator<Item = Range<usize>>) -> Text {
    // Half a step around a range, so that the interval is not empty.
    let margin = |n: usize| 0.5 * recording.step(n);
    let bound = |seconds: f64| Shortest(significant(seconds, 9).parse().unwrap_or(seconds)).to_string();
    let interval = |range: Range<usize>| {
        let (first, last) = (range.start, range.end - 1);
        let ends = [recording.time_s[first] - margin(first), recording.time_s[last] + margin(last)];
        ends.map(bound).join(":")
    };
    let intervals: Vec<String> = ranges.take(INTERVALS).map(interval).collect();
    text!("Exclude the samples: " [Mask = "{}", intervals.join(",")] ".")
}

/// Returns values in the unit of a quantity.
fn taken(values: &[f64], from: Unit, quantity: Quantity) -> Option<Vec<f64>> {
    let (factor, offset) = from.to(&unit(quantity))?;
    Some(values.iter().map(|value| value * factor + offset).collect())
}

/// Returns the findings about the recordings of a model that is a DC motor; none for another machine.
pub(super) fn of_recordings(problem: &ModelProblem) -> Vec<Warning> {
    let Some(motor) = Motor::new(problem.model()) else { return Vec::new() };
    let is_averaged = problem.model().outputs().iter().any(|output| output.is_averaged());
    let of = |number: usize| {
        let recording = problem.recording(number);
        let Some(record) = motor.record(recording) else { return Vec::new() };
        let name = recording.name.clone().unwrap_or_else(|| name_of(&record));
        let warning = |finding: Finding| {
            let remedy = motor.remedy(&finding, recording);
            let own = Warning::found(&record, finding);
            let place = Location { recording: Some(name.clone()), ..own.place.unwrap_or_default() };
            Warning { place: Some(place), remedy: remedy.or(own.remedy), ..own }
        };
        let findings = diagnose(&record).into_iter().filter(|of| of.is_visible(&record));
        findings.filter(|of| !(is_averaged && of.code == "averaged_sensor")).map(warning).collect()
    };
    (0..problem.recordings()).flat_map(of).collect()
}
