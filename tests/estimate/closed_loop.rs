//! Proves: right fits in a closed loop, of own models and of the built-in motor, whose input is computed from the measurements, are certified
//! over seeds, and missing effects are still found there; an output with direct feedthrough is tested at lag 0.
//! Does not prove: that a law which acts between samples is seen.
#![allow(clippy::unwrap_used, reason = "a test may stop")]

use motorfit::analysis::ResidualTest;
use motorfit::evaluate::model::ModelRecording;
use motorfit::experiment::white_noise;
use motorfit::identify::model::{ModelIdentification, ModelSpec, identify_model};
use motorfit::identify::{IdentifySpec, TrustLevel, identify};
use motorfit::model::Model;
use motorfit::motor::Parameters;
use motorfit::numeric::count;
use motorfit::record::{ReadOptions, Record, read_bytes};
use std::fmt::Write as _;
use std::ops::ControlFlow;

const STEP_S: f64 = 5e-3;
const SAMPLES: usize = 1000;
const SEEDS: u64 = 20;
/// Standard deviations of the noise of angle \[rad\] and speed \[rad/s\].
const SIGMA: [f64; 2] = [2e-3, 2e-2];
/// True values of k, g and b.
const TRUTH: [f64; 3] = [20.0, 30.0, 2.0];

const MODEL: &str = r#"
format = 1
name = "Pendulum with a motor"

[inputs]
v = { unit = "V" }

[parameters]
k = { unit = "rad/s^2/V", min = 1,   max = 100, log = true }
g = { unit = "rad/s^2",   min = 1,   max = 300, log = true }
b = { unit = "1/s",       min = 0.1, max = 20,  log = true }

[states]
q = { unit = "rad",   d = "w", initial = 0 }
w = { unit = "rad/s", d = "k*v - g*sin(q) - b*w", initial = 0 }

[outputs]
q = { value = "q", unit = "rad" }
w = { value = "w", unit = "rad/s" }
"#;

/// An effect that the machine has and the model lacks.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Missing {
    Nothing,
    /// The voltage acts one period later.
    Delay,
    /// Friction that grows with the square of the speed.
    Quadratic,
    /// The voltage is reported one period late.
    LateVoltage,
}

/// Returns the states after a period, by twenty steps of the classical Runge–Kutta method.
fn after(mut x: [f64; 2], step_s: f64, right: impl Fn([f64; 2]) -> [f64; 2]) -> [f64; 2] {
    let h = step_s / 20.0;
    for _ in 0..20 {
        let moved = |by: [f64; 2], f: f64| [x[0] + f * by[0], x[1] + f * by[1]];
        let k1 = right(x);
        let k2 = right(moved(k1, 0.5 * h));
        let k3 = right(moved(k2, 0.5 * h));
        let k4 = right(moved(k3, h));
        x = std::array::from_fn(|s| x[s] + h / 6.0 * (k1[s] + 2.0 * (k2[s] + k3[s]) + k4[s]));
    }
    x
}

/// Simulates the pendulum under a law that computes the voltage from the sample and the measured angle and speed there, and holds it
/// over the period.
fn simulated(seed: u64, missing: Missing, law: impl Fn(usize, [f64; 2]) -> f64) -> ModelRecording {
    let [angle, speed] = SIGMA;
    let noise = white_noise(SAMPLES, angle, seed, 0).into_iter().zip(white_noise(SAMPLES, speed, seed, 1));
    let [k, g, b] = TRUTH;
    let quadratic = if missing == Missing::Quadratic { 0.1 } else { 0.0 };
    let (mut x, mut before) = ([0.0_f64; 2], 0.0);
    let (mut inputs, mut measured) = (Vec::new(), vec![Vec::new(); 2]);
    for (n, noise) in noise.enumerate() {
        let seen = [x[0] + noise.0, x[1] + noise.1];
        seen.iter().zip(&mut measured).for_each(|(value, signal)| signal.push(*value));
        let v = law(n, seen);
        inputs.push(if missing == Missing::LateVoltage { before } else { v });
        let acting = if missing == Missing::Delay { before } else { v };
        let right = |x: [f64; 2]| [x[1], k * acting - g * x[0].sin() - b * x[1] - quadratic * x[1] * x[1].abs()];
        x = after(x, STEP_S, right);
        before = v;
    }
    ModelRecording {
        time_s: (0..SAMPLES).map(|n| count(n) * STEP_S).collect(),
        step_s: vec![STEP_S],
        inputs: vec![inputs],
        measured: measured.into_iter().map(Some).collect(),
        counting: Vec::new(),
        effective_sample_ratio: 1.0,
        name: None,
        assumed: None,
    }
}

