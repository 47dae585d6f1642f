//! Delayed signals in outputs and states, on even and irregular clocks, against closed forms and a simulation with fine steps.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::differences::{Derivative, derivatives};
use super::*;
use motorfit_core::numeric::{count, rms};
use motorfit_model::{IntegrationMethod, Model, reference};

/// A resistor whose current is measured beside a filtered voltage, both of a delayed one.
const TEXT: &str = r#"
format = 1
name = "resistor"
[inputs]
v = { unit = "V" }
[parameters]
R  = { unit = "ohm", min = 0.1, max = 100, log = true }
td = { unit = "s", min = 0, max = 0.05 }
tl = { unit = "s", min = 0, max = 0.05 }
T  = { unit = "s", min = 0.001, max = 1, log = true }
[signals]
vm = { value = "v", unit = "V", delay = "td", latency = "tl" }
[states]
h = { unit = "V", d = "(vm - h)/T", initial = 0 }
[outputs]
i = { value = "vm/R", unit = "A" }
h = { value = "h", unit = "V" }
"#;

const STEP_S: f64 = 1e-3;
const SAMPLES: usize = 60;
const METHODS: [IntegrationMethod; 2] = [IntegrationMethod::Exponential, IntegrationMethod::RungeKutta];

/// Returns the times of an even clock, or of one whose steps differ.
fn clock(is_even: bool) -> Vec<f64> {
    let step = |n: usize| if is_even { STEP_S } else { STEP_S * (1.0 + 0.3 * (1.7 * count(n)).sin()) };
    (0..SAMPLES).map(|n| (0..n).map(step).sum()).collect()
}

fn voltage() -> Vec<f64> {
    (0..SAMPLES).map(|n| if n < 5 { 1.0 } else { 6.0 * (count(n * n) * 0.37).sin() }).collect()
}

fn problem(time_s: &[f64], is_first_order_hold: bool, (method, substeps): (IntegrationMethod, usize)) -> ModelProblem {
    let model = Model::parse(TEXT).unwrap();
    let steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let is_even = steps.iter().all(|step| (step / steps[0] - 1.0).abs() < 1e-9);
    let recording = ModelRecording {
        step_s: if is_even { vec![STEP_S] } else { steps.iter().copied().chain([STEP_S]).collect() },
        inputs: vec![voltage()],
        measured: vec![Some(time_s.to_vec()); 2],
        counting: Vec::new(),
        effective_sample_ratio: 1.0,
        name: None,
        assumed: None,
        time_s: time_s.to_vec(),
    };
    let settings = ModelSettings { method: Some((method, substeps)), is_first_order_hold, ..ModelSettings::default() };
    ModelProblem::new(&model, ModelSpace::new(&model, 1), vec![recording], settings).unwrap()
}

/// Returns the voltage at a time: the one before the first sample is the first one, and an instant at a sample has its value.
fn voltage_at(time_s: &[f64], at: f64, is_first_order_hold: bool) -> f64 {
    let values = voltage();
    let n = time_s.iter().rposition(|time| *time <= at + 1e-9 * STEP_S).unwrap_or(0);
    match is_first_order_hold && at > 0.0 && n + 1 < SAMPLES {
        true => values[n] + (at - time_s[n]) / (time_s[n + 1] - time_s[n]) * (values[n + 1] - values[n]),
        false => values[n],
    }
}

#[test]
fn an_output_has_the_delayed_signal_at_its_instant() {
    for (is_even, is_first_order_hold) in [(true, false), (true, true), (false, false), (false, true)] {
        let time_s = clock(is_even);
        for (method, td) in METHODS.into_iter().flat_map(|of| [0.0, 0.4, 1.0, 1.2, 2.0, 3.5, 40.3].map(|td| (of, td))) {
            let td = td * STEP_S;
            let problem = problem(&time_s, is_first_order_hold, (method, 2));
            let found = &problem.simulate(&[2.0, td, 0.0, 0.02], 0, &[]).outputs[0];
            for n in 0..SAMPLES {
                let at = |time: f64| voltage_at(&time_s, time - td, is_first_order_hold) / 2.0;
                let expected = at(time_s[n]);
                // On an uneven clock a jump may follow within the thousandth of a step over which a hold moves.
                let is_jump = !is_first_order_hold && (expected - at(time_s[n] + 2e-3 * STEP_S)).abs() > 0.0;
                assert!(
                    is_jump && !is_even || (found[n] - expected).abs() < 1e-9,
                    "{method:?} {is_even} {is_first_order_hold} {td}: sample {n}: {} {expected}",
                    found[n]
                );
            }
        }
    }
}

#[test]
fn a_latency_keeps_the_first_value_in_an_output() {
    let time_s = clock(true);
    let (td, latency) = (1.2e-3, 3.5e-3);
    let problem = problem(&time_s, false, (IntegrationMethod::Exponential, 1));
    let found = &problem.simulate(&[1.0, td, latency, 0.02], 0, &[]).outputs[0];
    for (n, time) in time_s.iter().enumerate() {
        // The voltage changes at 5 ms.
        let is_first = time - td < 5e-3 + latency;
        let expected = if is_first { 1.0 } else { voltage_at(&time_s, time - td, false) };
        assert!((found[n] - expected).abs() < 1e-9, "sample {n}: {} {expected}", found[n]);
    }
}

#[test]
fn a_state_follows_the_delayed_signal_with_both_holds() {
    const FINE: usize = 200;
    let model = Model::parse(TEXT).unwrap();
    let time_s = clock(true);
    for is_first_order_hold in [false, true] {
        // Fine steps of the interpolated voltage, each with its mean; the delays are whole numbers of them.
        let fine: Vec<f64> = (0..(SAMPLES - 1) * FINE)
            .map(|n| voltage_at(&time_s, (count(n) + 0.5) * STEP_S / count(FINE), is_first_order_hold))
            .collect();
        for td in [0.0, 0.4, 1.2, 2.0] {
            let values = [2.0, td * STEP_S, 0.0, 0.02];
            let expected =
                reference::simulate(&model, &values, &[], std::slice::from_ref(&fine), STEP_S / count(FINE), 1);
            let expected: Vec<f64> = expected[1].iter().step_by(FINE).copied().collect();
            for (method, substeps) in [(METHODS[0], 1), (METHODS[0], 4), (METHODS[1], 4)] {
                let problem = problem(&time_s, is_first_order_hold, (method, substeps));
                let found = &problem.simulate(&values, 0, &[]).outputs[1];
                let error: Vec<f64> = found.iter().zip(&expected).map(|(a, b)| a - b).collect();
                let error = rms(&error) / rms(&expected);
                // The mean over a substep h in place of a signal that jumps within it: up to (h/T)²/8 of the jump, which is some ten
                // times as large as the state.
                let limit = 4e-3 / count(substeps * substeps);
                assert!(error < limit, "{is_first_order_hold} {td} {method:?} {substeps}: {error:e}");
            }
        }
    }
}

#[test]
fn derivatives_of_delayed_signals_are_those_of_differences() {
    for (is_even, is_first_order_hold) in [(true, false), (true, true), (false, true)] {
        let problem = problem(&clock(is_even), is_first_order_hold, (IntegrationMethod::Exponential, 2));
        let values = [2.0, 1.2371e-3, 1.313e-3, 0.02];
        for Derivative { parameter, output, own, difference } in derivatives(&problem, &values) {
            for (sample, (own, difference)) in own.iter().zip(&difference).enumerate() {
                // Rounding over the step of the difference.
                assert!((own - difference).abs() < 1e-6, "{parameter} {output} sample {sample}: {own} {difference}");
            }
        }
    }
}
