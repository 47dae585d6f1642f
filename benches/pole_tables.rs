//! Measures the tables of poles against the SIMD kernel: time per candidate of Table 2's box, with the cells built and on first use, and the
//! number of candidates from which the tables are faster, for recordings of 10³ to 10⁶ samples under a step, a pseudorandom binary sequence and a
//! sine, on one thread.
#![allow(missing_docs, reason = "a bench has no public interface")]
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a bench prints and may stop")]
#![allow(clippy::cast_precision_loss, reason = "small numbers")]

mod support;

use motorfit::criterion::{Criterion, Noise};
use motorfit::device::BatchSearchEvaluator;
use motorfit::evaluate::{Evaluator, Initial, Level, Model, PoleTables, Problem, Scalar, Simd};
use motorfit::experiment::{Excitation, Shape, noise_of, simulated, with_noise};
use motorfit::identify::Method;
use motorfit::motor::{Discretization, Parameters, Space};
use motorfit::optimize::{Budget, GwoOptions, Run, SearchSettings, minimize};
use motorfit::record::Record;
use std::ops::ControlFlow;
use std::sync::Arc;
use support::{candidates, evaluate, median, seconds};

/// Candidates whose time is measured with the cells built.
const CANDIDATES: usize = 100_000;
const STEP_S: f64 = 1e-3;
const SHAPES: [Shape; 3] = [Shape::Step, Shape::Prbs, Shape::Sine];

/// Returns the hold time in samples: seven of a bit, and a sine of 3 Hz.
fn hold(shape: Shape) -> usize {
    match shape {
        Shape::Prbs => 7,
        Shape::Sine => 333,
        _ => 1,
    }
}

/// Returns a recording of the paper's motor M2 with noise of 40 dB.
fn record(shape: Shape, samples: usize) -> Record {
    let time_s: Vec<f64> = (0..samples).map(|n| STEP_S * n as f64).collect();
    let excitation = Excitation { time_s, voltage: shape.voltage(10.5, hold(shape), samples), torque: None };
    let exact = simulated(&Parameters::M2, &excitation, Discretization::Zoh).unwrap();
    with_noise(&exact, noise_of(&exact, Noise::Decibels(40.0)), 2).unwrap()
}

fn problem(record: &Record) -> Arc<Problem> {
    let model = Model { initial: Initial::Zero, ..Model::default() };
    Arc::new(Problem::new(std::slice::from_ref(record), model, Space::table2(), Criterion::default()).unwrap())
}

/// Returns the time of one evaluation of candidates \[s\].
fn time(evaluator: &mut dyn Evaluator, problem: &Arc<Problem>, values: &[f64]) -> f64 {
    let mut costs = vec![0.0; values.len() / 5];
    seconds(|| evaluate(evaluator, problem, values, &mut costs))
}

/// Returns the time of the first evaluation, whose tables are new \[s\].
fn first_time(level: Level, record: &Record, values: &[f64]) -> f64 {
    let mut times = Vec::new();
    for _ in 0..5 {
        let problem = problem(record);
        PoleTables::clear();
        times.push(time(&mut PoleTables::at(level), &problem, values));
    }
    median(times)
}

fn row(level: Level, shape: Shape, samples: usize) {
    let (record, name) = (record(shape, samples), shape.name());
    let problem = problem(&record);
    let values = candidates(CANDIDATES);
    let some = &values[..5 * (2_000_000 / samples).clamp(48, 2000)];
    let (mut tables, mut kernel) = (PoleTables::at(level), Simd::at(level));
    time(&mut tables, &problem, &values);
    let (mut own, mut others) = (Vec::new(), Vec::new());
    for _ in 0..9 {
        own.push(time(&mut tables, &problem, &values) / CANDIDATES as f64);
        others.push(time(&mut kernel, &problem, some) / (some.len() / 5) as f64);
    }
    let (own, other) = (median(own), median(others));
    let first = first_time(level, &record, &values) - own * CANDIDATES as f64;
    let few = |count: usize| first_time(level, &record, &values[..5 * count]);
    // From so many candidates on the tables are faster, their cells included.
    let even = [100, 200, 500, 1000, 2000, 5000, 10_000, 20_000, 50_000];
    let even = even.into_iter().find(|count| few(*count) < other * *count as f64);
    let mut exact = vec![0.0; 200];
    evaluate(&mut Scalar, &problem, &values[..1000], &mut exact);
    let mut costs = vec![0.0; 200];
    evaluate(&mut tables, &problem, &values[..1000], &mut costs);
    let worst = costs.iter().zip(&exact).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
    println!(
        "| {name} | {samples} | {:.0} | {:.0} | {:.1} | {:.2} | {} | {:.0e} |",
        1e9 * own,
        1e9 * other,
        other / own,
        1e3 * first,
        even.map_or("above 50000".to_owned(), |count| count.to_string()),
        worst
    );
}

/// Runs Grey Wolf searches of 100 candidates and 100 generations on one recording; returns the time \[s\] and the best cost of each.
fn searched(evaluator: Box<dyn Evaluator>, problem: &Arc<Problem>, runs: u64) -> (f64, Vec<f64>) {
    let mut evaluation = BatchSearchEvaluator::new(evaluator, vec![problem.clone()]);
    let begin = |seed: u64| {
        let bounds = problem.space().bounds();
        let settings = SearchSettings { bounds, population: 100, generations: 100, seed, ..SearchSettings::default() };
        Run::new(Method::from(GwoOptions::default()).optimizer(settings).unwrap())
    };
    let mut all: Vec<Run> = (0..runs).map(begin).collect();
    let budget = Budget { generations: 100, slice: usize::MAX };
    let time = seconds(|| {
        minimize(&mut all, budget, &mut evaluation, &mut |_| ControlFlow::Continue(())).unwrap();
    });
    (time, all.iter().map(|run| run.optimizer.best().map_or(f64::NAN, |best| best.cost)).collect())
}

fn searches(samples: usize) {
    for shape in SHAPES {
        let (record, name) = (record(shape, samples), shape.name());
        for runs in [1, 100] {
            let mut ratios = Vec::new();
            let mut same = 0;
            for _ in 0..5 {
                let problem = problem(&record);
                PoleTables::clear();
                let (own, best) = searched(Box::new(PoleTables::default()), &problem, runs);
                let (other, expected) = searched(Box::new(Simd::default()), &problem, runs);
                ratios.push(other / own);
                same = best.iter().zip(&expected).filter(|(a, b)| (*a / *b - 1.0).abs() < 1e-8).count();
            }
            println!("| {name} | {samples} | {runs} | {:.2} | {same} |", median(ratios));
        }
    }
}

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    for level in Level::available().filter(|level| *level != Level::Portable) {
        println!("\n{}, one thread\n", level.name());
        println!(
            "| voltage | samples | tables \\[ns\\] | kernel \\[ns\\] | ratio | cells \\[ms\\] | faster from | largest error |"
        );
        println!("|---|---|---|---|---|---|---|---|");
        for shape in SHAPES {
            for samples in [1001, 3001, 10_001, 100_001] {
                pool.install(|| row(level, shape, samples));
            }
        }
        pool.install(|| row(level, Shape::Prbs, 1_000_001));
    }
    println!("\nSearches with the Grey Wolf Optimizer, 100 x 100, all cells built in the run, one thread\n");
    println!("| voltage | samples | runs at once | times as fast as the kernel | runs with its best cost |");
    println!("|---|---|---|---|---|");
    for samples in [3001, 30_001] {
        pool.install(|| searches(samples));
    }
}
