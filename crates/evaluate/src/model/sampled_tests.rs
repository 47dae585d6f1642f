//! Sampled laws (`hold`) against a simulation written by hand: fine Runge–Kutta steps of the machine, and a law that is computed at its
//! instants.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::differences::{Derivative, derivatives};
use super::*;
use motorfit_core::candidates::Candidates;
use motorfit_core::numeric::{count, rms};
use motorfit_model::{IntegrationMethod, Model};

const STEP_S: f64 = 5e-3;
const SAMPLES: usize = 160;
/// Values of G, J, B, K, R, kp, kd.
const VALUES: [f64; 7] = [1.2, 0.055, 0.07, 1.1, 4.2, 45.0, 0.9];
const UMAX: f64 = 12.0;
const METHODS: [IntegrationMethod; 2] = [IntegrationMethod::Exponential, IntegrationMethod::RungeKutta];

/// A servo whose law is sampled with a period [ms]; with `is_late` the voltage acts two and a half samples later.
fn servo(period_ms: f64, is_late: bool) -> Model {
    let law = "hold(clamp(kp*(ref - q) - kd*w, -umax, umax), Ts)";
    let (signals, own) = match is_late {
        true => (format!("[signals]\nu = {{ value = \"{law}\", unit = \"V\", delay = \"td\" }}"), String::new()),
        false => (String::new(), format!("u = \"{law}\"")),
    };
    let text = format!(
        r#"
format = 1
name = "servo"
[inputs]
ref = {{ unit = "rad" }}
[constants]
umax = {{ value = 12, unit = "V" }}
Ts = {{ value = {period_ms}, unit = "ms" }}
td = {{ value = 12.5, unit = "ms" }}
[parameters]
G = {{ unit = "N*m", min = 1e-3, max = 10 }}
J = {{ unit = "kg*m^2", min = 1e-5, max = 1 }}
B = {{ unit = "N*m*s/rad", min = 1e-6, max = 1 }}
K = {{ unit = "V*s/rad", min = 0.01, max = 2 }}
R = {{ unit = "ohm", min = 0.1, max = 20 }}
kp = {{ unit = "V/rad", min = 0.1, max = 500 }}
kd = {{ unit = "V*s/rad", min = 1e-3, max = 20 }}
{signals}
[let]
{own}
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

fn reference(n: usize) -> f64 {
    if n < 4 { 0.0 } else { 0.8 * (0.09 * count(n)).sin() + 0.3 * (0.31 * count(n)).cos() }
}

fn clock(is_even: bool) -> Vec<f64> {
    let step = |n: usize| if is_even { STEP_S } else { STEP_S * (1.0 + 0.3 * (1.7 * count(n)).sin()) };
    (0..SAMPLES).map(|n| (0..n).map(step).sum()).collect()
}

/// Simulates the servo in steps of 10 µs, with the law at the multiples of its period; `late_s` is the delay of the voltage.
fn expected(time_s: &[f64], period_s: f64, late_s: f64) -> [Vec<f64>; 2] {
    const H: f64 = 1e-5;
    let [g, j, b, k, r, kp, kd] = VALUES;
    let (mut x, mut outputs) = ([0.0_f64, 0.0], [Vec::new(), Vec::new()]);
    let mut laws: Vec<f64> = Vec::new();
    let (mut step, mut n) = (0_u32, 0);
    while outputs[0].len() < SAMPLES {
        let time = H * f64::from(step);
        if n + 1 < SAMPLES && time_s[n + 1] <= time + 0.1 * H {
            n += 1;
        }
        if count(laws.len()) * period_s <= time + 0.1 * H {
            laws.push((kp * (reference(n) - x[0]) - kd * x[1]).clamp(-UMAX, UMAX));
        }
        let of = ((time - late_s + 0.1 * H) / period_s).floor().max(0.0);
        let u = laws[(0..laws.len()).rposition(|law| count(law) <= of).unwrap()];
        if time_s[outputs[0].len()] <= time + 0.1 * H {
            outputs[0].push(x[0]);
            outputs[1].push((u - k * x[1]) / r);
        }
        let right = |x: [f64; 2]| [x[1], (k * (u - k * x[1]) / r - g * x[0].sin() - b * x[1]) / j];
        let moved = |d: [f64; 2], h: f64| [x[0] + h * d[0], x[1] + h * d[1]];
        let k1 = right(x);
        let k2 = right(moved(k1, 0.5 * H));
        let k3 = right(moved(k2, 0.5 * H));
        let k4 = right(moved(k3, H));
        for s in 0..2 {
            x[s] += H / 6.0 * (k1[s] + 2.0 * (k2[s] + k3[s]) + k4[s]);
        }
        step += 1;
    }
    outputs
}

fn problem(model: &Model, time_s: &[f64], method: Option<(IntegrationMethod, usize)>) -> ModelProblem {
    let steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let is_even = steps.iter().all(|step| (step / steps[0] - 1.0).abs() < 1e-9);
    let recording = ModelRecording {
        step_s: if is_even { vec![STEP_S] } else { steps.iter().copied().chain([STEP_S]).collect() },
        inputs: vec![(0..SAMPLES).map(reference).collect()],
        measured: vec![Some(time_s.to_vec()); 2],
        counting: Vec::new(),
        effective_sample_ratio: 1.0,
        name: None,
        assumed: None,
        time_s: time_s.to_vec(),
    };
    let settings = ModelSettings { method, ..ModelSettings::default() };
    ModelProblem::new(model, ModelSpace::new(model, 1), vec![recording], settings).unwrap()
}

fn error(found: &[f64], expected: &[f64]) -> f64 {
    rms(&found.iter().zip(expected).map(|(a, b)| a - b).collect::<Vec<f64>>()) / rms(expected)
}

#[test]
fn a_sampled_law_acts_as_one_that_is_computed_at_its_instants() {
    // The period in sampling steps, the substeps, and the error of the Runge–Kutta method or of instants between substeps.
    for (periods, substeps, limit) in [
        (1.0, 1, 1e-5),
        (1.0, 3, 1e-7),
        (2.0, 1, 1e-5),
        (3.0, 2, 1e-6),
        (0.5, 2, 1e-6),
        (0.25, 4, 1e-7),
        (0.8, 5, 1e-7),
        (1.3, 10, 1e-7),
    ] {
        let time_s = clock(true);
        let expected = expected(&time_s, periods * STEP_S, 0.0);
        let model = servo(periods * 5.0, false);
        for method in METHODS {
            let found = problem(&model, &time_s, Some((method, substeps))).simulate(&VALUES, 0, &[]).outputs;
            let errors = [0, 1].map(|output| error(&found[output], &expected[output]));
            assert!(errors.iter().all(|error| *error < limit), "{periods} periods, {method:?} {substeps}: {errors:?}");
        }
    }
}

#[test]
fn instants_between_substeps_are_taken_at_the_nearest() {
    // On an irregular clock every substep has its own length: with more of them the instants are nearer.
    let (time_s, model) = (clock(false), servo(5.0, false));
    let expected = expected(&time_s, STEP_S, 0.0);
    let of = |substeps: usize| {
        let found = problem(&model, &time_s, Some((IntegrationMethod::RungeKutta, substeps))).simulate(&VALUES, 0, &[]);
        error(&found.outputs[0], &expected[0])
    };
    let errors = [1, 4, 16].map(of);
    assert!(errors[0] < 0.1 && errors[1] < 0.05 && errors[2] < 0.003, "{errors:?}");
}

#[test]
fn a_sampled_law_may_be_late() {
    let (time_s, model) = (clock(true), servo(5.0, true));
    // The delay ends within a step: its mean over a substep acts.
    let expected = expected(&time_s, STEP_S, 0.0125);
    for method in METHODS {
        let found = problem(&model, &time_s, Some((method, 8))).simulate(&VALUES, 0, &[]).outputs;
        let errors = [0, 1].map(|output| error(&found[output], &expected[output]));
        assert!(errors.iter().all(|error| *error < 1e-5), "{method:?}: {errors:?}");
    }
}

#[test]
fn derivatives_and_costs_of_sampled_laws_agree_in_every_back_end() {
    for (is_even, period_ms, is_late) in
        [(true, 5.0, false), (true, 5.0, true), (true, 2.5, false), (true, 7.0, false), (false, 5.0, false)]
    {
        let (time_s, model) = (clock(is_even), servo(period_ms, is_late));
        for method in METHODS {
            let problem = problem(&model, &time_s, Some((method, 2)));
            let name = format!("{is_even} {period_ms} {is_late} {method:?}");
            for Derivative { parameter, output, own, difference } in derivatives(&problem, &VALUES) {
                // Rounding over the step of the difference.
                assert!(error(&own, &difference) < 1e-5, "{name} parameter {parameter} output {output}");
            }
            let mut cost = [0.0];
            problem.costs(Candidates::new(&VALUES, 7), &mut cost).unwrap();
            let walked: f64 = problem
                .walk(&VALUES, 0, SAMPLES)
                .iter()
                .zip(&problem.prepared(0).1.factors)
                .map(|(sum, factor)| sum * factor)
                .sum();
            let walked = problem.criterion().cost(walked, SAMPLES);
            assert!((cost[0] / walked - 1.0).abs() < 1e-10, "{name}: {} {walked}", cost[0]);
        }
    }
}

#[test]
fn laws_that_are_sampled_with_the_recording_need_no_finer_steps() {
    for (period_ms, events) in [(5.0, false), (10.0, false), (2.5, false), (7.0, true)] {
        let problem = problem(&servo(period_ms, false), &clock(true), None);
        assert_eq!(problem.method().has_events, events, "{period_ms} ms");
        assert_eq!(problem.method().substeps % if period_ms < 5.0 { 2 } else { 1 }, 0, "{period_ms} ms");
    }
}

#[test]
fn wrong_laws_are_errors() {
    let text = servo(5.0, false).text().to_owned();
    for (from, to, message) in [
        (", Ts)\"", ", kd)\"", "the period of hold has the unit"),
        ("umax, umax), Ts)", "umax, umax), 0*Ts)", "not a positive constant"),
        ("kd*w, -umax", "kd*w - stick(w, 1)*kp, -umax", "a sampled law depends on stick"),
    ] {
        let changed = text.replace(from, to);
        assert_ne!(changed, text);
        let error = Model::parse(&changed).unwrap_err();
        assert!(error.to_string().contains(message), "{error}");
    }
}
