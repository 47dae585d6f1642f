//! Friction that sticks is of second order in the step, also where couplings depend on inputs or states, against closed forms and a simulation
//! with fine steps.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::*;
use motorfit_core::numeric::{count, rms};
use motorfit_model::{IntegrationMethod, Model, reference};

pub(super) const METHODS: [IntegrationMethod; 2] = [IntegrationMethod::Exponential, IntegrationMethod::RungeKutta];

/// Simulates a model whose initial values are given.
pub(super) fn simulated(
    model: &Model,
    values: &[f64],
    (inputs, step_s): (&[Vec<f64>], f64),
    (method, substeps): (IntegrationMethod, usize),
) -> Vec<Vec<f64>> {
    let time_s: Vec<f64> = (0..inputs[0].len()).map(|n| count(n) * step_s).collect();
    let recording = ModelRecording {
        measured: model.outputs().iter().map(|_| Some(time_s.clone())).collect(),
        time_s,
        step_s: vec![step_s],
        inputs: inputs.to_vec(),
        counting: Vec::new(),
        effective_sample_ratio: 1.0,
        name: None,
        assumed: None,
    };
    let settings = ModelSettings { method: Some((method, substeps)), ..ModelSettings::default() };
    let problem = ModelProblem::new(model, ModelSpace::all_fixed(values), vec![recording], settings).unwrap();
    problem.simulate(&[], 0, &[]).outputs
}

/// A slide whose mass is recorded or a constant.
fn slide(mass: &str) -> Model {
    let (input, constant) = match mass {
        "input" => ("m = { unit = \"kg\" }", ""),
        _ => ("", "[constants]\nm = { value = 0.9, unit = \"kg\" }"),
    };
    let text = format!(
        r#"
format = 1
name = "slide"
[inputs]
F = {{ unit = "N" }}
{input}
{constant}
[parameters]
J  = {{ unit = "kg", min = 1e-3, max = 1 }}
Fc = {{ unit = "N", min = 0, max = 1 }}
[states]
x = {{ unit = "m", d = "p/(J + m)", initial = 0 }}
p = {{ unit = "kg*m/s", d = "F - stick(p, Fc)", initial = 0 }}
[outputs]
x = {{ value = "x", unit = "m" }}
"#
    );
    Model::parse(&text).unwrap()
}

#[test]
fn a_slide_moves_as_far_with_its_mass_as_an_input() {
    for mass in ["input", "constant"] {
        let model = slide(mass);
        for (method, steps) in METHODS.into_iter().flat_map(|method| [100, 400].map(|steps| (method, steps))) {
            let (samples, step_s) = (steps + 1, 1.0 / count(steps));
            let inputs = [vec![1.0; samples], vec![0.9; samples]];
            let inputs = &inputs[..model.inputs().len()];
            let found = simulated(&model, &[0.1, 0.5], (inputs, step_s), (method, 1));
            // (F − Fc) t²/(2 (J + m)) at 1 s; the acceleration is constant, so that steps are exact up to rounding.
            assert!(
                (found[0][samples - 1] - 0.25).abs() < 1e-12,
                "{mass} {method:?} {step_s}: {}",
                found[0][samples - 1]
            );
        }
    }
}

/// A pendulum with friction that depends on speed and load; mass and length are recorded.
const PENDULUM: &str = r#"
format = 1
name = "pendulum"
[inputs]
u = { unit = "V" }
m = { unit = "kg" }
l = { unit = "m" }
[constants]
g = { value = 9.81, unit = "m/s^2" }
[parameters]
kt = { unit = "N*m/V", min = 0.01, max = 1 }
K  = { unit = "V*s/rad", min = 0.05, max = 2 }
J  = { unit = "kg*m^2", min = 1e-5, max = 0.02 }
B  = { unit = "N*m*s/rad", min = 0, max = 0.1 }
Tc = { unit = "N*m", min = 0, max = 0.3 }
Ts = { unit = "N*m", min = 0, max = 0.3 }
ws = { unit = "rad/s", min = 0.05, max = 5 }
mu = { unit = "1", min = 0, max = 0.5 }
[let]
w = "p/(J + m*l^2)"
Tm = "kt*(u - K*w)"
Tg = "-m*g*l*sin(q)"
[states]
q = { unit = "rad", d = "w", initial = 0.5 }
p = { unit = "N*m*s", d = "Tm + Tg - B*w - stick(p, Tc + mu*abs(Tm - Tg) + Ts*exp(-(w/ws)^2))", initial = 0 }
[outputs]
q = { value = "q", unit = "rad" }
"#;

#[test]
fn friction_is_of_second_order_where_couplings_depend_on_inputs() {
    const SAMPLES: usize = 400;
    let model = Model::parse(PENDULUM).unwrap();
    let step_s = 5e-3;
    let voltage: Vec<f64> =
        (0..SAMPLES).map(|n| 4.0 * (0.05 * count(n)).sin() + 2.0 * (0.13 * count(n)).cos()).collect();
    let inputs = [voltage, vec![0.25; SAMPLES], vec![0.12; SAMPLES]];
    let values = [0.2, 0.4, 0.004, 0.01, 0.05, 0.03, 0.6, 0.05];
    // Of first order with steps of 2.5 µs: a thousandth of the error of first order at 5 ms, or 5e-4 mrad.
    let expected = reference::simulate(&model, &values, &[], &inputs, step_s, 2000);
    for method in METHODS {
        let error = |substeps: usize| {
            let found = simulated(&model, &values, (&inputs, step_s), (method, substeps));
            let error: Vec<f64> = found[0].iter().zip(&expected[0]).map(|(a, b)| a - b).collect();
            rms(&error)
        };
        let errors = [1, 2, 4, 8, 16].map(error);
        // Order 2 divides the error by 16 with four substeps, order 1 by 4; beyond, the error of the reference shows.
        assert!(errors[2] < errors[0] / 12.0 && errors[4] < errors[0] / 30.0, "{method:?}: {errors:?}");
        assert!(errors[0] < 1e-4, "{method:?}: {errors:?}");
    }
}
