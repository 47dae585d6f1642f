//! Proves: the profile likelihood of a parameter is the minimum of the weighted sum of squares over the others, against a search by
//! sections on the scalar simulation; its 95 % intervals cover the true parameters over seeds, also where the likelihood is far from a
//! parabola. Profiles of models are those of the motor that they describe.
//! Does not prove: coverage for models that do not describe the recording.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(clippy::cast_precision_loss, reason = "small numbers")]

use crate::support::of_model;
use motorfit::evaluate::model::ModelRecording;
use motorfit::experiment::{Excitation, simulated, white_noise, with_noise};
use motorfit::identify::model::{ModelSpec, model_likelihood_profiles};
use motorfit::identify::{IdentifySpec, LikelihoodProfile, Polish, likelihood_profiles};
use motorfit::model::{BuiltIn, Model};
use motorfit::motor::{Discretization, Parameter, Parameters, SimulationInput, Space, simulate};
use motorfit::record::Record;
use rayon::prelude::*;
use std::ops::ControlFlow;

const SIGMA: [f64; 2] = [0.3, 8.0];
const STEP_S: f64 = 2e-3;

/// Returns a recording of M2 under a step with noise of [`SIGMA`].
fn noisy(duration_s: f64, seed: u64) -> Record {
    let step = Excitation::step(10.5, 0.0, duration_s, STEP_S).unwrap();
    with_noise(&simulated(&Parameters::M2, &step, Discretization::Zoh).unwrap(), SIGMA, seed).unwrap()
}

/// Returns the sum of squared errors in units of σ.
fn squares(record: &Record, motor: &Parameters, sigma: [f64; 2]) -> f64 {
    let input = SimulationInput {
        step_s: &[STEP_S],
        step_index: &[],
        voltage: &record.samples().voltage,
        voltage_end: &[],
        torque: &[],
    };
    let simulated = simulate(motor, &input, [0.0; 2], Discretization::Zoh);
    let of = |c: usize| {
        let measured = record.measured()[c].unwrap();
        let errors = measured.iter().zip(&simulated[c]).map(|(y, x)| ((y - x) / sigma[c]).powi(2));
        errors.sum::<f64>()
    };
    of(0) + of(1)
}

/// Returns the minimum of a function of one variable by golden sections.
fn least(range: [f64; 2], f: impl Fn(f64) -> f64) -> f64 {
    let [mut low, mut high] = range;
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    while high - low > 1e-9 * high {
        let [a, b] = [high - golden * (high - low), low + golden * (high - low)];
        if f(a) < f(b) {
            high = b;
        } else {
            low = a;
        }
    }
    f(0.5 * (low + high))
}

fn of(profiles: &[LikelihoodProfile], parameter: Parameter) -> &LikelihoodProfile {
    profiles.iter().find(|of| of.name == parameter.symbol()).unwrap()
}

#[test]
fn a_profile_is_the_minimum_over_the_other_parameters() {
    let record = noisy(0.3, 3);
    let [_, l, _, b, j] = Parameters::M2.to_array();
    let fixed = [(Parameter::L, l), (Parameter::B, b), (Parameter::J, j)];
    let space = Space::table2_with(&[], &fixed).unwrap();
    let spec = IdentifySpec { space, ..IdentifySpec::default() };
    let (found, profiles) = likelihood_profiles(std::slice::from_ref(&record), &spec).unwrap();
    let sigma = [0, 1].map(|channel: usize| found.residual_sigma[channel].unwrap());
    let optimum = squares(&record, &found.parameters, sigma);
    let own = of(&profiles, Parameter::R);
    assert!(own.points.len() > 10);
    for point in &own.points {
        let with = |k: f64| squares(&record, &Parameters { r: point.value, k, ..found.parameters }, sigma);
        let expected = least([0.03, 0.15], with) - optimum;
        // The refinement ends when the sum changes by less than 1e-6 of itself.
        assert!((point.ratio - expected).abs() < 1e-3 * (1.0 + expected), "{point:?}: expected {expected}");
    }
    let [low, high] = own.likelihood95.map(Option::unwrap);
    for end in [low, high] {
        let with = |k: f64| squares(&record, &Parameters { r: end, k, ..found.parameters }, sigma);
        assert!((least([0.03, 0.15], with) - optimum - 3.84).abs() < 0.02, "{end}");
    }
}

#[test]
fn intervals_by_the_likelihood_cover_the_truth() {
    // A short, noisy recording.
    const SEEDS: u64 = 1000;
    let truth = Parameters::M2;
    let covered = |seed: u64| {
        let (_, profiles) = likelihood_profiles(&[noisy(0.2, 100 + seed)], &IdentifySpec::default()).unwrap();
        let is_inside = |parameter: Parameter, [low, high]: [Option<f64>; 2]| {
            let value = truth.get(parameter);
            u32::from(low.is_none_or(|low| low < value) && high.is_none_or(|high| value < high))
        };
        Parameter::ALL.map(|parameter| {
            let of = of(&profiles, parameter);
            let normal = of.ci95.map_or([None; 2], |ends| ends.map(Some));
            [is_inside(parameter, of.likelihood95), is_inside(parameter, normal)]
        })
    };
    let all: Vec<[[u32; 2]; 5]> = (0..SEEDS).into_par_iter().map(covered).collect();
    let counts = [0, 1].map(|kind| Parameter::ALL.map(|p| all.iter().map(|of| of[p as usize][kind]).sum::<u32>()));
    println!("covered of {SEEDS}, by the likelihood and by the standard errors: {counts:?}");
    let [counts, _] = counts;
    // The standard deviation of a count is 6.9; the limits are four of them from 950.
    assert!(counts.iter().all(|count| (922..=978).contains(count)), "{counts:?}");
}

