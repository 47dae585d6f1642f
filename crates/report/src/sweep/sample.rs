//! Synthetic sweeps for tests: a production line of motors, and a product of factors on one motor.

use crate::Reproduced;
use motorfit_core::named::Named as _;
use motorfit_evaluate::criterion::{Norm, Scale};
use motorfit_identify::{Method, Polish};
use motorfit_motor::{Parameter, Parameters};
use motorfit_study::sweep::{
    Cell, Factors, Job, Limits, NamedRun, Outcome, SweepBlock, SweepParameter, SweepSummary, TrustCounts,
};
use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde_json::json;

/// Draws an approximately standard normal number.
fn draw(random: &mut Xoshiro256PlusPlus) -> f64 {
    (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0
}

fn factors(method: Method, noise: usize) -> Factors {
    let (criterion, scale) = (Norm::Nrmse, Scale::Std);
    Factors {
        method,
        polish: Polish::None,
        machine: 0,
        population: 100,
        generations: 100,
        criterion,
        scale,
        noise,
        seed: 1,
    }
}

fn run(id: u64, motor: usize, f: Factors, values: [f64; 5], cost: f64) -> NamedRun {
    let of = |value: &dyn Fn(usize) -> serde_json::Value| {
        Parameter::ALL.iter().map(|p| (p.symbol().to_owned(), value(*p as usize))).collect::<serde_json::Value>()
    };
    let outcome = json!({
        "parameters": of(&|p| values[p].into()),
        "std_error": of(&|p| (0.001 * values[p]).into()),
        "ci95": of(&|p| json!([0.998 * values[p], 1.002 * values[p]])),
        "at_bound": null, "cost": cost, "fit_percent": {"current": 98.1, "speed": 99.7}, "evaluations": 10000,
        "stop": "converged", "device": "cpu", "precision": "f64", "warnings": [], "error": null,
    });
    let outcome: Outcome = serde_json::from_value(outcome).unwrap();
    NamedRun { job: Job { id, motor, factors: f }, motor: format!("line/2024-06/motor-{motor:04}"), outcome }
}

fn cell(factors: Factors, noise: &str, runs: &[NamedRun]) -> Cell {
    let values = |name: &str| runs.iter().filter_map(|run| run.estimate(name)?.value).collect();
    let parameters = SweepParameter::motor().into_iter().map(|of| (of.name.clone(), values(&of.name))).collect();
    let costs = runs.iter().filter_map(|run| run.outcome.cost).collect();
    let count = runs.len() as u64;
    let (noise, with, seconds) = (noise.to_owned(), None, 0.0031 * count as f64);
    let model = None;
    Cell {
        factors,
        noise,
        with,
        model,
        runs: count,
        failed: 0,
        trust: TrustCounts::default(),
        costs,
        parameters,
        seconds,
    }
}

fn summary(name: &str, blocks: Vec<SweepBlock>, runs: u64) -> SweepSummary {
    let mut summary = SweepSummary::default();
    name.clone_into(&mut summary.name);
    summary.runs = runs;
    summary.stride = 1;
    summary.blocks = blocks;
    summary.motors = 1;
    summary.parameters = SweepParameter::motor();
    summary.outputs = ["current", "speed"].map(str::to_owned).to_vec();
    summary.device = ["cpu".to_owned(), "f64".to_owned()];
    summary
}

fn worst(mut runs: Vec<NamedRun>) -> Vec<NamedRun> {
    runs.sort_by(|a, b| b.outcome.cost.unwrap().total_cmp(&a.outcome.cost.unwrap()));
    runs.truncate(10);
    runs
}

/// Returns 300 motors of a line, 5 of them outside the limits, and two runs without a result.
pub(super) fn line() -> (SweepSummary, Limits) {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let motor = |n: usize| {
        let mut values =
            Parameters::M2.to_array().map(|value| value * (1.0 + 0.01 * draw(&mut random).clamp(-2.8, 2.8)));
        match n {
            17 => values[0] *= 1.12,
            80 => values[1] *= 2.5,
            81 => values[2] *= 0.90,
            200 => values[0] *= 0.86,
            299 => values[4] *= 1.08,
            _ => {}
        }
        let cost = 0.012 * (0.2 * draw(&mut random)).exp();
        run(n as u64, n, factors(Method::Auto, 0), values, cost)
    };
    let results: Vec<NamedRun> = (0..300).map(motor).collect();
    let block =
        SweepBlock { cells: vec![cell(results[0].job.factors, "none", &results)], worst: worst(results.clone()) };
    let mut summary = summary("line", vec![block], 302);
    summary.failed = 2;
    let no_speed = "motor-0300.csv, line 1: has no column for the speed, expected one such as speed_rad_s";
    summary.failures.add(300, "line/2024-06/motor-0300", no_speed);
    summary.failures.add(301, "line/2024-06/motor-0301", "the motor does not move: nothing can be identified");
    summary.motors = 302;
    summary.results = results;
    let m2 = Parameters::M2;
    let around =
        |p: Parameter, share: f64| (p.symbol().to_owned(), m2.get(p) * (1.0 - share), m2.get(p) * (1.0 + share));
    let limits =
        [around(Parameter::R, 0.05), around(Parameter::L, 0.1), around(Parameter::K, 0.05), around(Parameter::J, 0.05)];
    (summary, Limits::new(limits.to_vec()).unwrap())
}

/// Returns one motor under `count` combinations of method and noise, 200 runs each.
pub(super) fn product(count: usize) -> SweepSummary {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(2);
    let methods = ["gwo", "jaya", "ga", "random"].map(|name| Method::named("method", name).unwrap());
    let (mut cells, mut all) = (Vec::new(), Vec::new());
    for n in 0..count {
        let (method, noise) = (methods[n % 4], n / 4);
        let f = factors(method, noise);
        let mut draws = |k: usize| {
            let spread = [0.002, 0.02, 0.01, 0.05][n % 4];
            let values = Parameters::M2.to_array().map(|value| value * (1.0 + spread * draw(&mut random)));
            let cost = 10.0_f64.powf(-6.0 + (n % 4) as f64 + noise as f64 + 0.4 * draw(&mut random));
            run((n * 200 + k) as u64, 0, f, values, cost)
        };
        let runs: Vec<NamedRun> = (0..200).map(&mut draws).collect();
        let name = if noise == 0 { "none".to_owned() } else { format!("{}dB", 90 - 5 * noise) };
        cells.push(cell(f, &name, &runs));
        all.extend(runs);
    }
    let results = vec![all[0].clone()];
    let runs = all.len() as u64;
    let mut summary = summary("night", vec![SweepBlock { cells, worst: worst(all) }], runs);
    summary.results = results;
    summary.varied = vec!["method", "noise"];
    summary
}

/// Returns the command that reproduces the line.
pub(super) fn how() -> Reproduced {
    let command = "motorfit sweep merge night --limits R=0.87:0.97,L=0.007:0.0085".to_owned();
    Reproduced { command, options: vec![("study".to_owned(), "line.toml".to_owned())] }
}
