//! Proves: the linear DC motor as a model with generic terms is the built-in motor with the extensions of the same names, and its sensors
//! with a filter and an offset are those of closed forms.
//! Does not prove: the choice of terms.
#![allow(clippy::unwrap_used, reason = "a test may stop")]

use motorfit::evaluate::model::{ModelProblem, ModelRecording, ModelSettings, ModelSpace};
use motorfit::experiment::{Excitation, simulated};
use motorfit::model::{BuiltIn, GenericTerm, IntegrationMethod, Model};
use motorfit::motor::{Discretization, Extended, Parameter, Parameters};
use motorfit::numeric::{count, rms};

const SAMPLES: usize = 300;
const STEP_S: f64 = 1e-3;

/// Returns a voltage after a rest.
fn voltage() -> Vec<f64> {
    (0..SAMPLES)
        .map(|n| if n < 20 { 0.0 } else { 4.0 * (count(n) * 0.11).sin() + if n % 90 < 40 { 3.0 } else { -2.0 } })
        .collect()
}

/// Returns current and speed of the model with the values of parameters beside those of the motor, by name.
fn outputs(terms: &[GenericTerm], given: &[(&str, f64)], substeps: usize) -> [Vec<f64>; 2] {
    let model = BuiltIn::DcMotor.model().unwrap().with_generic(terms).unwrap();
    let mut values = Parameters::M2.to_array().to_vec();
    for parameter in &model.parameters()[5..] {
        let own = given.iter().find(|(name, _)| *name == parameter.name);
        values.push(own.map_or(parameter.neutral.unwrap(), |(_, value)| *value));
    }
    let time_s = (0..SAMPLES).map(|n| count(n) * STEP_S).collect();
    let recording = ModelRecording::to_simulate(&model, time_s, vec![voltage(), vec![0.0; SAMPLES]]).unwrap();
    let settings =
        ModelSettings { method: Some((IntegrationMethod::Exponential, substeps)), ..ModelSettings::default() };
    let problem = ModelProblem::new(&model, ModelSpace::all_fixed(&values), vec![recording], settings).unwrap();
    problem.simulate(&[], 0, &[0.0, 0.0]).outputs.try_into().unwrap()
}

/// Returns current and speed of the built-in motor.
fn motor(extension: &[(Parameter, f64)]) -> [Vec<f64>; 2] {
    let motor = extension.iter().fold(Extended::from(&Parameters::M2), |motor, (p, value)| motor.with(*p, *value));
    let time_s = (0..SAMPLES).map(|n| count(n) * STEP_S).collect();
    let excitation = Excitation { time_s, voltage: voltage(), torque: None };
    let record = simulated(motor, &excitation, Discretization::Zoh).unwrap();
    record.measured().map(|signal| signal.unwrap().to_vec())
}

/// Returns the largest error of the two signals relative to their size.
fn apart(a: &[Vec<f64>; 2], b: &[Vec<f64>; 2]) -> f64 {
    let one = |(a, b): (&Vec<f64>, &Vec<f64>)| {
        let error: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
        rms(&error) / rms(b)
    };
    a.iter().zip(b).map(one).fold(0.0, f64::max)
}

#[test]
fn generic_terms_are_the_extensions_of_the_motor() {
    use GenericTerm::{DeadTime, Latency, Load, SensorAverage};
    for (terms, given, extension, limit) in [
        // The mean of a voltage that jumps within a substep of 1/16 ms in place of the jump.
        (vec![DeadTime], vec![("dead_time", 2.3e-3)], vec![(Parameter::DeadTime, 2.3e-3)], 1e-4),
        (vec![Latency], vec![("latency", 4.7e-3)], vec![(Parameter::Latency, 4.7e-3)], 1e-4),
        (
            vec![DeadTime, Latency],
            vec![("dead_time", 1.2e-3), ("latency", 3.4e-3)],
            vec![(Parameter::DeadTime, 1.2e-3), (Parameter::Latency, 3.4e-3)],
            1e-4,
        ),
        (vec![Load], vec![("load", 0.012)], vec![(Parameter::Load, 0.012)], 1e-10),
        (
            vec![SensorAverage],
            vec![("average_i", 3.4), ("average_w", 6.0)],
            vec![(Parameter::CurrentAverage, 3.4), (Parameter::SpeedAverage, 6.0)],
            1e-10,
        ),
    ] {
        let expected = motor(&extension);
        let error = apart(&outputs(&terms, &given, 16), &expected);
        assert!(error < limit, "{terms:?}: {error:e}");
        // The terms have an effect, and none at their neutral values.
        assert!(apart(&motor(&[]), &expected) > 1e-3, "{terms:?}");
        let neutral = apart(&outputs(&terms, &[], 16), &motor(&[]));
        assert!(neutral < 1e-9, "{terms:?}: {neutral:e}");
    }
}

#[test]
fn sensors_with_an_offset_and_a_filter_follow_the_signal() {
    let plain = outputs(&[], &[], 1);
    let [i, w] = outputs(&[GenericTerm::Offset], &[("offset_i", 0.3), ("offset_w", -5.0)], 1);
    for (n, (i, w)) in i.iter().zip(&w).enumerate() {
        assert!((i - plain[0][n] - 0.3).abs() < 1e-12 && (w - plain[1][n] + 5.0).abs() < 1e-10);
    }
    // A filter of a signal that was a sum of exponentials is one more state, here by fine steps.
    let (lag, fine) = (4e-3, 64);
    let found = outputs(&[GenericTerm::SensorFilter], &[("sensor_filter", lag)], 4);
    let model = BuiltIn::DcMotor.model().unwrap();
    let filtered = model
        .text()
        .replace("[outputs]", "[let]\nlag = \"0.004*s\"\n\n[constants]\ns = { value = 1, unit = \"s\" }\n\n[outputs]");
    let filtered = filtered.replace(
        "[states]\n",
        "[states]\nfi = { unit = \"A\", d = \"(i - fi)/lag\", initial = 0 }\nfw = { unit = \"rad/s\", d = \"(w - fw)/lag\", initial = 0 }\n",
    );
    let filtered = filtered
        .replace("i = { value = \"i\"", "i = { value = \"fi\"")
        .replace("w = { value = \"w\"", "w = { value = \"fw\"");
    let filtered = Model::parse(&filtered.replace("initial = \"measured\"", "initial = 0")).unwrap();
    let values = Parameters::M2.to_array();
    let inputs: Vec<Vec<f64>> = [voltage(), vec![0.0; SAMPLES]].into_iter().collect();
    let expected = motorfit_model::reference::simulate(&filtered, &values, &[], &inputs, STEP_S, fine);
    let error = apart(&found, &expected.try_into().unwrap());
    // The third derivative over a quarter of a step.
    assert!(error < 1e-5, "{error:e}");
    assert!(apart(&plain, &found) > 1e-2);
}
