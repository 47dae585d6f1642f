//! Measures the cost of each kind of problem relative to the linear motor on a step recording, on one thread, for candidates
//! spread over the search space and for a GWO search; complete runs relative to the estimate and its refinement; small
//! populations relative to large ones; and a search relative to one in C. All ratios are medians of alternating calls.
//! `benches/results/ratios` keeps the output.
#![allow(missing_docs, reason = "a bench has no public interface")]
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a bench prints and may stop")]
#![allow(clippy::cast_precision_loss, reason = "small numbers")]

mod support;

use motorfit::criterion::{Criterion, Norm};
use motorfit::device::BatchSearchEvaluator;
use motorfit::estimate::{RefineOptions, refine, steiglitz_mcbride};
use motorfit::evaluate::{Level, Model, Problem, Simd};
use motorfit::experiment::{Excitation, simulated, with_noise};
use motorfit::identify::{IdentifySpec, Method, Polish, identify, verify_at};
use motorfit::motor::{Discretization, Parameter, Parameters, Space};
use motorfit::named::Named as _;
use motorfit::optimize::{Budget, GwoOptions, Run, SearchSettings, minimize};
use motorfit::record::{Record, diagnose};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::ops::ControlFlow;
use std::sync::Arc;
use support::c_loop::CLoop;
use support::{candidates, candidates_of, evaluate, m2_problem, m2_record, median, ratio, restless_record, seconds};

/// A kind of problem.
struct Workload {
    name: &'static str,
    problem: Arc<Problem>,
}

/// Returns the paper's experiment on a clock whose step `n` is longer than the period by `off(n)` periods.
fn irregular(off: impl Fn(u32) -> f64) -> Record {
    driven(off, |time, _| if time >= 0.9995 { 10.5 } else { 0.0 })
}

/// Returns the experiment with another voltage \[V\], given the time \[s\] and the index of a sample.
fn driven(off: impl Fn(u32) -> f64, volts: impl Fn(f64, u32) -> f64) -> Record {
    let mut time = 0.0;
    let step = |n: u32| {
        let now = time;
        time += 1e-3 * (1.0 + off(n));
        now
    };
    let time_s: Vec<f64> = (0..3001).map(step).collect();
    let voltage = time_s.iter().zip(0..).map(|(time, n)| volts(*time, n)).collect();
    simulated(&Parameters::M2, &Excitation { time_s, voltage, torque: None }, Discretization::Zoh).unwrap()
}

fn workloads() -> Vec<Workload> {
    use Parameter as P;
    let extended = |record: &Record, extensions: &[(Parameter, f64, f64)]| {
        let space = Space::table2_with(extensions, &[]).unwrap();
        let record = std::slice::from_ref(record);
        Arc::new(Problem::new(record, Model::default(), space, Criterion::default()).unwrap())
    };
    let with = |norm: Norm| {
        let criterion = Criterion { norm, ..Criterion::default() };
        Arc::new(Problem::new(&[m2_record()], Model::default(), Space::table2(), criterion).unwrap())
    };
    let step = m2_record();
    let restless = restless_record();
    let three = irregular(|n| 0.1 * (f64::from(n * 7 % 3) - 1.0));
    let spread = |n: u32| 0.002 * (f64::from(n * 7919 % 201) - 100.0);
    let many = irregular(spread);
    let many_restless = driven(spread, |_, n| 0.01 * (f64::from(n * 7919 % 2003) - 1001.0));
    let all = irregular(|n| 0.001 * (f64::from(n * 7919 % 3001) * 0.2).floor() - 0.3);
    let steps = |record: &Record| record.steps().step_s.len();
    assert_eq!([steps(&three), steps(&many), steps(&all)], [3, 201, 601]);
    let coulomb = (P::Coulomb, 0.0, 0.05);
    let dead_time = (P::DeadTime, 0.0, 0.02);
    let latency = (P::Latency, 0.0, 0.05);
    let average = (P::SpeedAverage, 1.0, 40.0);
    vec![
        Workload { name: "step", problem: extended(&step, &[]) },
        Workload { name: "voltage changes at each sample", problem: extended(&restless, &[]) },
        Workload { name: "criterion itae", problem: with(Norm::Itae) },
        Workload { name: "3 steps", problem: extended(&three, &[]) },
        Workload { name: "201 steps", problem: extended(&many, &[]) },
        Workload { name: "601 steps", problem: extended(&all, &[]) },
        Workload { name: "friction", problem: extended(&step, &[coulomb]) },
        Workload { name: "friction, brushes", problem: extended(&step, &[coulomb, (P::BrushDrop, 0.0, 1.0)]) },
        Workload { name: "friction, 3 steps", problem: extended(&three, &[coulomb]) },
        Workload { name: "friction, 201 steps", problem: extended(&many, &[coulomb]) },
        Workload { name: "friction, 201 steps, changing voltage", problem: extended(&many_restless, &[coulomb]) },
        Workload { name: "dead time", problem: extended(&step, &[dead_time]) },
        Workload { name: "dead time, changing voltage", problem: extended(&restless, &[dead_time]) },
        Workload { name: "dead time, 201 steps", problem: extended(&many, &[dead_time]) },
        Workload { name: "dead time, 201 steps, changing voltage", problem: extended(&many_restless, &[dead_time]) },
        Workload { name: "latency", problem: extended(&step, &[latency]) },
        Workload { name: "dead time, latency", problem: extended(&step, &[dead_time, latency]) },
        Workload { name: "moving average", problem: extended(&step, &[average]) },
        Workload { name: "two moving averages", problem: extended(&step, &[average, (P::CurrentAverage, 1.0, 40.0)]) },
        Workload { name: "dead time, moving average", problem: extended(&step, &[dead_time, average]) },
    ]
}

