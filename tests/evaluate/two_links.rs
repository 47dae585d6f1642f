//! Proves: inertias, gravity, viscous and dry friction of an arm with two links, whose joints rest and move each other, are found with errors
//! that the standard errors describe, as distribution over seeds; friction that cannot be solved together is refused.
//! Does not prove: the simulation, which is compared with another one in the crate of the evaluators; real arms.
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test may stop and print")]

use crate::support::rates::{cases, fewest};
use motorfit::evaluate::model::{ModelProblem, ModelRecording, ModelSettings, ModelSpace};
use motorfit::experiment::white_noise;
use motorfit::identify::TrustLevel;
use motorfit::identify::model::{ModelSpec, identify_model};
use motorfit::model::{IntegrationMethod, Model};
use motorfit::numeric::count;
use std::ops::ControlFlow;
use std::path::Path;

/// Inertias A1, A2, A3, torques of gravity G1, G2, viscous friction B1, B2, dry friction C1, C2; SI units.
const TRUTH: [f64; 9] = [0.09, 0.03, 0.035, 0.5, 0.2, 0.02, 0.01, 0.25, 0.12];

/// Torques that move both joints, turn them around and let each come to rest while the other moves.
fn torques(samples: usize, step_s: f64) -> Vec<Vec<f64>> {
    let of = |f: &dyn Fn(f64) -> f64| (0..samples).map(|n| f(count(n) * step_s)).collect();
    vec![of(&|t| 0.45 + 0.7 * (5.0 * t).sin() + 0.3 * (13.0 * t).cos()), of(&|t| 0.1 + 0.3 * (7.0 * t).cos())]
}

#[test]
fn an_arm_with_dry_friction_in_both_joints_is_found_within_its_errors() {
    let model = Model::open(Path::new("examples/two-links.toml")).unwrap();
    let (samples, step_s) = (800, 5e-3);
    let time_s: Vec<f64> = (0..samples).map(|n| count(n) * step_s).collect();
    let silent = ModelRecording::to_simulate(&model, time_s, torques(samples, step_s)).unwrap();
    // The truth has finer steps than the fit.
    let settings = ModelSettings { method: Some((IntegrationMethod::RungeKutta, 8)), ..ModelSettings::default() };
    let problem = ModelProblem::new(&model, ModelSpace::all_fixed(&TRUTH), vec![silent.clone()], settings).unwrap();
    let exact = problem.simulate(&[], 0, &[]).outputs;
    let (mut covered, mut all, mut good) = (0, 0, 0);
    for seed in 0..cases(6, 40) {
        let mut recording = silent.clone();
        let noisy = |(signal, stream): (&Vec<f64>, u64)| {
            let noise = white_noise(samples, 1e-3, seed, stream);
            Some(signal.iter().zip(noise).map(|(a, b)| a + b).collect())
        };
        recording.measured = exact.iter().zip(0..).map(noisy).collect();
        let found =
            identify_model(&model, &[recording], &ModelSpec::default(), &mut |_| ControlFlow::Continue(())).unwrap();
        good += usize::from(found.trust.level == TrustLevel::Good);
        let uncertainty = found.uncertainty.as_ref().unwrap();
        for (n, truth) in TRUTH.iter().enumerate() {
            let z = (found.values[n] - truth) / uncertainty.std_error[n].unwrap();
            assert!(z.abs() < 6.0, "seed {seed}, parameter {n}: {z} standard errors");
            covered += usize::from(z.abs() < 1.96);
            all += 1;
        }
    }
    eprintln!("{covered} of {all} intervals cover the truth; {good} fits good");
    assert!(covered >= fewest(all, 0.95), "{covered} of {all}");
    assert!(good >= cases(5, 34), "{good} good");
}

/// Returns a chain of masses whose dry friction acts on the neighbours too.
fn chain(masses: usize) -> String {
    let all = |of: &dyn Fn(usize) -> String| (0..masses).map(of).collect::<Vec<_>>().join("\n");
    let states = all(&|n| {
        let next = (n + 1) % masses;
        format!("x{n} = {{ unit = \"m/s\", d = \"u - a*stick(x{n}, F) - 0.1*a*stick(x{next}, F)\", initial = 0 }}")
    });
    let outputs = all(&|n| format!("x{n} = {{ value = \"x{n}\", unit = \"m/s\" }}"));
    format!(
        r#"
format = 1
name = "Chain"
[inputs]
u = {{ unit = "m/s^2" }}
[parameters]
a = {{ unit = "1/kg", min = 0.1, max = 10 }}
F = {{ unit = "N", min = 0, max = 10 }}
[states]
{states}
[outputs]
{outputs}
"#
    )
}

#[test]
fn friction_that_cannot_be_solved_together_is_refused() {
    assert!(Model::parse(&chain(6)).is_ok());
    let error = Model::parse(&chain(7)).unwrap_err();
    assert!(error.to_string().contains("more than 6 stick functions act on each other"), "{error}");
    assert_eq!((error.line().is_some(), error.hint().is_empty()), (true, false));
    let twice = chain(2).replace("a*stick(x0, F)", "a*stick(x0, F) - a*stick(x0, 2*F)");
    let error = Model::parse(&twice).unwrap_err();
    assert!(error.to_string().contains("two stick functions of x0"), "{error}");
    assert_eq!((error.line().is_some(), error.hint().is_empty()), (true, false));
}
