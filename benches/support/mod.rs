//! Shared by the benches: recordings and problems of the M2 motor, candidates, and ratios of alternating measurements.
#![allow(dead_code, reason = "each bench uses its part")]
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::needless_range_loop, reason = "a bench may stop and print")]

pub mod c_loop;
pub mod twins;

use motorfit::candidates::Candidates;
use motorfit::criterion::Criterion;
use motorfit::evaluate::{Batch, Evaluator, Group, Model, Problem, Simd};
use motorfit::experiment::{Excitation, simulated};
use motorfit::motor::{Discretization, Parameter, Parameters, Space};
use motorfit::record::Record;
use rand::{RngExt as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::sync::Arc;
use std::time::Instant;

/// Returns the recording of the paper's experiment without noise.
pub fn m2_record() -> Record {
    let excitation = Excitation::step(10.5, 1.0, 3.0, 0.001).unwrap();
    simulated(&Parameters::M2, &excitation, Discretization::Zoh).unwrap()
}

/// Returns the problem of a short recording with a voltage step at time 0.
pub fn problem_of(duration_s: f64) -> Arc<Problem> {
    let excitation = Excitation::step(10.5, 0.0, duration_s, 0.001).unwrap();
    let record = simulated(&Parameters::M2, &excitation, Discretization::Zoh).unwrap();
    Arc::new(Problem::new(&[record], Model::default(), Space::table2(), Criterion::default()).unwrap())
}

/// Returns the problem of the paper's experiment: criterion nrmse, scale std, bounds of Table 2.
pub fn m2_problem() -> Arc<Problem> {
    problem_with(&[m2_record()])
}

/// Returns the problem of recordings: criterion nrmse, scale std, bounds of Table 2.
pub fn problem_with(records: &[Record]) -> Arc<Problem> {
    Arc::new(Problem::new(records, Model::default(), Space::table2(), Criterion::default()).unwrap())
}

/// Returns a recording of the M2 motor under a voltage that changes at every sample.
pub fn restless_record() -> Record {
    let mut excitation = Excitation::step(10.5, 0.0, 2.0, 0.001).unwrap();
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(3);
    excitation.voltage.iter_mut().for_each(|v| *v = generator.random_range(-10.5..10.5));
    simulated(&Parameters::M2, &excitation, Discretization::Zoh).unwrap()
}

/// Returns the problem of a recording with free parameters of extensions, each with its bounds.
pub fn extended_problem(record: &Record, extensions: &[(Parameter, f64, f64)]) -> Arc<Problem> {
    let space = Space::table2_with(extensions, &[]).unwrap();
    Arc::new(Problem::new(std::slice::from_ref(record), Model::default(), space, Criterion::default()).unwrap())
}

/// Returns uniformly distributed candidates within the bounds of Table 2, shape `[count, 5]`.
pub fn candidates(count: usize) -> Vec<f64> {
    candidates_of(&Space::table2(), count)
}

/// Returns uniformly distributed candidates of a search space, shape `[count, parameters]`.
pub fn candidates_of(space: &Space, count: usize) -> Vec<f64> {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(7);
    let bounds = space.bounds();
    (0..count).flat_map(|_| bounds.iter().map(|&(a, b)| generator.random_range(a..b)).collect::<Vec<_>>()).collect()
}

/// Evaluates the candidates as one group.
pub fn evaluate(evaluator: &mut dyn Evaluator, problem: &Arc<Problem>, values: &[f64], costs: &mut [f64]) {
    let candidates = Candidates::new(values, problem.space().free().len());
    let groups = [Group { problem, candidates, reference: None }];
    evaluator.evaluate(&Batch { groups: &groups }, costs).unwrap();
}

/// Returns the duration of a call \[s\].
pub fn seconds(mut call: impl FnMut()) -> f64 {
    let start = Instant::now();
    call();
    start.elapsed().as_secs_f64()
}

/// Returns the (upper) median.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Returns the median over `rounds` of the ratio b/a of the durations of two calls, in the order A B B A.
pub fn ratio(rounds: usize, mut a: impl FnMut(), mut b: impl FnMut()) -> f64 {
    a();
    b();
    let ratios = (0..rounds).map(|_| {
        let (a1, b1) = (seconds(&mut a), seconds(&mut b));
        let (b2, a2) = (seconds(&mut b), seconds(&mut a));
        (b1 + b2) / (a1 + a2)
    });
    median(ratios.collect())
}

/// Name of an evaluator, and the evaluator.
pub type Named = (String, Box<dyn Evaluator>);

/// Returns the SIMD evaluator at the best available feature level.
pub fn simd() -> Named {
    ("SIMD f64".to_owned(), Box::new(Simd::default()))
}

/// Prints the rates of alternating evaluators for motors with one to five extensions, and the time of each relative to the
/// linear motor on the same evaluator.
pub fn extensions(evaluators: &mut [Named], record: &Record, rounds: usize) {
    use Parameter as P;
    let all = [
        (P::Coulomb, 0.0, 0.05),
        (P::BrushDrop, 0.0, 1.0),
        (P::DeadTime, 0.0, 0.02),
        (P::Latency, 0.0, 0.05),
        (P::SpeedAverage, 1.0, 40.0),
    ];
    let names = ["linear", "friction", "+ brushes", "+ dead time", "+ latency", "+ average"];
    let problems: Vec<_> = (0..names.len()).map(|n| extended_problem(record, &all[..n])).collect();
    let values: Vec<_> = problems.iter().map(|problem| candidates_of(problem.space(), 6400)).collect();
    let mut costs = vec![0.0; 6400];
    let mut times = vec![vec![Vec::new(); names.len()]; evaluators.len()];
    for round in 0..rounds {
        for n in 0..names.len() {
            for (k, (_, evaluator)) in evaluators.iter_mut().enumerate() {
                let time = seconds(|| evaluate(evaluator.as_mut(), &problems[n], &values[n], &mut costs));
                // The first round allocates buffers and compiles shaders.
                if round > 0 {
                    times[k][n].push(time);
                }
            }
        }
    }
    let steps = problems[0].active();
    println!("extensions, 6400 candidates x {steps} steps, G candidate-steps/s (time against linear):");
    for ((name, _), times) in evaluators.iter().zip(times) {
        println!("  {name}");
        // Ratios are taken within a round, because the speed of a shared machine varies.
        for (n, name) in names.iter().enumerate() {
            let ratios = times[n].iter().zip(&times[0]).map(|(time, linear)| time / linear).collect();
            let rate = (6400 * problems[n].active()) as f64 / median(times[n].clone()) / 1e9;
            println!("    {name:12} {rate:6.3}   {:.2}", median(ratios));
        }
    }
}
