//! Measures the CPU evaluators in candidate-steps per second, counting only samples that are simulated, and ratios: SIMD
//! against the scalar oracle, against the FMA peak of the same run, and against itself on two threads.
#![allow(missing_docs, reason = "a bench has no public interface")]
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a bench prints and may stop")]

mod support;

use criterion::{BenchmarkId, Criterion, Throughput};
use motorfit::evaluate::{Evaluator, Level, Scalar, Simd, fma_loop};
use support::{candidates, evaluate, m2_problem, median, ratio, seconds};

/// Operations on the FMA ports per candidate-step, as counted in `evaluate/kernel.rs`.
const OPERATIONS: f64 = 8.0;

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap()
}

fn rates(criterion: &mut Criterion) {
    let problem = m2_problem();
    let mut group = criterion.benchmark_group("evaluate");
    for count in [100, 10_000] {
        let values = candidates(count);
        let mut costs = vec![0.0; count];
        group.throughput(Throughput::Elements((count * problem.active()) as u64));
        let case = format!("{count}x{}", problem.active());
        if count == 100 {
            group.bench_function(BenchmarkId::new("scalar f64, one thread", &case), |b| {
                b.iter(|| evaluate(&mut Scalar, &problem, &values, &mut costs));
            });
        }
        for level in Level::available() {
            for threads in [1, rayon::current_num_threads()] {
                let name = format!("{} f64, {threads} threads", level.name());
                group.bench_function(BenchmarkId::new(name, &case), |b| {
                    pool(threads).install(|| b.iter(|| evaluate(&mut Simd::at(level), &problem, &values, &mut costs)));
                });
            }
        }
    }
    group.finish();
}

fn ratios() {
    let problem = m2_problem();
    let values = candidates(960);
    let steps = (960 * problem.active()) as f64;
    println!("\nratios, medians of alternating calls (A B B A), on one thread unless noted:");
    for level in Level::available() {
        let run = |evaluator: &mut dyn Evaluator| {
            let mut costs = vec![0.0; 960];
            evaluate(evaluator, &problem, &values, &mut costs);
        };
        let simd = pool(1).install(|| median((0..51).map(|_| seconds(|| run(&mut Simd::at(level)))).collect()));
        // The oracle also simulates the samples before the input starts; its rate includes them.
        let all = problem.signals()[0].len() as f64 / problem.active() as f64;
        let scalar = pool(1).install(|| ratio(5, || run(&mut Simd::at(level)), || run(&mut Scalar))) / all;
        println!(
            "{:9} {:6.2} G candidate-steps/s   {scalar:5.1} x the scalar oracle",
            level.name(),
            steps / simd / 1e9
        );
        if level == Level::Portable {
            continue;
        }
        let rounds = 200_000;
        let operations = fma_loop(level, rounds).unwrap();
        let peak = pool(1).install(|| {
            ratio(
                25,
                || run(&mut Simd::at(level)),
                || {
                    let _ = fma_loop(level, rounds);
                },
            )
        }) / operations
            * steps;
        println!(
            "{:9} {:5.1} % of the FMA peak measured in the same run ({OPERATIONS} operations a step; {:.1} % at 6)",
            "",
            100.0 * OPERATIONS * peak,
            100.0 * 6.0 * peak
        );
    }
    threads();
}

/// Measures the speed-up from a second thread of the evaluator and of the FMA loop, all four calls in every round.
fn threads() {
    let problem = m2_problem();
    let values = candidates(10_000);
    let level = Level::best();
    let (one, two) = (pool(1), pool(2));
    let mut costs = vec![0.0; 10_000];
    let mut evaluator = |pool: &rayon::ThreadPool| {
        seconds(|| pool.install(|| evaluate(&mut Simd::default(), &problem, &values, &mut costs)))
    };
    let half = || {
        let _ = fma_loop(level, 500_000);
    };
    let fma = |pool: &rayon::ThreadPool| seconds(|| pool.install(|| rayon::join(half, half).0));
    let (mut gain, mut peak) = (Vec::new(), Vec::new());
    for _ in 0..41 {
        let (a, b, c, d) = (evaluator(&one), evaluator(&two), fma(&one), fma(&two));
        gain.push(a / b);
        peak.push(c / d);
    }
    let (gain, peak) = (median(gain), median(peak));
    let ratio = gain / peak;
    println!("10,000 candidates: speed-up {gain:.2} from a second thread; {peak:.2} of an FMA loop: ratio {ratio:.2}");
}

fn main() {
    let mut criterion = Criterion::default().sample_size(20).configure_from_args();
    rates(&mut criterion);
    criterion.final_summary();
    ratios();
    println!("\nstep:");
    support::extensions(&mut [support::simd()], &support::m2_record(), 40);
    println!("\nvoltage that changes at every sample:");
    support::extensions(&mut [support::simd()], &support::restless_record(), 40);
}
