//! Proves: the DC motors written as models are the built-in ones, in trajectories, costs and estimates; parameters of simulated
//! machines are found with errors that the standard errors describe, against simulations by hand-written equations with fine
//! steps; what recordings cannot tell apart is named; bad models give errors with line and column.
//! Does not prove: real machines.
#![allow(clippy::unwrap_used, clippy::float_cmp, reason = "a test may stop; exact equality is meant")]

use crate::support::rates::cases;
use motorfit::candidates::Candidates;
use motorfit::criterion::{Criterion, Noise, Norm, Scale};
#[cfg(feature = "gpu")]
use motorfit::device::{DeviceSpec, PrecisionSpec};
use motorfit::estimate::model::refine_model;
use motorfit::evaluate::model::{ModelProblem, ModelRecording, ModelSettings, ModelSpace, signal_requests};
use motorfit::evaluate::{Initial, Problem, Scalar};
use motorfit::experiment::{Excitation, noise_of, simulated, white_noise, with_noise};
use motorfit::identify::Method;
use motorfit::identify::Status;
use motorfit::identify::model::{ModelIdentification, ModelSpec, identify_model};
use motorfit::identify::{IdentifySpec, TrustLevel, identify};
use motorfit::model::{BuiltIn, IntegrationMethod, Model};
use motorfit::motor::{Discretization, Extended, Parameter, Parameters, Space};
use motorfit::named::Named as _;
use motorfit::numeric::{count, rms};
use motorfit::optimize::{GwoOptions, Stop};
use motorfit::record::{Preparation, ReadOptions, read_bytes};
use std::ops::ControlFlow;

fn square(samples: usize, period: usize, high: f64, low: f64) -> Vec<f64> {
    (0..samples).map(|n| if (n / period).is_multiple_of(2) { high } else { low }).collect()
}

/// Returns a recording of a model with the given inputs, `[inputs][samples]`, and measured outputs.
fn recording(step_s: f64, inputs: Vec<Vec<f64>>, measured: Vec<Option<Vec<f64>>>) -> ModelRecording {
    ModelRecording {
        time_s: (0..inputs[0].len()).map(|n| count(n) * step_s).collect(),
        step_s: vec![step_s],
        inputs,
        measured,
        counting: Vec::new(),
        effective_sample_ratio: 1.0,
        name: None,
        assumed: None,
    }
}

/// Returns a voltage after a rest and a load torque, and the values of the parameters of a motor.
fn case(of: BuiltIn) -> (Vec<Vec<f64>>, Vec<f64>) {
    let mut voltage = square(400, 70, 6.0, -3.0);
    // Before the first sample a delayed signal has its first value, in the motor's own simulation that at rest.
    voltage[..20].fill(0.0);
    let motor = Parameters::M2.to_array().to_vec();
    match of {
        BuiltIn::DcMotor => (vec![voltage, square(400, 33, 0.01, 0.0)], motor),
        _ => (vec![voltage, vec![0.0; 400]], [motor, vec![0.02, 0.005, 0.004, 0.1, 0.3, 0.2, 5.0, 0.9]].concat()),
    }
}

const STEP_S: f64 = 1e-3;

#[test]
fn the_motors_written_as_models_are_the_built_in_ones() {
    let extended = [
        (Parameter::Coulomb, 0.02),
        (Parameter::Load, 0.005),
        (Parameter::DeadTime, 0.004),
        (Parameter::Offset, 0.1),
        (Parameter::BrushDrop, 0.3),
        (Parameter::Deadband, 0.2),
        (Parameter::Saturation, 5.0),
        (Parameter::NegativeGain, 0.9),
    ];
    let extended = extended.into_iter().fold(Extended::from(&Parameters::M2), |motor, (p, value)| motor.with(p, value));
    for (of, motor) in [(BuiltIn::DcMotor, Extended::from(&Parameters::M2)), (BuiltIn::DcExtended, extended)] {
        let model = of.model().unwrap();
        let (inputs, values) = case(of);
        let step_s = STEP_S;
        let time_s: Vec<f64> = (0..inputs[0].len()).map(|n| count(n) * step_s).collect();
        let torque = Some(inputs[1].clone()).filter(|torque| torque.iter().any(|value| *value != 0.0));
        let excitation = Excitation { time_s, voltage: inputs[0].clone(), torque };
        let record = simulated(motor, &excitation, Discretization::Zoh).unwrap();
        let space = ModelSpace::all_fixed(&values);
        let measured = record.measured().map(|signal| signal.map(<[f64]>::to_vec)).to_vec();
        let recording = recording(step_s, inputs, measured);
        // In the built-in motor friction acts once a sample; models choose shorter steps for it.
        let method = Some((IntegrationMethod::Exponential, 1));
        let settings = ModelSettings { method, ..ModelSettings::default() };
        let problem = ModelProblem::new(&model, space, vec![recording], settings).unwrap();
        assert_eq!(problem.method().method, IntegrationMethod::Exponential, "{}", of.name());
        let found = problem.simulate(&[], 0, &[0.0, 0.0]).outputs;
        for (found, expected) in found.iter().zip(record.measured()) {
            let expected = expected.unwrap();
            let error: Vec<f64> = found.iter().zip(expected).map(|(a, b)| a - b).collect();
            // Rounding: the same steps in another order of operations.
            assert!(rms(&error) < 1e-11 * rms(expected), "{}: {:e}", of.name(), rms(&error) / rms(expected));
        }
    }
}

