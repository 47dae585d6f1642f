//! Proves: a servo whose control law is sampled is identified with `hold`, against a simulation by hand with fine steps; with the law as a
//! continuous one the result is not `good`, with the reason; where the law is continuous, it is.
//! Does not prove: laws whose instants are not those of the recording.
#![allow(clippy::unwrap_used, reason = "a test may stop")]

use motorfit::evaluate::model::ModelRecording;
use motorfit::experiment::white_noise;
use motorfit::identify::TrustLevel;
use motorfit::identify::model::{ModelIdentification, ModelSpec, identify_model};
use motorfit::model::Model;
use motorfit::numeric::count;
use std::ops::ControlFlow;

const STEP_S: f64 = 5e-3;
const SAMPLES: usize = 800;
/// Values of G, J, B, K and R.
const TRUTH: [f64; 5] = [1.2, 0.055, 0.07, 1.1, 4.2];

fn servo(law: &str) -> Model {
    let text = format!(
        r#"
format = 1
name = "servo"
[inputs]
ref = {{ unit = "rad" }}
[constants]
umax = {{ value = 12, unit = "V" }}
kp = {{ value = 45, unit = "V/rad" }}
kd = {{ value = 0.9, unit = "V*s/rad" }}
Ts = {{ value = 5, unit = "ms" }}
[parameters]
G = {{ unit = "N*m", min = 0.1, max = 10, log = true }}
J = {{ unit = "kg*m^2", min = 0.01, max = 0.3, log = true }}
B = {{ unit = "N*m*s/rad", min = 0.005, max = 0.5, log = true }}
K = {{ unit = "V*s/rad", min = 0.3, max = 3, log = true }}
R = {{ unit = "ohm", min = 1, max = 20, log = true }}
[let]
u = "{law}"
i = "(u - K*w)/R"
[states]
q = {{ unit = "rad", d = "w", initial = 0 }}
w = {{ unit = "rad/s", d = "(K*i - G*sin(q) - B*w)/J", initial = 0 }}
[outputs]
q = {{ value = "q", unit = "rad" }}
i = {{ value = "i", unit = "A" }}
"#
    );
    Model::parse(&text).unwrap()
}

/// Simulates the servo in steps of 50 µs; its law is sampled with the recording, or computed at each of these steps.
fn recording(is_sampled: bool, seed: u64) -> ModelRecording {
    const FINE: usize = 100;
    let [g, j, b, k, r] = TRUTH;
    let h = STEP_S / count(FINE);
    // Slow enough that the voltage is mostly within its limits, where the law acts.
    let reference: Vec<f64> =
        (0..SAMPLES).map(|n| 0.6 * (0.019 * count(n)).sin() + 0.15 * (0.083 * count(n)).sin()).collect();
    let (mut x, mut outputs) = ([0.0_f64, 0.0], [Vec::new(), Vec::new()]);
    for reference in &reference {
        let law = |x: [f64; 2]| (45.0 * (reference - x[0]) - 0.9 * x[1]).clamp(-12.0, 12.0);
        let held = law(x);
        outputs[0].push(x[0]);
        outputs[1].push((held - k * x[1]) / r);
        for _ in 0..FINE {
            let right = |x: [f64; 2]| {
                let u = if is_sampled { held } else { law(x) };
                [x[1], (k * (u - k * x[1]) / r - g * x[0].sin() - b * x[1]) / j]
            };
            let moved = |d: [f64; 2], h: f64| [x[0] + h * d[0], x[1] + h * d[1]];
            let k1 = right(x);
            let k2 = right(moved(k1, 0.5 * h));
            let k3 = right(moved(k2, 0.5 * h));
            let k4 = right(moved(k3, h));
            x = [0, 1].map(|s| x[s] + h / 6.0 * (k1[s] + 2.0 * (k2[s] + k3[s]) + k4[s]));
        }
    }
    let noisy = |output: usize, sigma: f64| {
        let noise = white_noise(SAMPLES, sigma, seed, output as u64);
        Some(outputs[output].iter().zip(noise).map(|(a, b)| a + b).collect::<Vec<f64>>())
    };
    ModelRecording {
        time_s: (0..SAMPLES).map(|n| count(n) * STEP_S).collect(),
        step_s: vec![STEP_S],
        measured: vec![noisy(0, 5e-4), noisy(1, 0.012)],
        inputs: vec![reference],
        counting: Vec::new(),
        effective_sample_ratio: 1.0,
        name: None,
        assumed: None,
    }
}

const LAW: &str = "clamp(kp*(ref - q) - kd*w, -umax, umax)";

fn identified(model: &Model, is_sampled: bool, seed: u64) -> ModelIdentification {
    let recordings = [recording(is_sampled, seed)];
    identify_model(model, &recordings, &ModelSpec::default(), &mut |_| ControlFlow::Continue(())).unwrap()
}

/// Returns the errors of the estimates, in standard errors.
fn errors(found: &ModelIdentification) -> Vec<f64> {
    let errors = &found.uncertainty.as_ref().unwrap().std_error;
    found.values.iter().zip(TRUTH).zip(errors).map(|((value, truth), error)| (value - truth) / error.unwrap()).collect()
}

#[test]
fn a_sampled_law_is_identified_and_a_continuous_one_in_its_place_is_not_trusted() {
    let held = identified(&servo(&format!("hold({LAW}, Ts)")), true, 1);
    // The probability of a larger error is 6e-5 for each of five.
    assert!(errors(&held).iter().all(|z| z.abs() < 4.0), "{:?}", errors(&held));
    assert_eq!(held.trust.level, TrustLevel::Good, "{:?}", held.trust);
    let continuous = identified(&servo(LAW), true, 1);
    assert!(errors(&continuous).iter().any(|z| z.abs() > 8.0), "{:?}", errors(&continuous));
    assert_eq!(continuous.trust.level, TrustLevel::Check, "{:?}", continuous.trust);
    let codes: Vec<&str> = continuous.trust.reasons.iter().map(|reason| reason.code).collect();
    assert!(codes.contains(&"sampled_law"), "{codes:?}");
    assert!(continuous.trust.next.is_some());
    assert!(continuous.warnings.iter().any(|warning| warning.code == "continuous_law"));
    assert!(held.warnings.is_empty(), "{:?}", held.warnings);
}

#[test]
fn a_continuous_law_is_identified_as_it_is() {
    // The recording does not tell the law from a sampled one, so that the level is not good; the estimates are right.
    let found = identified(&servo(LAW), false, 2);
    assert!(errors(&found).iter().all(|z| z.abs() < 4.0), "{:?}", errors(&found));
    let held = identified(&servo(&format!("hold({LAW}, Ts)")), false, 2);
    assert!(errors(&held).iter().any(|z| z.abs() > 8.0), "{:?}", errors(&held));
}
