//! The JSON document of a benchmark.

use motorfit_evaluate::Level;
use motorfit_study::{Crossover, Measurement, Throughput, ThroughputSpec};
use serde_json::{Value, json as value};

/// Returns the JSON document of a benchmark.
#[must_use]
pub fn bench_document(spec: &ThroughputSpec, result: &Throughput) -> Value {
    let contender = |n: usize| &result.contenders[n];
    let measurement = |m: &Measurement| {
        value!({
            "contender": result.contenders.get(m.contender).map(|c| &c.name), "samples": m.samples, "population": m.population,
            "seconds": m.seconds, "interval95": m.spread().map(|_| m.interval), "spread": m.spread(),
            "rounds": m.rounds, "candidate_steps_per_second": m.rate(), "kernel_seconds": m.kernel.map(|k| k[0]),
            "kernel_share": m.kernel.map(|k| k[0] / k[1]),
            "kernel_candidate_steps_per_second": m.kernel_rate(),
        })
    };
    let baseline = result.baseline();
    let others = (0..result.contenders.len()).filter(|n| contender(*n).evaluator != "kernel");
    let crossover = |n: usize| {
        let list = spec.samples.iter().map(|&samples| {
            let crossover = baseline.map_or(Crossover::Unknown, |b| result.crossover(n, b, samples));
            let (population, known) = match crossover {
                Crossover::From(population) => (Some(population), true),
                Crossover::Never => (None, true),
                Crossover::Unknown => (None, false),
            };
            value!({"samples": samples, "population": population, "compared": known})
        });
        value!({
            "contender": contender(n).name, "baseline": baseline.map(|b| &contender(b).name),
            "from": list.collect::<Value>(),
        })
    };
    value!({
        "motorfit": env!("CARGO_PKG_VERSION"),
        "contenders": result.contenders.iter().map(|c| {
            value!({
                "name": c.name, "kind": c.kind, "precision": c.precision, "evaluator": c.evaluator,
                "threads": c.threads,
                "backend": c.driver.as_ref().map(|d| &d.0), "driver": c.driver.as_ref().map(|d| &d.1),
                "operations_per_candidate_step": c.operations,
                "opening_s": c.driver.as_ref().map(|_| c.opening_s),
            })
        }).collect::<Value>(),
        "level": Level::best().name(),
        "fma_per_second_one_core": result.fma_peak,
        "measurements": result.measurements.iter().map(measurement).collect::<Value>(),
        "crossover": others.map(crossover).collect::<Value>(),
        "control": result.control().map(|c| {
            value!({
                "contender": contender(c.contender).name, "cases": c.cases, "apart": c.apart,
                "median_difference": c.difference[0], "largest_difference": c.difference[1],
            })
        }),
        "not_measured": result.refused,
        "interrupted": result.interrupted,
    })
}