#[test]
fn costs_of_the_motor_are_those_of_its_own_kernel() {
    let model = BuiltIn::DcMotor.model().unwrap();
    let (inputs, _) = case(BuiltIn::DcMotor);
    let step_s = STEP_S;
    let time_s: Vec<f64> = (0..inputs[0].len()).map(|n| count(n) * step_s).collect();
    let excitation = Excitation { time_s, voltage: inputs[0].clone(), torque: Some(inputs[1].clone()) };
    let record = simulated(Extended::from(&Parameters::M2), &excitation, Discretization::Zoh).unwrap();
    let measured = record.measured().map(|signal| signal.map(<[f64]>::to_vec)).to_vec();
    let recording = recording(step_s, inputs, measured);
    let space = ModelSpace::new(&model, 1);
    let values: Vec<f64> =
        (0..70 * 5).map(|n| space.free[n % 5].at((count(n) * 0.618_033_988_749_895).fract())).collect();
    for norm in Norm::ALL {
        for scale in [Scale::None, Scale::Peak, Scale::Std] {
            let criterion = Criterion { norm, scale, ..Criterion::default() };
            let settings = ModelSettings { criterion, ..ModelSettings::default() };
            let own = ModelProblem::new(&model, space.clone(), vec![recording.clone()], settings).unwrap();
            let mut costs = vec![0.0; 70];
            own.costs(Candidates::new(&values, 5), &mut costs).unwrap();
            let kernel = motorfit::evaluate::Model { discretization: Discretization::Zoh, initial: Initial::Measured };
            let problem = Problem::new(std::slice::from_ref(&record), kernel, Space::table2(), criterion).unwrap();
            for (row, cost) in values.chunks(5).zip(&costs) {
                let expected = Scalar::cost(&problem, row);
                assert!((cost / expected - 1.0).abs() < 1e-9, "{norm:?} {scale:?}: {cost} {expected}");
            }
        }
    }
}

fn run(model: &Model, recordings: &[ModelRecording], spec: &ModelSpec) -> ModelIdentification {
    identify_model(model, recordings, spec, &mut |_| ControlFlow::Continue(())).unwrap()
}

#[test]
fn estimates_of_the_motor_are_those_of_its_own_pipeline() {
    let mut voltage = square(1000, 130, 8.0, -4.0);
    voltage[..50].fill(0.0);
    let time_s = (0..1000).map(|n| count(n) * STEP_S).collect();
    let excitation = Excitation { time_s, voltage: voltage.clone(), torque: None };
    let clean = simulated(&Parameters::M2, &excitation, Discretization::Zoh).unwrap();
    let record = with_noise(&clean, noise_of(&clean, Noise::Decibels(40.0)), 3).unwrap();
    // Both from rest, without initial states to estimate.
    let text = BuiltIn::DcMotor.source().replace("\"measured\"", "0");
    let model = Model::parse(&text).unwrap();
    let measured = record.measured().map(|signal| signal.map(<[f64]>::to_vec)).to_vec();
    let found = run(&model, &[recording(STEP_S, vec![voltage, vec![0.0; 1000]], measured)], &ModelSpec::default());
    let own = identify(&[record], &IdentifySpec::default()).unwrap();
    let errors = &own.uncertainty.as_ref().unwrap().std_error;
    for ((found, own), error) in found.values.iter().zip(&own.values).zip(errors) {
        let error = error.unwrap();
        // Both end within a fraction of 1e-6 standard errors of the optimum.
        assert!((found - own).abs() < 1e-6 * error, "{found} {own} {error}");
    }
    for (found, own) in found.uncertainty.as_ref().unwrap().std_error.iter().zip(errors) {
        assert!((found.unwrap() / own.unwrap() - 1.0).abs() < 1e-3, "{found:?} {own:?}");
    }
    assert_eq!(found.trust.level, TrustLevel::Good, "{:?}", found.trust);
}