#[test]
fn profiles_of_the_motor_as_a_model_are_its_own() {
    // From rest, as the built-in motor; wide bounds, as its automatic ones.
    let text = BuiltIn::DcMotor.source().replace("\"measured\"", "0");
    let text = text.replace("min = 0.1, max = 1.0", "min = 0.001, max = 100").replace("min = 1e-5", "min = 1e-7");
    let model = Model::parse(&text).unwrap();
    let record = noisy(0.3, 3);
    let (_, own) = likelihood_profiles(std::slice::from_ref(&record), &IdentifySpec::default()).unwrap();
    let recordings = [of_model(&record)];
    let mut go_on = |_| ControlFlow::Continue(());
    let (found, profiles) = model_likelihood_profiles(&model, &recordings, &ModelSpec::default(), &mut go_on).unwrap();
    assert_eq!(profiles.len(), 5);
    for (found, own) in profiles.iter().zip(&own) {
        assert_eq!((&found.name, &found.unit), (&own.name, &own.unit));
        let error = own.std_error.unwrap();
        for (found, own) in found.likelihood95.iter().zip(&own.likelihood95) {
            // Ends are interpolated between points that both place by the standard error.
            assert!((found.unwrap() - own.unwrap()).abs() < 0.02 * error, "{found:?} {own:?} {error}");
        }
    }
    assert!(found.warnings.iter().all(|warning| !warning.code.starts_with("profile")));
}

#[test]
fn a_parameter_of_each_recording_has_its_profile() {
    // Linear in its parameters: the likelihood is a parabola, and both intervals are the same.
    let text = r#"
format = 1
name = "Line"
[inputs]
u = { unit = "V" }
[parameters]
gain = { unit = "A/V", min = -100, max = 100 }
offset = { unit = "A", min = -100, max = 100, per_recording = true }
T = { unit = "s", min = 0.1, max = 10, value = 1 }
[states]
x = { unit = "V", d = "(u - x)/T", initial = 0 }
[outputs]
y = { value = "gain*x + offset", unit = "A" }
"#;
    let model = Model::parse(text).unwrap();
    let recording = |seed: u64, offset: f64| {
        let time_s: Vec<f64> = (0..200).map(|n| 0.05 * f64::from(n)).collect();
        let exact = time_s.iter().map(|t| 2.0 * (1.0 - (-t).exp()) + offset);
        let noise = white_noise(200, 0.1, seed, 0);
        let measured = vec![Some(exact.zip(noise).map(|(a, b)| a + b).collect())];
        ModelRecording { measured, ..ModelRecording::to_simulate(&model, time_s, vec![vec![1.0; 200]]).unwrap() }
    };
    let recordings = [recording(1, 0.5), recording(2, -0.3)];
    let spec = ModelSpec { fixed: vec![("T".to_owned(), 1.0)], ..ModelSpec::default() };
    let mut go_on = |_| ControlFlow::Continue(());
    let (_, profiles) = model_likelihood_profiles(&model, &recordings, &spec, &mut go_on).unwrap();
    let names: Vec<&str> = profiles.iter().map(|of| of.name.as_str()).collect();
    assert_eq!(names, ["gain", "offset[0]", "offset[1]"]);
    for of in &profiles {
        let (normal, error) = (of.ci95.unwrap(), of.std_error.unwrap());
        for (end, normal) in of.likelihood95.iter().zip(normal) {
            // √3.84 is 1.96; the noise of all recordings is estimated with the parameters.
            assert!((end.unwrap() - normal).abs() < 0.02 * error, "{of:?}");
        }
    }
}

#[test]
fn a_profile_needs_the_refinement() {
    let spec = IdentifySpec { polish: Polish::None, ..IdentifySpec::default() };
    let error = likelihood_profiles(&[noisy(0.3, 1)], &spec).unwrap_err();
    assert_eq!(error.kind(), motorfit::ErrorKind::Usage);
}

#[test]
fn profiles_with_parameters_fixed_have_no_intervals() {
    // Without the current only combinations of the parameters are identifiable.
    let mut samples = noisy(0.3, 5).samples().clone();
    samples.current = None;
    let record = Record::new(samples).unwrap();
    let (found, profiles) = likelihood_profiles(&[record], &IdentifySpec::default()).unwrap();
    assert!(!found.unidentified.is_empty() && !profiles.is_empty());
    assert!(profiles.iter().all(|of| of.likelihood95 == [None; 2] && of.points.len() > 1), "{profiles:?}");
    assert!(found.warnings.iter().any(|warning| warning.code == "profile_conditional"));
}
