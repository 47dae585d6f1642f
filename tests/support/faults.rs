//! Recordings with faults, and clean recordings of motors with extensions and with irregular sampling.
#![allow(clippy::unwrap_used, reason = "a test may stop")]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "small numbers"
)]

use super::varied::{KINDS, Numbers, Varied, drawn, log_uniform, noisy, numbers};
use motorfit::experiment::{Excitation, simulated};
use motorfit::motor::{Discretization, Extended, Parameter};
use motorfit::record::{Record, Samples};
use rand::RngExt as _;

/// Excitations for detection rates.
pub const EXCITATIONS: [&str; 5] = ["step", "steps", "prbs", "chirp", "triangle"];

/// Returns a clean recording of a motor with an extension, irregularly sampled with a probability of one half, and the codes of
/// findings that are true for it.
pub fn extended(seed: u64) -> (Varied, &'static [&'static str]) {
    let mut numbers = numbers(1_000_000 + seed);
    let kind = [&KINDS[..], &["triangle"]].concat()[numbers.random_range(0..KINDS.len() + 1)];
    let count = log_uniform(&mut numbers, 200.0, 6000.0) as usize;
    let (varied, mut excitation) = drawn(&mut numbers, kind, count, 600.0);
    let period = excitation.time_s[1];
    let is_irregular = numbers.random_bool(0.5);
    if is_irregular {
        let jitter = log_uniform(&mut numbers, 0.005, 0.3) * period;
        excitation.time_s.iter_mut().for_each(|t| *t += numbers.random_range(-0.5..0.5) * jitter);
    }
    let volts = excitation.voltage.iter().fold(0.0, |peak: f64, v| peak.max(v.abs()));
    let mut part = |from: f64, to: f64| log_uniform(&mut numbers, from, to);
    let (parameter, value, codes): (_, _, &'static [&'static str]) = match seed % 10 {
        0 => (Parameter::Coulomb, part(0.03, 0.4) * varied.stall, &[]),
        1 => (Parameter::DeadTime, part(0.5, 12.0) * period, &[]),
        2 => (Parameter::Latency, part(0.5, 50.0) * period, &["start_latency", "voltage_without_current"]),
        3 => (Parameter::Offset, part(0.005, 0.1) * volts, &["rest_offset", "motion_without_input"]),
        4 => (Parameter::BrushDrop, part(0.01, 0.2) * volts, &[]),
        5 => (Parameter::Deadband, part(0.01, 0.4) * volts, &[]),
        6 => (Parameter::Saturation, part(0.5, 1.0) * volts, &["speed_saturates"]),
        7 => (Parameter::CurrentAverage, part(2.0, 32.0).round(), &["averaged_sensor", "sign_reversed"]),
        8 => (Parameter::SpeedAverage, part(2.0, 32.0).round(), &["averaged_sensor", "sign_reversed"]),
        _ => (Parameter::Load, 0.0, &[]),
    };
    let motor = Extended::from(&varied.motor).with(parameter, value);
    let clean = simulated(motor, &excitation, Discretization::Zoh).unwrap();
    let record = measured(&mut numbers, &clean, [20.0, 60.0]);
    (Varied { record, ..varied }, codes)
}

/// Adds noise to each signal, `from` to `to` dB below its rms.
pub fn measured(numbers: &mut Numbers, clean: &Record, [from, to]: [f64; 2]) -> Record {
    let mut samples: Samples = clean.samples().clone();
    for signal in [&mut samples.current, &mut samples.speed].into_iter().flatten() {
        let decibels = numbers.random_range(from..to);
        noisy(numbers, signal, decibels);
    }
    Record::new(samples).unwrap()
}

/// Motor under an excitation, to which faults are added.
pub struct Bench {
    pub numbers: Numbers,
    pub varied: Varied,
    pub excitation: Excitation,
}

impl Bench {
    pub fn new(seed: u64, kind: &'static str) -> Self {
        let mut numbers = numbers(7_000_000 + seed);
        let count = log_uniform(&mut numbers, 800.0, 4000.0) as usize;
        let (varied, excitation) = drawn(&mut numbers, kind, count, 0.1 * count as f64);
        Self { numbers, varied, excitation }
    }