#[test]
fn intervals_cover_the_truth_with_noise_that_is_given_and_with_estimated_noise() {
    // Outputs of 46 and 20 dB.
    let mut voltage = square(600, 90, 8.0, -4.0);
    voltage[..20].fill(0.0);
    let time_s: Vec<f64> = (0..600).map(|n| count(n) * STEP_S).collect();
    let excitation = Excitation { time_s, voltage: voltage.clone(), torque: None };
    let clean = simulated(&Parameters::M2, &excitation, Discretization::Zoh).unwrap();
    let model = Model::parse(&BuiltIn::DcMotor.source().replace("\"measured\"", "0")).unwrap();
    let truth = Parameters::M2.to_array();
    let (mut covered, mut all) = ([0.0, 0.0], 0.0);
    for seed in 0..100 {
        let with_noise = |(signal, share): (&[f64], f64), stream: u64| {
            let noise = white_noise(signal.len(), share * rms(signal), seed, stream);
            Some(signal.iter().zip(noise).map(|(a, b)| a + b).collect::<Vec<f64>>())
        };
        let [current, speed] = clean.measured().map(Option::unwrap);
        let measured = vec![with_noise((current, 0.1), 0), with_noise((speed, 0.005), 1)];
        let recording = recording(STEP_S, vec![voltage.clone(), vec![0.0; 600]], measured);
        let space = ModelSpace::new(&model, 1);
        let problem = ModelProblem::new(&model, space, vec![recording], ModelSettings::default()).unwrap();
        let given = vec![vec![0.1 * rms(current), 0.005 * rms(speed)]];
        let refined =
            [Some(&given[..]), None].map(|sigma| refine_model(&problem, &truth, &[Vec::new()], sigma).unwrap());
        assert_eq!(refined[0].weights, given);
        for (covered, refined) in covered.iter_mut().zip(&refined) {
            let is_covered = |(n, truth): (usize, &f64)| {
                let [low, high] = refined.uncertainty.ci95[n].unwrap();
                if (low..=high).contains(truth) { 1.0 } else { 0.0 }
            };
            *covered += truth.iter().enumerate().map(is_covered).sum::<f64>();
        }
        all += 5.0;
    }
    // Five correlated parameters of 100 recordings count as some 250 intervals: 3.5 deviations are 5 %.
    for covered in covered {
        assert!((0.90..0.997).contains(&(covered / all)), "{} covered", covered / all);
    }
}

/// Integrates equations with classical Runge–Kutta steps of a fraction of the sampling period; returns states at the samples.
fn integrated<const N: usize>(
    inputs: &[Vec<f64>],
    (step_s, substeps): (f64, usize),
    mut x: [f64; N],
    right: impl Fn(&[f64; N], &[f64]) -> [f64; N],
) -> Vec<[f64; N]> {
    let h = step_s / count(substeps);
    let mut all = Vec::new();
    for n in 0..inputs[0].len() {
        all.push(x);
        let u: Vec<f64> = inputs.iter().map(|input| input[n]).collect();
        for _ in 0..substeps {
            let moved = |k: &[f64; N], by: f64| -> [f64; N] { std::array::from_fn(|s| x[s] + by * k[s]) };
            let k1 = right(&x, &u);
            let k2 = right(&moved(&k1, 0.5 * h), &u);
            let k3 = right(&moved(&k2, 0.5 * h), &u);
            let k4 = right(&moved(&k3, h), &u);
            x = std::array::from_fn(|s| x[s] + h / 6.0 * (k1[s] + 2.0 * (k2[s] + k3[s]) + k4[s]));
        }
    }
    all
}

/// Returns factors from 0.6 to 1.7 that depend on a seed.
fn factor(seed: u64, n: u64) -> f64 {
    let x = ((seed * 31 + n * 17 + 5) as f64 * 0.618_033_988_749_895).fract();
    0.6 * (1.7_f64 / 0.6).powf(x)
}

fn noisy(signal: Vec<f64>, seed: u64, stream: u64) -> Option<Vec<f64>> {
    let sigma = 0.01 * rms(&signal);
    let noise = white_noise(signal.len(), sigma, seed, stream);
    Some(signal.iter().zip(noise).map(|(a, b)| a + b).collect())
}

/// A simulated machine: its recording and the true values of its parameters.
type Machine = (ModelRecording, Vec<f64>);

fn pmsm(seed: u64) -> Machine {
    let base = [0.5, 1e-3, 1.5e-3, 0.05, 1e-4, 2e-4];
    let values: Vec<f64> = base.iter().zip(0..).map(|(value, n)| value * factor(seed, n)).collect();
    let [r, ld, lq, psi, b, j] = [0, 1, 2, 3, 4, 5].map(|n| values[n]);
    let inputs = vec![square(2000, 170, 1.0, -1.0), square(2000, 400, 6.0, 2.0), square(2000, 900, 0.0, 0.02)];
    let states = integrated(&inputs, (1e-4, 40), [0.0; 3], |[id, iq, w], u| {
        let we = 4.0 * w;
        [
            (u[0] - r * id + we * lq * iq) / ld,
            (u[1] - r * iq - we * (ld * id + psi)) / lq,
            (6.0 * (psi + (ld - lq) * id) * iq - b * w - u[2]) / j,
        ]
    });
    let measured = (0..3).map(|s| noisy(states.iter().map(|x| x[s]).collect(), seed, s as u64)).collect();
    (recording(1e-4, inputs, measured), values)
}

fn thermal(seed: u64) -> Machine {
    let base = [1.0, 2.0, 0.05, 1e-5, 2e-5, 0.5, 4.0, 1e-3];
    let values: Vec<f64> = base.iter().zip(0..).map(|(value, n)| value * factor(seed, n)).collect();
    let [r, l, k, b, j, c, rth, beta] = [0, 1, 2, 3, 4, 5, 6, 7].map(|n| values[n]);
    let inputs = vec![square(3000, 400, 6.0, -4.0), vec![25.0; 3000]];
    let states = integrated(&inputs, (2e-3, 60), [0.0, 0.0, 25.0], |[i, w, t], u| {
        let rise = t - 25.0;
        let (rw, kw) = (r * (1.0 + 0.003_93 * rise), k * (1.0 - beta * rise));
        [(u[0] - rw * i - kw * w) / (1e-3 * l), (kw * i - b * w) / j, (rw * i * i - (t - u[1]) / rth) / c]
    });
    let mut measured: Vec<_> = (0..2).map(|s| noisy(states.iter().map(|x| x[s]).collect(), seed, s as u64)).collect();
    let temperature: Vec<f64> = states.iter().map(|x| x[2]).collect();
    let noise = white_noise(3000, 0.1, seed, 2);
    measured.push(Some(temperature.iter().zip(noise).map(|(a, b)| a + b).collect()));
    (recording(2e-3, inputs, measured), values)
}