/// A servo that follows a chirp.
fn servo(n: usize, [angle, speed]: [f64; 2]) -> f64 {
    let time = count(n) * STEP_S;
    8.0 * ((3.0 * time + 2.0 * time * time).sin() - angle) - 0.2 * speed
}

fn fit(text: &str, recording: ModelRecording) -> ModelIdentification {
    let model = Model::parse(text).unwrap();
    identify_model(&model, &[recording], &ModelSpec::default(), &mut |_| ControlFlow::Continue(())).unwrap()
}

/// Returns for how many seeds the residuals depend on the input, for how many they are judged to lack an effect for this or another
/// reason, and for how many the result is certified.
fn judged(missing: Missing) -> [u32; 3] {
    let mut counts = [0; 3];
    for seed in 0..SEEDS {
        let found = fit(MODEL, simulated(seed, missing, servo));
        let depends = |test: &ResidualTest| test.voltage.is_some_and(|v| !v.is_independent);
        counts[0] += u32::from(found.fits[0].residuals.iter().flatten().any(depends));
        counts[1] += u32::from(found.trust.reasons.iter().any(|reason| reason.code == "residuals"));
        counts[2] += u32::from(found.trust.level == TrustLevel::Good);
    }
    counts
}

#[test]
fn right_fits_in_a_closed_loop_are_certified() {
    // The level of the test is 1e-4 and that of the whiteness test 1e-3: one of 40 residuals has a probability of 4 %, two of 0.1 %.
    let [alarms, _, good] = judged(Missing::Nothing);
    assert!(alarms == 0 && good >= 19, "{alarms} alarms, {good} of {SEEDS} good");
}

#[test]
fn missing_effects_in_a_closed_loop_are_found() {
    for missing in [Missing::Delay, Missing::Quadratic, Missing::LateVoltage] {
        let [depends, lacks, good] = judged(missing);
        assert!(lacks == 20 && good == 0, "{missing:?}: {lacks} of {SEEDS} lack an effect, {good} are good");
        // Friction that grows with the square of the speed leaves residuals that are correlated, but hardly with the voltage.
        assert!(missing == Missing::Quadratic || depends >= 19, "{missing:?}: {depends} of {SEEDS}");
    }
}

/// Simulates the motor M2 under a law that computes the voltage from the measured speed; the voltage acts some periods later.
fn controlled_motor(seed: u64, periods: usize) -> Record {
    const STEP_S: f64 = 1e-3;
    let [r, l, k, b, j] = Parameters::M2.to_array();
    let noise = [(0.03, 0), (1.0, 1)].map(|(sigma, stream)| white_noise(1500, sigma, seed, stream));
    let (mut x, mut sum, mut voltages) = ([0.0_f64; 2], 0.0, Vec::new());
    let mut text = "time_s,voltage_V,current_A,speed_rad_s\n".to_owned();
    for n in 0..1500 {
        let seen = [x[0] + noise[0][n], x[1] + noise[1][n]];
        let reference = if n < 100 { 0.0 } else { [60.0, 100.0, 30.0, -40.0][n / 200 % 4] };
        sum += STEP_S * (reference - seen[1]);
        let v = 0.5 * (reference - seen[1]) + 5.0 * sum;
        voltages.push(v);
        let _ = writeln!(text, "{},{v:e},{:e},{:e}", count(n) * STEP_S, seen[0], seen[1]);
        let acting = voltages[n.saturating_sub(periods)];
        let right = |[i, w]: [f64; 2]| [(acting - r * i - k * w) / l, (k * i - b * w) / j];
        x = after(x, STEP_S, right);
    }
    read_bytes(text.as_bytes(), None, &ReadOptions::default()).unwrap().remove(0)
}

