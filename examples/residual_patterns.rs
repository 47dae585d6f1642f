//! The residuals of the linear model for motors with one more effect each: a figure with a row per extension.
//!
//! Each motor is simulated with 40 dB of white noise and fitted without extensions.
//!
//! ```sh
//! cargo run --release --example residual_patterns docs/figures/residuals.svg
//! ```
#![allow(clippy::print_stdout, reason = "an example prints")]

use motorfit::criterion::Noise;
use motorfit::experiment::{Excitation, noise_of, simulated, with_noise};
use motorfit::identify::{IdentifySpec, identify};
use motorfit::motor::{Discretization, Extended, Parameter, Parameters};
use motorfit::record::Record;
use motorfit::report::figures::model;
use motorfit::report::{ResidualRow, residual_panels};

/// Levels of the voltage \[V\]: both directions, large and small, and zero at the end.
const LEVELS: [f64; 9] = [0.0, 2.0, 8.0, -8.0, -2.0, 5.0, -5.0, 0.4, 0.0];
const SAMPLES_PER_LEVEL: usize = 50;
const PERIOD_S: f64 = 0.004;

/// The effects and their values in SI units, added to the motor of the paper.
const EFFECTS: [(&str, Option<(Parameter, f64)>); 11] = [
    ("none (the linear model is right)", None),
    ("coulomb, Tc = 0.03 N·m", Some((Parameter::Coulomb, 0.03))),
    ("load, TL = 0.03 N·m", Some((Parameter::Load, 0.03))),
    ("dead-time, td = 4 ms", Some((Parameter::DeadTime, 0.004))),
    ("latency, t0 = 30 ms", Some((Parameter::Latency, 0.03))),
    ("offset, v0 = 0.3 V", Some((Parameter::Offset, 0.3))),
    ("brush-drop, vb = 0.6 V", Some((Parameter::BrushDrop, 0.6))),
    ("deadband, vd = 0.6 V", Some((Parameter::Deadband, 0.6))),
    ("saturation, vs = 6 V", Some((Parameter::Saturation, 6.0))),
    ("direction-gain, gn = 0.85", Some((Parameter::NegativeGain, 0.85))),
    ("sensor-average, Nw = 8 samples", Some((Parameter::SpeedAverage, 8.0))),
];

/// Returns the recording of a motor with one effect more than the linear model has.
fn recording(effect: Option<(Parameter, f64)>) -> motorfit::Result<Record> {
    let count = LEVELS.len() * SAMPLES_PER_LEVEL;
    let time_s = (0..count).map(|k| k as f64 * PERIOD_S).collect();
    let voltage = (0..count).map(|k| LEVELS[k / SAMPLES_PER_LEVEL]).collect();
    let motor = Extended::from(&Parameters::M2);
    let motor = effect.map_or(motor, |(parameter, value)| motor.with(parameter, value));
    let clean = simulated(motor, &Excitation { time_s, voltage, torque: None }, Discretization::Zoh)?;
    with_noise(&clean, noise_of(&clean, Noise::Decibels(40.0)), 1)
}

/// A recording, and the signals of the linear model that was fitted to it.
type Fitted = (Record, [Vec<f64>; 2]);

fn fitted(effect: Option<(Parameter, f64)>) -> motorfit::Result<Fitted> {
    let records = [recording(effect)?];
    let found = identify(&records, &IdentifySpec::default())?;
    let signals = model(&records[0], &found.parameters, found.initial[0], found.model.discretization);
    let [record] = records;
    Ok((record, signals))
}

fn main() -> motorfit::Result<()> {
    let fits: Vec<Fitted> = EFFECTS.iter().map(|(_, effect)| fitted(*effect)).collect::<Result<_, _>>()?;
    let row = EFFECTS.iter().zip(&fits).map(|((name, _), (record, signals))| ResidualRow { name, record, signals });
    let rows: Vec<ResidualRow<'_>> = row.collect();
    let figure = residual_panels("residuals", &rows).figure();
    match std::env::args().nth(1) {
        Some(path) => std::fs::write(&path, figure.file("", false))
            .map_err(|fault| motorfit::Error::data(format!("{path}: {fault}"), "Give a path that can be written."))?,
        None => println!("{} fits; give a path to write the figure ({} bytes of SVG) to", rows.len(), figure.svg.len()),
    }
    Ok(())
}