#[test]
fn parameters_of_simulated_machines_are_found_within_their_errors() {
    // 40 dB. Of n intervals a share of 0.95 ± 3.5 √(0.95·0.05/n) covers the truth.
    let machines = cases(3, 10);
    for (of, machine) in [(BuiltIn::Pmsm, pmsm as fn(u64) -> Machine), (BuiltIn::DcThermal, thermal)] {
        let model = of.model().unwrap();
        let (mut covered, mut all, mut squares) = (0.0, 0.0, 0.0);
        for seed in 0..machines {
            let (recording, truth) = machine(seed);
            let found = run(&model, &[recording], &ModelSpec::default());
            let uncertainty = found.uncertainty.as_ref().unwrap();
            for (n, truth) in truth.iter().enumerate() {
                let (error, [low, high]) = (uncertainty.std_error[n].unwrap(), uncertainty.ci95[n].unwrap());
                let z = (found.values[n] - truth) / error;
                assert!(z.abs() < 6.0, "{} machine {seed} parameter {n}: {z} standard errors", of.name());
                covered += if (low..=high).contains(truth) { 1.0 } else { 0.0 };
                all += 1.0;
                squares += z * z;
            }
            assert_eq!(found.verification.status, Status::Agrees, "{} machine {seed}", of.name());
        }
        let (share, spread): (f64, f64) = (covered / all, squares / all);
        let margin = 3.5 * (0.95_f64 * 0.05 / all).sqrt();
        assert!((share - 0.95).abs() < margin, "{}: {share} covered", of.name());
        // The parameters of a machine are correlated: 80 errors spread like some 25 independent ones, a mean square of 1 ± 0.28.
        let spreads = cases(0.0..2.8, 0.4..1.6);
        assert!(spreads.contains(&spread), "{}: mean square {spread}", of.name());
    }
}

#[test]
fn a_search_is_judged_by_starts_over_the_bounds() {
    let (recording, truth) = pmsm(2);
    let model = BuiltIn::Pmsm.model().unwrap();
    let recordings = [recording];
    let judged = |found: &ModelIdentification| {
        let of = &found.verification;
        (of.status, of.starts, of.arrivals)
    };
    let found = run(&model, &recordings, &ModelSpec::default());
    assert_eq!(found.verification.status, Status::Agrees);
    // A given start in the optimum is no evidence.
    let start = model.parameters().iter().map(|of| of.name.clone()).zip(truth).collect();
    let given = run(&model, &recordings, &ModelSpec { starts: vec![start], ..ModelSpec::default() });
    assert_eq!(judged(&given), judged(&found));
    // The result does not depend on the number of threads.
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let other = pool.install(|| run(&model, &recordings, &ModelSpec::default()));
        assert_eq!((judged(&other), &other.values), (judged(&found), &found.values), "{threads} threads");
    }
    // A population search that was interrupted is not verified.
    let spec = ModelSpec { method: Method::from(GwoOptions::default()), ..ModelSpec::default() };
    let broken = identify_model(&model, &recordings, &spec, &mut |_| ControlFlow::Break(())).unwrap();
    assert_eq!((broken.stop, broken.verification.status), (Stop::Interrupted, Status::NotApplicable));
    assert_ne!(broken.trust.level, TrustLevel::Good);
    assert!(broken.trust.reasons.iter().any(|reason| reason.code == "not_verified"), "{:?}", broken.trust);
}

#[test]
fn a_search_without_noise_agrees() {
    let (mut recording, truth) = pmsm(3);
    let model = BuiltIn::Pmsm.model().unwrap();
    let space = ModelSpace::all_fixed(&truth);
    let problem = ModelProblem::new(&model, space, vec![recording.clone()], ModelSettings::default()).unwrap();
    recording.measured = problem.simulate(&[], 0, &[0.0; 3]).outputs.into_iter().map(Some).collect();
    let found = run(&model, &[recording], &ModelSpec::default());
    assert_eq!(found.verification.status, Status::Agrees, "{:?}", found.verification);
    for (found, truth) in found.values.iter().zip(&truth) {
        assert!((found / truth - 1.0).abs() < 1e-6, "{found} {truth}");
    }
}

