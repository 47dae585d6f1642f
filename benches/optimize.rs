//! Measures the optimizers' updates per candidate and generation, without the evaluation, and `identify` on the M2 recording:
//! by default, and as a GWO run of 100 candidates × 100 generations with verification.
#![allow(missing_docs, reason = "a bench has no public interface")]
#![allow(clippy::unwrap_used, reason = "a bench may stop")]

mod support;

use criterion::{Criterion, Throughput};
use motorfit::identify::{IdentifySpec, Method, Polish, identify};
use motorfit::motor::Space;
use motorfit::named::Named as _;
use motorfit::optimize::{CmaEsOptions, GeneticOptions, GwoOptions, JayaOptions, Restarts, SearchSettings, Sharing};
use motorfit::record::Record;
use std::hint::black_box;
use support::m2_record;

fn updates(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("update");
    let named = |name: &str| Method::named("method", name).unwrap();
    for population in [100, 10_000] {
        for (name, method) in [
            ("gwo", Method::from(GwoOptions::default())),
            ("jaya", Method::from(JayaOptions::default())),
            ("jaya, numbers per agent", Method::from(JayaOptions { sharing: Sharing::Agent, greedy: true })),
            ("ga", Method::from(GeneticOptions::default())),
            ("pso", named("pso")),
            ("de", named("de")),
            ("lshade", named("lshade")),
            ("cmaes", CmaEsOptions { restarts: Restarts::Same, ..CmaEsOptions::default() }.into()),
            ("abc", named("abc")),
            ("cuckoo", named("cuckoo")),
            ("random", named("random")),
        ] {
            let setup = SearchSettings {
                bounds: Space::table2().bounds(),
                population,
                generations: 1 << 20,
                seed: 1,
                ..SearchSettings::default()
            };
            let mut optimizer = method.optimizer(setup).unwrap();
            let costs: Vec<f64> = (0..population).map(|n| 1.0 + ((n * 7919) % 101) as f64).collect();
            // CMA-ES has its own number of samples; that of L-SHADE hardly shrinks with this many generations.
            group.throughput(Throughput::Elements(optimizer.ask().count() as u64));
            group.bench_function(format!("{name}, {population} agents"), |b| {
                b.iter(|| {
                    let count = black_box(optimizer.ask()).count();
                    optimizer.tell(&costs[..count]);
                });
            });
        }
    }
    group.finish();
}

fn complete_run(criterion: &mut Criterion) {
    let records = [m2_record()];
    let search =
        IdentifySpec { method: Method::from(GwoOptions::default()), polish: Polish::None, ..IdentifySpec::default() };
    for (name, spec) in [("no flags", IdentifySpec::default()), ("gwo 100x100 and its verdict", search)] {
        bench_identify(criterion, name, &records, &spec);
    }
}

fn bench_identify(criterion: &mut Criterion, name: &str, records: &[Record], spec: &IdentifySpec) {
    for threads in [1, rayon::current_num_threads()] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        criterion.bench_function(&format!("identify, {name}, {threads} threads"), |b| {
            let run = || identify(records, spec).unwrap().cost;
            pool.install(|| b.iter(run));
        });
    }
}

fn main() {
    let mut criterion = Criterion::default().sample_size(20).configure_from_args();
    updates(&mut criterion);
    complete_run(&mut criterion);
    criterion.final_summary();
}
