//! Proves: the model of friction with optional terms (`examples/friction/friction.toml`) is each of the six models beside it with the terms
//! of that one: their trajectories are equal to rounding for random values of the parameters.
//! Does not prove: which terms a recording needs.
#![allow(clippy::unwrap_used, reason = "a test may stop")]

use crate::support::varied::numbers;
use motorfit::evaluate::model::{ModelProblem, ModelRecording, ModelSettings, ModelSpace};
use motorfit::model::{IntegrationMethod, Model, ModelParameter};
use motorfit::numeric::count;
use rand::RngExt as _;
use std::path::Path;

const SAMPLES: usize = 400;
/// The models of the folder, with their terms of the common one.
const MODELS: [(&str, &[&str]); 6] = [
    ("coulomb-viscous", &[]),
    ("stribeck", &["stribeck"]),
    ("load", &["load"]),
    ("load-stribeck", &["stribeck", "load", "load-stribeck"]),
    ("directional", &["stribeck", "load", "load-stribeck", "directional"]),
    ("quadratic", &["stribeck", "load", "load-stribeck", "directional", "quadratic"]),
];

fn model(name: &str) -> Model {
    Model::open(Path::new(&format!("examples/friction/{name}.toml"))).unwrap()
}

/// Returns the angle of a model that is driven to and fro, and stops between.
fn simulated(model: &Model, values: &[f64]) -> Vec<f64> {
    let period_s = 5e-3;
    let time_s: Vec<f64> = (0..SAMPLES).map(|n| count(n) * period_s).collect();
    let voltage = (0..SAMPLES).map(|n| if n % 150 < 80 { 6.0 * (count(n) * 0.05).sin() } else { 0.2 }).collect();
    let constant = |value: f64| vec![value; SAMPLES];
    let inputs = vec![voltage, constant(1.0), constant(0.2), constant(0.1)];
    let recording = ModelRecording::to_simulate(model, time_s, inputs).unwrap();
    let settings = ModelSettings { method: Some((IntegrationMethod::RungeKutta, 2)), ..ModelSettings::default() };
    let problem = ModelProblem::new(model, ModelSpace::all_fixed(values), vec![recording], settings).unwrap();
    problem.simulate(&[], 0, &[0.3]).outputs.swap_remove(0)
}

/// Returns the values of the parameters of the common model at which it is another one.
fn common(all: &Model, taken: &[&str], other: &Model, values: &[f64]) -> Vec<f64> {
    let of = |name: &str| other.parameters().iter().position(|own| own.name == name).map(|n| values[n]);
    let half = |[a, b]: [&str; 2], sign: f64| of(a).zip(of(b)).map(|(a, b)| 0.5 * (a + sign * b));
    let (run, rest) = (["mum", "mue"], ["musm", "muse"]);
    let free = |parameter: &ModelParameter| match parameter.name.as_str() {
        "mu" => of("mu").or(half(run, 1.0)),
        "mus" => of("mus").or(half(rest, 1.0)),
        "d" => half(run, -1.0),
        "ds" => half(rest, -1.0),
        name => of(name),
    };
    let fixed = all.fixed_without(taken).unwrap();
    all.parameters().iter().zip(fixed).map(|(of, fixed)| fixed.unwrap_or_else(|| free(of).unwrap())).collect()
}

#[test]
fn the_model_with_optional_terms_is_each_of_the_six() {
    let all = model("friction");
    let (mut rng, mut moving) = (numbers(7), 0);
    for (name, taken) in MODELS {
        let other = model(name);
        let free = all.fixed_without(taken).unwrap().iter().filter(|fixed| fixed.is_none()).count();
        assert_eq!(free, other.parameters().len(), "{name}");
        for _ in 0..20 {
            // In the inner part of the bounds, where the motor moves and stops.
            let value = |of: &ModelParameter, at: f64| match of.is_logarithmic {
                true => (of.min.ln() + at * (of.max / of.min).ln()).exp(),
                false => of.min + at * (of.max - of.min),
            };
            let values: Vec<f64> =
                other.parameters().iter().map(|of| value(of, 0.05 + 0.5 * rng.random::<f64>())).collect();
            let [one, same] = [simulated(&other, &values), simulated(&all, &common(&all, taken, &other, &values))];
            let size = one.iter().fold(0.0, |most: f64, angle| most.max((angle - one[0]).abs()));
            let apart = |(a, b): (&f64, &f64)| (a - b).abs();
            let largest = one.iter().zip(&same).map(apart).fold(0.0, f64::max);
            // Both sum the same terms in another order; where the motor stops, the difference of 1e-16 grows by some 1e4.
            moving += u32::from(size > 0.05);
            assert!(largest < 1e-11 * size.max(0.05), "{name}: {largest} of {size}");
        }
    }
    assert!(moving > 80, "{moving} of 120 move");
}