#[cfg(feature = "gpu")]
#[test]
fn a_gpu_finds_the_same_estimates() {
    let (recording, _) = pmsm(1);
    let model = BuiltIn::Pmsm.model().unwrap();
    let recordings = [recording];
    let on_cpu = run(&model, &recordings, &ModelSpec::default());
    assert_eq!((on_cpu.device.kind, on_cpu.device.precision), ("cpu", "f64"));
    let errors = on_cpu.uncertainty.as_ref().unwrap().std_error.clone();
    for (precision, method) in [
        (PrecisionSpec::F64, Method::Auto),
        (PrecisionSpec::F32, Method::Auto),
        (PrecisionSpec::F32, Method::named("method", "gwo").unwrap()),
    ] {
        let spec = ModelSpec { device: DeviceSpec::Gpu, precision, method, ..ModelSpec::default() };
        let found = match identify_model(&model, &recordings, &spec, &mut |_| ControlFlow::Continue(())) {
            Err(_) if std::env::var_os("MOTORFIT_NO_SKIP").is_none() => return,
            found => found.unwrap(),
        };
        assert_eq!(found.device.kind, "gpu", "{:?}", found.device);
        // A population search on the device may be stuck, which is reported.
        if found.verification.status == Status::SearchStuck {
            assert_eq!(found.searched.method, "gwo");
            continue;
        }
        // The refinement is that of the CPU: only where it begins depends on the device.
        for ((own, expected), error) in found.values.iter().zip(&on_cpu.values).zip(&errors) {
            let error = error.unwrap();
            assert!((own - expected).abs() < 1e-3 * error, "{precision:?} {:?}: {own} {expected}", found.searched);
        }
    }
}

#[test]
fn friction_that_sticks_is_not_exact_and_no_wrong_estimate_is_certified() {
    // The brush drop holds the current at zero and Coulomb friction the motor, from moments between the samples: the truth has 64 steps
    // a sample. With one step a sample the estimates of this motor are off by many standard errors.
    let model = BuiltIn::DcExtended.model().unwrap();
    let samples = 1500;
    let voltage: Vec<f64> =
        square(samples, 90, 3.0, -2.0).iter().zip(square(samples, 37, 0.0, 1.0)).map(|(a, b)| a - b).collect();
    let inputs = vec![voltage, vec![0.0; samples]];
    let motor = Parameters::M2.to_array();
    let values = [&motor[..], &[0.03, 0.0, 0.0, 0.0, 0.6, 0.0, 48.0, 1.0]].concat();
    let fixed = ModelSpace::all_fixed(&values);
    let silent = recording(STEP_S, inputs.clone(), vec![Some(inputs[0].clone()); 2]);
    let settings = ModelSettings { method: Some((IntegrationMethod::Exponential, 64)), ..ModelSettings::default() };
    let truth = ModelProblem::new(&model, fixed, vec![silent], settings).unwrap().simulate(&[], 0, &[0.0; 2]).outputs;
    let own = ["TL", "td", "v0", "vd", "vs", "gn"];
    let number = |name: &str| model.parameters().iter().position(|p| p.name == name).unwrap();
    let spec =
        ModelSpec { fixed: own.map(|name| (name.to_owned(), values[number(name)])).to_vec(), ..ModelSpec::default() };
    let mut covered = 0;
    for seed in 1..=4 {
        let measured = (0..).zip(&truth).map(|(n, signal)| noisy(signal.clone(), seed, n)).collect();
        let found = run(&model, &[recording(STEP_S, inputs.clone(), measured)], &spec);
        assert!(!found.method.described().contains("exact"), "{}", found.method.described());
        for e in found.estimates.iter().filter(|e| !e.fixed) {
            let Some((value, error)) = e.value.zip(e.std_error) else { continue };
            let off = (value - values[number(&e.name)]).abs() / error;
            covered += usize::from(off < 1.96);
            assert!(off < 5.0 || found.trust.level != TrustLevel::Good, "{} is off by {off} standard errors", e.name);
        }
    }
    // Of 28 intervals 26.6 are expected; three binomial deviations are 3.5.
    assert!(covered >= 23, "{covered} of 28");
}