const CANDIDATES: usize = 960;
const ROUNDS: u64 = 15;

/// Searches with GWO.
fn run_search(problem: &Arc<Problem>, (population, generations, run): (usize, usize, u64), evaluator: Simd) {
    let bounds = problem.space().bounds();
    let setup = SearchSettings { bounds, population, generations, seed: 1, run, ..SearchSettings::default() };
    let mut runs = vec![Run::new(Method::named("method", "gwo").unwrap().optimizer(setup).unwrap())];
    let mut evaluator = BatchSearchEvaluator::new(Box::new(evaluator), vec![problem.clone()]);
    let budget = Budget { generations, slice: usize::MAX };
    minimize(&mut runs, budget, &mut evaluator, &mut |_| ControlFlow::Continue(())).unwrap();
}

/// Returns the median over rounds of the time of a call for one workload relative to that for the first, per simulated sample.
fn relative(all: &[Workload], n: usize, mut call: impl FnMut(usize, u64)) -> f64 {
    let mut time = |of: usize, round: u64| seconds(|| call(of, round)) / all[of].problem.active() as f64;
    let ratios = (0..=ROUNDS).map(|round| {
        let (before, own, after) = (time(0, round), time(n, round), time(0, round));
        2.0 * own / (before + after)
    });
    // The first round allocates buffers.
    median(ratios.skip(1).collect())
}

/// Prints complete runs and their parts relative to Steiglitz–McBride with the refinement, on one thread and on all.
fn fixed_costs(one: &ThreadPool, all: &ThreadPool) {
    let record = noisy();
    let (space, options) = (Space::table2(), RefineOptions::default());
    let records = std::slice::from_ref(&record);
    let estimate = || {
        let start = steiglitz_mcbride(&record, Model::default()).unwrap().unwrap();
        refine(records, &space, &start.parameters.to_array(), &options).unwrap()
    };
    let found = estimate();
    let verified = IdentifySpec { space: space.clone(), ..IdentifySpec::default() };
    let gwo = gwo_spec();
    let parts: [(&str, &(dyn Fn() + Sync)); 4] = [
        ("identify", &|| drop(identify(records, &IdentifySpec::default()).unwrap())),
        ("its findings about the recording", &|| drop(diagnose(&record))),
        ("Steiglitz–McBride, a refinement, a search of the box", &|| {
            verify_at(records, &verified, &found.values).unwrap();
        }),
        ("GWO 100 × 100 and its verdict", &|| drop(identify(records, &gwo).unwrap())),
    ];
    let threads = all.current_num_threads();
    println!("\n| of the time of the estimate with its refinement, 3001 samples | one thread | {threads} threads |");
    println!("|---|---|---|");
    for (name, part) in parts {
        let [one, all] = [one, all].map(|pool| pool.install(|| ratio(31, || drop(estimate()), part)));
        println!("| {name} | {one:.2} | {all:.2} |");
    }
}

/// Returns the paper's experiment with noise of 40 dB.
fn noisy() -> Record {
    with_noise(&m2_record(), [0.012_015_7, 1.038_37], 1).unwrap()
}