    /// Returns a recording in which `voltage` acts on the motor but that of the excitation is recorded, with noise 30 to 50 dB
    /// below the signals.
    pub fn under(&mut self, voltage: Vec<f64>) -> Record {
        let excitation = Excitation { voltage, ..self.excitation.clone() };
        let clean = simulated(&self.varied.motor, &excitation, Discretization::Zoh).unwrap();
        let mut samples = measured(&mut self.numbers, &clean, [30.0, 50.0]).samples().clone();
        samples.voltage.clone_from(&self.excitation.voltage);
        Record::new(samples).unwrap()
    }

    /// Returns the recording without fault.
    pub fn clean(&mut self) -> Record {
        let voltage = self.excitation.voltage.clone();
        self.under(voltage)
    }
}

/// Returns the standard deviation of a signal.
pub fn spread(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

/// Adds a fault of strength 0, 1 or 2 to the recording of a bench; `None` if the excitation does not allow it.
pub type Fault = fn(&mut Bench, usize) -> Option<Record>;

/// Faults: expected code, name, function, and the lowest strength that must be found.
pub const FAULTS: [(&str, &str, Fault, usize); 9] = [
    ("current_clipped", "one side", one_sided, 0),
    ("current_clipped", "magnitude", magnitude, 0),
    ("voltage_without_current", "both", |bench, strength| off(bench, strength, true), 0),
    ("voltage_without_current", "current alone", |bench, strength| off(bench, strength, false), 1),
    ("speed_saturates", "saturation", saturated, 1),
    ("start_latency", "speed alone", late, 2),
    ("no_motion", "at rest", still, 0),
    ("input_reset", "last samples", reset, 0),
    ("units", "mA", milliamperes, 0),
];

/// Returns the largest and the smallest value.
fn extremes(values: &[f64]) -> [f64; 2] {
    values.iter().fold([f64::NEG_INFINITY, f64::INFINITY], |[high, low], v| [high.max(*v), low.min(*v)])
}

/// Returns the recording if its current is negative for enough samples that a unipolar sensor falsifies it.
fn braking(bench: &mut Bench) -> Option<Samples> {
    let samples = bench.clean().samples().clone();
    let current = samples.current.as_ref().unwrap();
    let [high, _] = extremes(current);
    let negative = current.iter().filter(|i| **i < -0.2 * high).count();
    (negative >= 12 && 20 * negative > current.len() && high > 0.0).then_some(samples)
}

/// Clips the current at 0 A and adds noise of 0.5, 0.2 or 0 % of the largest current.
fn one_sided(bench: &mut Bench, strength: usize) -> Option<Record> {
    let mut samples = braking(bench)?;
    let current = samples.current.as_mut().unwrap();
    let [high, _] = extremes(current);
    let noise = [0.005, 0.002, 0.0][strength] * high;
    current.iter_mut().for_each(|i| *i = i.max(0.0) + noise * bench.numbers.random_range(-1.0..1.0));
    Some(Record::new(samples).unwrap())
}

/// Replaces the current by its magnitude and adds noise of 0.5, 0.2 or 0 % of the largest current.
fn magnitude(bench: &mut Bench, strength: usize) -> Option<Record> {
    let mut samples = braking(bench)?;
    let current = samples.current.as_mut().unwrap();
    let [high, _] = extremes(current);
    let noise = [0.005, 0.002, 0.0][strength] * high;
    current.iter_mut().for_each(|i| *i = i.abs() + noise * bench.numbers.random_range(-1.0..1.0));
    Some(Record::new(samples).unwrap())
}

/// Switches the drive off for a first part of the recording, from the first voltage on.
fn off(bench: &mut Bench, strength: usize, has_speed: bool) -> Option<Record> {
    let count = bench.excitation.voltage.len();
    let begin = bench.numbers.random_range(0..2) * bench.excitation.voltage.iter().position(|v| *v != 0.0)?;
    // The voltage starts at the first sample, or after a rest.
    bench.excitation.voltage.rotate_left(begin);
    let first = bench.excitation.voltage.iter().position(|v| *v != 0.0)?;
    let until = first + count * [5, 10, 20][strength] / 100;
    let volts = extremes(&bench.excitation.voltage).map(f64::abs).into_iter().fold(0.0, f64::max);
    let strong = |v: &&f64| v.abs() > 0.6 * volts;
    if bench.excitation.voltage[first..until].iter().filter(strong).count() < 20 {
        return None;
    }
    let mut got = bench.excitation.voltage.clone();
    got[..until].fill(0.0);
    let mut samples = bench.under(got).samples().clone();
    if !has_speed {
        samples.speed = None;
    }
    Some(Record::new(samples).unwrap())
}

/// Limits the voltage to a fraction of the largest command; only the speed is recorded. Saturations that resemble a
/// second-order lag or a deadband cannot be found.
fn saturated(bench: &mut Bench, strength: usize) -> Option<Record> {
    let volts = extremes(&bench.excitation.voltage).map(f64::abs).into_iter().fold(0.0, f64::max);
    let limit = [0.8, 0.65, 0.5][strength] * volts;
    let got: Vec<f64> = bench.excitation.voltage.iter().map(|v| v.clamp(-limit, limit)).collect();
    // A limited voltage of one level is like a lower voltage.
    if !matches!(bench.varied.kind, "triangle" | "chirp") {
        return None;
    }
    // Under a voltage much faster than the motor only the amplitude of the speed decreases, as with another K.
    let without_noise = |voltage: Vec<f64>| {
        let excitation = Excitation { voltage, ..bench.excitation.clone() };
        simulated(&bench.varied.motor, &excitation, Discretization::Zoh).unwrap().samples().speed.clone().unwrap()
    };
    let [plain, flat] = [bench.excitation.voltage.clone(), got.clone()].map(without_noise);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (of_plain, of_flat) = (dot(&plain, &flat) / dot(&plain, &plain), dot(&flat, &flat));
    if 1.0 - of_plain * dot(&plain, &flat) / of_flat < SEEN * SEEN {
        return None;
    }
    let mut samples = bench.under(got).samples().clone();
    samples.current = None;
    Some(Record::new(samples).unwrap())
}

/// Smallest relative difference of the speed from the scaled speed without saturation at which a saturation must be found.
const SEEN: f64 = 0.08;

/// Delays the start of motion under a voltage from the first sample on; only the speed is recorded.
fn late(bench: &mut Bench, strength: usize) -> Option<Record> {
    let mut samples = off(bench, strength, true)?.samples().clone();
    samples.current = None;
    Some(Record::new(samples).unwrap())
}

/// Replaces the speed by that of a motor at rest: noise, zero, or the flicker of an encoder.
fn still(bench: &mut Bench, strength: usize) -> Option<Record> {
    let mut samples = bench.clean().samples().clone();
    let count = samples.time_s.len();
    let numbers = &mut bench.numbers;
    let speed = match strength {
        0 => (0..count).map(|_| numbers.random_range(-0.1..0.1)).collect(),
        1 => (0..count).map(|n| if n % 500 == 499 { 0.5 } else { 0.0 }).collect(),
        _ => vec![0.0; count],
    };
    if bench.varied.kind == "step" {
        // The voltage is present from the first sample on.
        let volts = samples.voltage[count - 1];
        samples.voltage.fill(volts);
    }
    (samples.speed, samples.current) = (Some(speed), None);
    Some(Record::new(samples).unwrap())
}

/// Sets the voltage to zero in the last one, two or three samples.
fn reset(bench: &mut Bench, strength: usize) -> Option<Record> {
    let voltage = &mut bench.excitation.voltage;
    let count = voltage.len();
    let rest = voltage.iter().take_while(|v| **v == 0.0).count();
    let zero = voltage[rest..].contains(&0.0);
    let [high, low] = extremes(voltage);
    // If zero is one of the levels, or the voltage is small at the end, this is not a fault.
    if zero || voltage[count - 5..].iter().any(|v| v.abs() < 0.4 * (high - low)) {
        return None;
    }
    voltage[count - 1 - strength..].fill(0.0);
    if bench.numbers.random_bool(0.5) {
        voltage.drain(..rest);
        bench.excitation.time_s.truncate(count - rest);
    }
    Some(bench.clean())
}

/// Records the current in mA under a heading in A, as integers or with a decimal.
fn milliamperes(bench: &mut Bench, strength: usize) -> Option<Record> {
    let mut samples = bench.clean().samples().clone();
    let digits = [1.0, 1.0, 10.0][strength];
    samples.current.iter_mut().flatten().for_each(|i| *i = (1000.0 * *i * digits).round() / digits);
    Some(Record::new(samples).unwrap())
}