#[test]
fn what_cannot_be_told_apart_is_named() {
    let case = |equation: &str, parameters: &str| {
        let text = format!(
            "format = 1\n[inputs]\nu = {{ unit = \"1\" }}\n[parameters]\n{parameters}\n[states]\n\
             x = {{ unit = \"1\", d = \"{equation}\", initial = 0 }}\n[outputs]\nx = {{ value = \"x\", unit = \"1\" }}\n"
        );
        let model = Model::parse(&text).unwrap();
        let input = square(600, 100, 1.0, 0.0);
        let states = integrated(std::slice::from_ref(&input), (0.01, 20), [0.0], |[x], u| [(3.0 * u[0] - x) / 0.5]);
        let measured = noisy(states.iter().map(|x| x[0]).collect(), 1, 0);
        run(&model, &[recording(0.01, vec![input], vec![measured])], &ModelSpec::default())
    };
    let p = |name: &str, unit: &str| format!("{name} = {{ unit = \"{unit}\", min = 0.01, max = 100, log = true }}\n");
    let abt = || p("a", "1") + &p("b", "1") + &p("T", "s");
    let ratios = [("a/T", 6.0), ("b/T", 2.0)];
    for (equation, parameters, named, known) in [
        ("(a*b*u - x)/T", abt(), "only the product a*b is identified", &[("a*b", 3.0)][..]),
        ("(a/b*u - x)/T", abt(), "only the ratio a/b is identified", &[("a/b", 3.0)]),
        ("(a*u - b*x)/T", abt(), "a, b and T share one unknown scale: fix one of them", &ratios),
        (
            "(a*u - x)/(T*S)",
            p("a", "1") + &p("T", "s") + &p("S", "1"),
            "only the product T*S is identified",
            &[("T*S", 0.5)],
        ),
        ("((a + b)*u - x)/T", abt(), "only a + b is identified", &[("a + b", 3.0)]),
        ("(a*u - x)*b/(T*S)", abt() + &p("S", "1"), "b, T and S cannot be told apart: fix 2 of them", &[]),
    ] {
        let found = case(equation, &parameters);
        assert!(found.combinations.iter().any(|text| text.contains(named)), "{equation}: {:?}", found.combinations);
        assert_eq!(found.trust.level, TrustLevel::Check, "{:?}", found.trust);
        assert!(found.estimates.iter().any(|estimate| estimate.value.is_none()), "{equation}");
        for (name, truth) in known {
            let of = found.identified.iter().find(|of| of.name == *name);
            let of = of.unwrap_or_else(|| panic!("{equation}: no {name} in {:?}", found.identified));
            // Noise of one seed: four deviations. An error of 2 % shows that the combination is identified.
            assert!((of.value - truth).abs() < 4.0 * of.std_error && of.std_error < 0.02 * truth, "{equation}: {of:?}");
            assert!(of.ci95[0] < of.value && of.value < of.ci95[1], "{equation}: {of:?}");
        }
    }
}

#[test]
fn signals_in_motion_are_prepared_as_they_are() {
    let text = GOOD.replacen("{ unit = \"V\" }", "{ unit = \"V\", column = \"voltage\" }", 1);
    let model = Model::parse(&text).unwrap();
    let options = ReadOptions { signals: signal_requests(&model), ..ReadOptions::default() };
    let rows: String = (0..400).map(|n| format!("{},12000,-3\n", count(n) * 0.01)).collect();
    let read = |heading: &str| read_bytes(format!("{heading}\n{rows}").as_bytes(), None, &options);
    let record = read("time_s,Spannung [mV],i").unwrap().remove(0);
    for preparation in [
        Preparation { filter: Some("butterworth:5:2".parse().unwrap()), ..Preparation::default() },
        Preparation { decimate: Some(4), ..Preparation::default() },
        Preparation { rate_hz: Some(30.0), ..Preparation::default() },
        Preparation { rate_hz: Some(250.0), ..Preparation::default() },
    ] {
        let prepared = preparation.apply(&record).unwrap().remove(0);
        let found = ModelRecording::new(&model, &prepared).unwrap();
        // A constant stays one: a filter does not begin at zero. Rounding and the ripple of 0.05 dB.
        let largest =
            |values: &[f64], constant: f64| values.iter().map(|v| (v / constant - 1.0).abs()).fold(0.0, f64::max);
        assert!(largest(&found.inputs[0], 12.0) < 0.01, "{preparation:?}");
        assert!(largest(found.measured[0].as_ref().unwrap(), -3.0) < 0.01, "{preparation:?}");
    }
    // A column of a known quantity has its dimension, and a signal of another one does not take it.
    let error = read("time_s,voltage [A],i").unwrap_err();
    assert!(error.to_string().contains("does not convert to V"), "{error}");
    let error = read("time_s,u,j").unwrap_err();
    assert!(error.to_string().contains("no column for i"), "{error}");
    // Filters commute with linear equations only, and a resampled input is known by its means.
    let mut filtered = recording(0.1, vec![square(300, 50, 1.0, -1.0)], vec![noisy(square(300, 70, 2.0, 1.0), 1, 0)]);
    filtered.effective_sample_ratio = 0.8;
    let found = run(&Model::parse(GOOD).unwrap(), &[filtered], &ModelSpec::default());
    assert!(found.trust.reasons.iter().any(|reason| reason.code == "filtered"), "{:?}", found.trust);
    // Two wrong samples are named.
    let mut measured = noisy(square(300, 70, 2.0, 1.0), 1, 0).unwrap();
    let voltage: Vec<f64> = square(300, 50, 1.0, -1.0);
    let states = integrated(std::slice::from_ref(&voltage), (0.001, 10), [0.0], |[i], u| [(u[0] - 0.5 * i) / 0.02]);
    measured.iter_mut().zip(&states).for_each(|(value, x)| *value = x[0] + 0.001 * (*value - 1.5));
    measured[100] += 5.0;
    measured[200] += 5.0;
    let found = run(
        &Model::parse(GOOD).unwrap(),
        &[recording(0.001, vec![voltage], vec![Some(measured)])],
        &ModelSpec::default(),
    );
    let outliers = found.trust.reasons.iter().find(|reason| reason.code == "outliers").unwrap();
    assert!(
        outliers.message.to_string().contains("2 samples of i are far from the model, the first at 0.1"),
        "{outliers:?}"
    );
    // A few samples are not enough for a test of the residuals.
    let few = recording(0.1, vec![square(30, 5, 1.0, -1.0)], vec![noisy(square(30, 7, 2.0, 1.0), 1, 0)]);
    let found = run(&Model::parse(GOOD).unwrap(), &[few], &ModelSpec::default());
    assert!(found.trust.reasons.iter().any(|reason| reason.code == "few_samples"), "{:?}", found.trust);
}