fn gwo_spec() -> IdentifySpec {
    IdentifySpec { method: GwoOptions::default().into(), polish: Polish::None, ..IdentifySpec::default() }
}

/// Prints a search of 100 agents and 100 generations relative to one in C, if there is a compiler.
fn against_c(one: &ThreadPool, all: &ThreadPool) {
    let record = noisy();
    let Some(c) = CLoop::new(&record) else {
        println!("\nNo C compiler: the search in C was not measured.");
        return;
    };
    let records = std::slice::from_ref(&record);
    let problem = Problem::new(records, Model::default(), Space::table2(), Criterion::default()).unwrap();
    let (problem, spec) = (Arc::new(problem), gwo_spec());
    let threads = all.current_num_threads();
    println!(
        "\n| of the time of the same search in C, 100 agents × 100 generations | one thread | {threads} threads |"
    );
    println!("|---|---|---|");
    let relative = |pool: &ThreadPool, own: &(dyn Fn(u64) + Sync)| {
        let round = |_| {
            let in_c = c.seconds(pool.current_num_threads(), RUNS);
            let times = pool.install(|| (0..=RUNS).map(|run| seconds(|| own(run as u64))).skip(1).collect());
            median(times) / in_c
        };
        median((0..ROUNDS).map(round).collect())
    };
    let searched = |run| run_search(&problem, (100, 100, run), Simd::default());
    let verified = |_| drop(identify(records, &spec).unwrap());
    for (name, own) in [("search", &searched as &(dyn Fn(u64) + Sync)), ("search and verdict", &verified)] {
        println!("| {name} | {:.2} | {:.2} |", relative(one, own), relative(all, own));
    }
}

/// Number of searches in one process.
const RUNS: usize = 41;

/// Prints the rates of small populations relative to a large one, on one thread and on all.
fn populations(one: &ThreadPool, all: &ThreadPool) {
    let threads = all.current_num_threads();
    println!("\n| agents | rate of evaluation, of that with 9600: one thread | {threads} threads |\n|---|---|---|");
    let (problem, values) = (m2_problem(), candidates(9600));
    for count in [1, 10, 24, 50, 100, 250, 1000] {
        let mut costs = vec![0.0; 9600];
        let mut run =
            |count: usize| evaluate(&mut Simd::default(), &problem, &values[..5 * count], &mut costs[..count]);
        let [one, all] = [one, all].map(|pool| {
            pool.install(|| {
                let small = median((0..101).map(|_| seconds(|| run(count))).collect()) / count as f64;
                let large = median((0..11).map(|_| seconds(|| run(9600))).collect()) / 9600.0;
                large / small
            })
        });
        println!("| {count} | {one:.2} | {all:.2} |");
    }
}

fn main() {
    let pool = |threads| ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let [one, all] = [1, 0].map(pool);
    workload_costs(&one);
    if std::env::args().skip(1).all(|a| a.starts_with('-')) {
        fixed_costs(&one, &all);
        populations(&one, &all);
        against_c(&one, &all);
    }
}

/// Prints the cost of each workload relative to the first.
fn workload_costs(one: &ThreadPool) {
    let all = workloads();
    let only = std::env::args().skip(1).find(|a| !a.starts_with('-')).unwrap_or_default();
    let values: Vec<Vec<f64>> = all.iter().map(|w| candidates_of(w.problem.space(), CANDIDATES)).collect();
    let levels: Vec<Level> = Level::available().filter(|level| *level != Level::Portable).collect();
    let names: Vec<&str> = levels.iter().map(|level| level.name()).collect();
    println!("| problem | evaluation, {} | GWO, 1000 × 20 |", names.join(" | evaluation, "));
    println!("|---|{}---|", "---|".repeat(levels.len()));
    for (n, workload) in all.iter().enumerate().filter(|(_, workload)| workload.name.contains(&only)) {
        print!("| {} |", workload.name);
        for &level in &levels {
            let mut costs = vec![0.0; CANDIDATES];
            let ratio = one.install(|| {
                relative(&all, n, |of, _| evaluate(&mut Simd::at(level), &all[of].problem, &values[of], &mut costs))
            });
            print!(" {ratio:.2} |");
        }
        println!(
            " {:.2} |",
            relative(&all, n, |of, round| run_search(&all[of].problem, (1000, 20, round), Simd::alone()))
        );
    }
}