#[test]
fn the_motor_is_certified_in_a_closed_loop_and_a_late_voltage_is_found() {
    for periods in [0, 1] {
        let (mut depend, mut good) = (0, 0);
        for seed in 0..SEEDS {
            let found = identify(&[controlled_motor(seed, periods)], &IdentifySpec::default()).unwrap();
            let depends = |test: &ResidualTest| test.voltage.is_some_and(|v| !v.is_independent);
            depend += u64::from(found.residual_tests[0].iter().flatten().any(depends));
            good += u64::from(found.trust.level == TrustLevel::Good);
        }
        // With the voltage of the same sample, 16 of 20 right fits depended on it: it contains the noise of the speed. Levels of the tests
        // as above.
        match periods {
            0 => assert!(depend == 0 && good >= 19, "{depend} alarms, {good} of {SEEDS} good"),
            _ => assert!(depend >= 19 && good == 0, "{depend} of {SEEDS} depend on the voltage, {good} are good"),
        }
    }
}

#[test]
fn an_output_with_feedthrough_is_tested_at_the_same_sample() {
    // The model of the current has 2 % more of the voltage than the machine: of a random voltage no other sample tells of it.
    let winding =
        "[constants]\nR = { value = 2, unit = \"ohm\" }\nK = { value = 0.5, unit = \"V*s/rad\" }\n\n[parameters]";
    let current = "[outputs]\ni = { value = \"(v - K*w)/R\", unit = \"A\" }";
    let text = MODEL.replace("[parameters]", winding).replace("[outputs]", current);
    let model = Model::parse(&text).unwrap();
    let feedthrough: Vec<bool> = (0..3).map(|output| model.has_feedthrough(0, output)).collect();
    assert_eq!(feedthrough, [true, false, false]);
    let random = white_noise(SAMPLES, 3.0, 1, 2);
    let recorded = simulated(1, Missing::Nothing, |n, _| random[n]);
    for (factor, is_independent) in [(1.0, true), (0.98, false)] {
        let mut recorded = recorded.clone();
        let noise = white_noise(SAMPLES, 0.01, 1, 3);
        let signals = random.iter().zip(recorded.measured[1].as_ref().unwrap()).zip(noise);
        // The noise of the speed that is in it too is half as large as that of the current.
        let current = signals.map(|((v, w), noise)| (factor * v - 0.5 * w) / 2.0 + noise).collect();
        recorded.measured.insert(0, Some(current));
        let found = fit(&text, recorded);
        let test = found.fits[0].residuals[0].unwrap().voltage.unwrap();
        assert_eq!(test.is_independent, is_independent, "{factor}: {test:?}");
    }
}

#[test]
fn feedthrough_is_direct_or_by_a_delayed_signal() {
    let text = r#"
format = 1
name = "Forms of feedthrough"
[inputs]
u = { unit = "1" }
v = { unit = "1" }
[parameters]
T = { unit = "s", min = 0.1, max = 10 }
[signals]
late = { value = "u", unit = "1", delay = "0.01*T" }
[let]
rate = "(u + v - x)/T"
[states]
x = { unit = "1", d = "rate", initial = 0 }
[outputs]
state = { value = "x", unit = "1" }
own = { value = "x + 0.1*v", unit = "1" }
delayed = { value = "x + late", unit = "1" }
"#;
    let model = Model::parse(text).unwrap();
    let of = |input: usize| -> Vec<bool> { (0..4).map(|output| model.has_feedthrough(input, output)).collect() };
    // There is no fourth output.
    assert_eq!(of(0), [false, false, true, false]);
    assert_eq!(of(1), [false, true, false, false]);
}