/// A model that is right, to which each case does something wrong.
const GOOD: &str = r#"format = 1
name = "m"
[inputs]
v = { unit = "V" }
[constants]
g = { value = 9.81, unit = "m/s^2" }
[parameters]
R = { unit = "ohm", min = 0.1, max = 10, log = true }
L = { unit = "H", min = 1e-3, max = 0.1, log = true }
[let]
e = "v - R*i"
[states]
i = { unit = "A", d = "e/L", initial = "measured" }
[outputs]
i = { value = "i", unit = "A" }
"#;

#[test]
#[expect(clippy::too_many_lines, reason = "a list")]
fn bad_models_give_the_place_and_a_remedy() {
    Model::parse(GOOD).unwrap();
    let deep = format!("e = \"{}v{}\"", "(".repeat(150), ")".repeat(150));
    let long = format!("e = \"v{}\"", " + v".repeat(400));
    let longer = format!("e = \"{}\"", "v + ".repeat(2000) + "v");
    // What is replaced, by what, the line and column of the fault, and a part of the message.
    let cases: Vec<(&str, &str, u64, &str, &str)> = vec![
        ("format = 1", "format = 2", 1, "10", "format is not known"),
        ("format = 1\n", "", 1, "1", "format is missing"),
        ("format = 1", "format = 1\nformat = 1", 2, "1", "duplicate key"),
        ("[let]", "[lets]", 10, "2", "\"lets\" is not a section"),
        ("[let]", "[let", 10, "5", "unclosed"),
        ("name = \"m\"", "name = 5", 2, "8", "is not a text"),
        ("{ unit = \"V\" }", "5", 4, "5", "is not a table"),
        ("{ unit = \"V\" }", "{ units = \"V\" }", 4, "7", "\"units\" is not a key"),
        ("\"V\"", "\"volt\"", 4, "15", "\"volt\" is not a unit"),
        ("\"V\"", "\"V*\"", 4, "17", "a unit is missing"),
        ("m/s^2", "m/s^9", 6, "33", "exponent from 1 to 6"),
        ("\"m/s^2\"", "\"m/(s\"", 6, "33", "\")\" is missing"),
        ("value = 9.81, ", "", 6, "1", "has no value"),
        ("9.81", "\"9.81\"", 6, "15", "not a finite number"),
        ("9.81", "inf", 6, "15", "not a finite number"),
        ("min = 0.1, max = 10", "max = 10", 8, "1", "\"R\" has no min"),
        ("min = 0.1, max = 10", "min = 0.1", 8, "1", "\"R\" has no max"),
        ("min = 0.1, max = 10", "min = 10, max = 0.1", 8, "37", "bounds of R are 10 and 0.1"),
        ("min = 0.1", "min = 0", 8, "27", "log = true and the lower bound 0"),
        ("log = true }\nL", "log = 1 }\nL", 8, "48", "neither true nor false"),
        ("min = 0.1, max = 10, log = true", "min = 0.1, max = 10, value = 20", 8, "50", "outside its bounds"),
        ("[constants]", "[constants]\nR = 5", 9, "1", "\"R\" is declared twice"),
        ("[constants]", "[constants]\nsin = 5", 6, "1", "name of a function"),
        ("[constants]", "[constants]\n\"a b\" = 5", 6, "1", "cannot be a name"),
        ("[constants]", "[constants]\npi = 3", 6, "1", "name of a function or a number"),
        ("v - R*i", "v - R*j", 11, "12", "\"j\" is not known"),
        ("v - R*i", "v - r*i", 11, "10", "\"r\" is not known"),
        ("v - R*i", "v - R i", 11, "12", "\"i\" is not expected here"),
        ("v - R*i", "v - R*", 11, "12", "a value is missing at the end"),
        ("v - R*i", "v - *R", 11, "10", "a value is missing before \"*\""),
        ("v - R*i", "(v - R*i", 11, "14", "\")\" is missing before the end"),
        ("v - R*i", "v - R*i)", 11, "13", "\")\" is not expected"),
        ("v - R*i", "v - 2R*i", 11, "11", "a number is followed by a name"),
        ("v - R*i", "v - 1.2.3*R*i", 11, "13", "two points"),
        ("v - R*i", "v - R**i", 11, "11", "\"**\" is not an operator"),
        ("v - R*i", "v - R·i", 11, "11", "is not an operator"),
        ("v - R*i", "v - R$i", 11, "11", "has no meaning"),
        ("v - R*i", "v - sine(R)*i", 11, "10", "\"sine\" is not a function"),
        ("v - R*i", "v - ln(2)*R*i", 11, "10", "\"ln\" is not a function"),
        ("v - R*i", "v - min(R)*i", 11, "10", "min has 2 arguments, found 1"),
        ("v - R*i", "v - R*i*w < 0", 11, "14", "\"w\" is not known"),
        ("v - R*i", "select(v, v, R*i)", 11, "13", "a condition is expected"),
        ("v - R*i", "v < 0", 11, "8", "a condition stands where a number"),
        ("v - R*i", "select(0*v < v < v, v, v)", 11, "21", "comparisons cannot be chained"),
        ("v - R*i", "v - R", 11, "8", "- joins V and ohm"),
        ("v - R*i", "v - R*i + 1", 11, "14", "+ joins V and 1"),
        ("v - R*i", "v - R*i*sin(v)", 11, "14", "sin of a quantity with the unit V"),
        ("v - R*i", "v - R*i^v", 11, "13", "an exponent with the unit V"),
        ("v - R*i", "v - R*i^0.3*i", 11, "13", "the power 0.3"),
        ("v - R*i", "v - R*i/0", 11, "13", "division by zero"),
        ("v - R*i", "v - R*i + stick(v, v)", 11, "22", "is not a state"),
        ("v - R*i", "v - R*i - R*stick(i, i)*abs(stick(i, i))/i", 13, "1", "by more than a factor"),
        ("v - R*i", "v - R*i + e", 11, "16", "\"e\" depends on itself"),
        ("d = \"e/L\"", "d = \"e\"", 13, "24", "expected A/s"),
        ("d = \"e/L\", ", "", 13, "1", "has no d"),
        ("\"measured\" }", "\"measure\" }", 13, "41", "\"measure\" is not known"),
        ("value = \"i\"", "value = \"2*i\"", 13, "40", "no output is the state i"),
        ("i = { value = \"i\", unit = \"A\" }", "", 13, "40", "no output is the state"),
        ("[outputs]", "[outputs]\nv = { value = \"stick(i, 0)\", unit = \"1\" }", 15, "16", "no meaning here"),
        ("unit = \"A\" }\n", "unit = \"V\" }\n", 15, "16", "output i has the unit A, expected V"),
        ("[let]", "K = { unit = \"1\", min = 0, max = 1 }\n[let]", 10, "1", "\"K\" has no effect on i"),
        ("e = \"v - R*i\"", &deep, 11, "106", "nested deeper than 100"),
        ("e = \"v - R*i\"", &long, 11, "1204", "more than 300 operators"),
        ("e = \"v - R*i\"", &longer, 11, "6", "an expression of 8001 bytes"),
    ];
    assert!(cases.len() >= 60);
    for (from, to, line, column, message) in cases {
        let text = GOOD.replacen(from, to, 1);
        assert_ne!(text, GOOD, "{from}");
        let error = match Model::parse(&text) {
            Err(error) => error,
            Ok(_) => panic!("accepted: {from} → {to}"),
        };
        let found = (error.line(), error.column());
        assert_eq!(found, (Some(line), Some(column)), "{from} → {to}: {error}");
        assert!(error.to_string().contains(message), "{from} → {to}: {error}");
        assert!(!error.hint().is_empty(), "{error}");
    }
}

