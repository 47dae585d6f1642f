//! Measures population searches end to end against the rate of their evaluator alone, in the same process: a population of a
//! million, and a thousand runs of a hundred candidates as one batch; by SIMD and on the best adapter.
#![allow(missing_docs, reason = "a bench has no public interface")]
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a bench prints and may stop")]
#![allow(clippy::cast_precision_loss, reason = "small numbers")]

mod support;

use motorfit::candidates::Candidates;
use motorfit::device::BatchSearchEvaluator;
use motorfit::evaluate::{Batch, Evaluator, Group, Problem, Simd};
use motorfit::identify::Method;
use motorfit::motor::Space;
use motorfit::named::Named as _;
use motorfit::optimize::{Budget, Optimizer, Run, Sample, Sampling, SearchSettings, minimize};
use motorfit::study::compare::{CompareSpec, ComparisonSetting, ComparisonSubject, compare};
use std::ops::ControlFlow;
use std::sync::Arc;
use support::{m2_problem, median, seconds};

fn optimizer(name: &str, population: usize, generations: usize, run: u64) -> Box<dyn Optimizer> {
    let setup = SearchSettings {
        bounds: Space::table2().bounds(),
        population,
        generations,
        seed: 1,
        run,
        ..SearchSettings::default()
    };
    Method::named("method", name).unwrap().optimizer(setup).unwrap()
}

/// Returns the time of a search of `runs` runs, and that of only evaluating as many candidates \[s\].
fn search(
    evaluator: &(dyn Fn() -> Box<dyn Evaluator> + Sync),
    problem: &Arc<Problem>,
    [runs, population, generations]: [usize; 3],
    name: &str,
) -> [f64; 2] {
    let mut all: Vec<Run> = (0..runs as u64).map(|n| Run::new(optimizer(name, population, generations, n))).collect();
    let mut searches = BatchSearchEvaluator::new(evaluator(), vec![problem.clone()]);
    let budget = Budget { generations, slice: usize::MAX };
    // A generation of other runs first, because the first one allocates buffers and compiles shaders.
    let mut warm: Vec<Run> = (0..runs as u64).map(|n| Run::new(optimizer(name, population, 1, n))).collect();
    let once = Budget { generations: 1, ..budget };
    minimize(&mut warm, once, &mut searches, &mut |_| ControlFlow::Continue(())).unwrap();
    drop(warm);
    let search = seconds(|| {
        minimize(&mut all, budget, &mut searches, &mut |_| ControlFlow::Continue(())).unwrap();
    });
    // The evaluator alone: the last populations, evaluated as often, without the cutoffs of the searches.
    let asked = all.iter_mut().map(|run| run.optimizer.ask());
    let candidates: Vec<Candidates<'_>> = asked.map(|own| Candidates::new(own.values(), own.width())).collect();
    let groups: Vec<Group<'_>> =
        candidates.iter().map(|&candidates| Group { problem, candidates, reference: None }).collect();
    let mut costs = vec![0.0; runs * population];
    let mut evaluator = evaluator();
    let mut evaluate = || evaluator.evaluate(&Batch { groups: &groups }, &mut costs).unwrap();
    // The first call allocates buffers.
    evaluate();
    let raw = median((0..generations.min(5)).map(|_| seconds(&mut evaluate)).collect());
    [search, raw * generations as f64]
}

fn report(device: &str, evaluator: &(dyn Fn() -> Box<dyn Evaluator> + Sync), problem: &Arc<Problem>) {
    for name in ["gwo", "jaya"] {
        for case in [[1, 1_000_000, 3], [1000, 100, 20]] {
            let share = || {
                let [whole, raw] = rayon::scope(|_| search(evaluator, problem, case, name));
                100.0 * raw / whole
            };
            let share = median((0..5).map(|_| share()).collect());
            let [runs, population, generations] = case;
            println!(
                "{device}, {name}: {runs} run(s) of {population} × {generations}: {share:.0} % of the rate of the evaluator alone"
            );
        }
    }
}

/// Measures the paper's preset as one batch against the evaluator alone on as many candidates of both criteria.
fn preset() {
    let share = || {
        let spec = CompareSpec { noise_records: 0, ..CompareSpec::paper() };
        let subject = ComparisonSubject::m2().unwrap();
        let records = subject.records.clone();
        let comparison = compare(subject, &spec, &mut |_| ControlFlow::Continue(())).unwrap();
        let of = |setting: &ComparisonSetting| {
            let model = spec.model;
            Arc::new(Problem::new(&records, model, spec.space.clone(), setting.criterion).unwrap())
        };
        let problems: Vec<Arc<Problem>> = spec.settings.iter().map(of).collect();
        let bounds = Space::table2().bounds();
        let mut values = vec![0.0; 5 * 100 * 150];
        Sample::new(Sampling::Uniform, 15_000, bounds, 1).unwrap().fill(0, &mut values);
        let candidates = Candidates::new(&values, 5);
        let groups: Vec<Group<'_>> =
            problems.iter().map(|problem| Group { problem, candidates, reference: None }).collect();
        let (mut simd, mut costs) = (Simd::default(), vec![0.0; 30_000]);
        let mut once = || simd.evaluate(&Batch { groups: &groups }, &mut costs).unwrap();
        let raw = 100.0 * median((0..9).map(|_| seconds(&mut once)).collect());
        100.0 * raw / comparison.batch_seconds
    };
    let share = median((0..5).map(|_| rayon::scope(|_| share())).collect());
    println!("SIMD, compare --preset paper (300 runs of 100 × 100): {share:.0} % of the rate of the evaluator alone");
}

fn main() {
    let problem = m2_problem();
    preset();
    report("SIMD", &|| Box::new(Simd::default()), &problem);
    #[cfg(feature = "gpu")]
    {
        use motorfit::evaluate::gpu::{Gpu, Selector};
        match Gpu::open(&Selector::Best, None).map(|gpu| gpu.facts().name.clone()) {
            Ok(name) => report(&name, &|| Box::new(Gpu::open(&Selector::Best, None).unwrap()), &problem),
            Err(error) => println!("no adapter: {error}"),
        }
    }
}