#[test]
fn large_models_are_refused_and_stiff_ones_answered() {
    let many: String = (0..100).map(|n| format!("p{n} = {{ min = 0, max = 1 }}\n")).collect();
    let error = Model::parse(&GOOD.replacen("[let]", &(many + "[let]"), 1)).unwrap_err();
    assert!(error.to_string().contains("102 items, expected at most 64"), "{error}");
    let huge = format!("{GOOD}# {}", "x".repeat(2 << 20));
    assert!(Model::parse(&huge).unwrap_err().to_string().contains("bytes"));
    // Twenty squares of sums of squares: a million terms if they were multiplied out.
    let mut lets = String::from("a0 = \"i/i + sin(i/i)\"\n");
    for n in 1..20 {
        lets += &format!("a{n} = \"(a{0} + 1)*(a{0} - 2)\"\n", n - 1);
    }
    let text = GOOD.replacen("[let]", &format!("[let]\n{lets}"), 1).replacen("v - R*i", "v - R*i*a19", 1);
    Model::parse(&text).unwrap();
    // Exploding and stiff: an answer or an error, in finite time.
    let input = square(300, 50, 1.0, -1.0);
    let measured = Some(input.iter().enumerate().map(|(n, v)| v + (count(n) * 0.3).sin()).collect::<Vec<f64>>());
    for (equation, bounds) in [
        ("(v + R*i)/L", "min = 1e3, max = 1e9"),
        ("(v - R*i)/L", "min = 1e6, max = 1e12"),
        ("(v - R*i*exp(i/g))/L", "min = 1, max = 10"),
    ] {
        let text = GOOD
            .replacen("\"e/L\"", &format!("\"{equation}\""), 1)
            .replacen("min = 0.1, max = 10", bounds, 1)
            .replacen("{ value = 9.81, unit = \"m/s^2\" }", "{ value = 1, unit = \"A\" }", 1);
        let model = Model::parse(&text).unwrap();
        let recording = recording(0.01, vec![input.clone()], vec![measured.clone()]);
        let found = identify_model(&model, &[recording], &ModelSpec::default(), &mut |_| ControlFlow::Continue(()));
        match found {
            Ok(found) => assert_ne!(found.trust.level, TrustLevel::Good, "{equation}: {:?}", found.trust),
            Err(error) => assert!(!error.hint().is_empty(), "{error}"),
        }
    }
}
