//! The document of `bench --json`.

use crate::evaluate::Level;
use crate::study::{Measurement, Throughput, ThroughputSpec};
use serde_json::{Value, json as value};

/// The document of `bench --json`.
pub struct BenchDocument;

impl BenchDocument {
    /// Operations on the FMA ports that the SIMD kernel needs for one candidate-step (see `evaluate/kernel.rs`).
    pub const OPERATIONS: f64 = 8.0;

    /// What was measured.
    #[must_use]
    pub fn of(spec: &ThroughputSpec, result: &Throughput) -> Value {
        let contender = |n: usize| &result.contenders[n];
        let measurement = |m: &Measurement| {
            value!({
                "contender": contender(m.contender).name, "samples": m.samples, "population": m.population,
                "seconds": m.seconds, "spread": m.seconds.map(|_| m.spread), "rounds": m.rounds,
                "candidate_steps_per_second": m.rate(),
            })
        };
        let baseline = result.contenders.iter().rposition(|c| c.kind == "cpu");
        let adapters = (0..result.contenders.len()).filter(|n| contender(*n).kind != "cpu");
        let crossover = |n: usize| {
            let list = spec.samples.iter().map(|&samples| {
                value!({"samples": samples, "population": baseline.and_then(|b| result.crossover(n, b, samples))})
            });
            value!({
                "contender": contender(n).name, "baseline": baseline.map(|b| &contender(b).name),
                "from": list.collect::<Value>(),
            })
        };
        value!({
            "motorfit": env!("CARGO_PKG_VERSION"),
            "contenders": result.contenders.iter().map(|c| {
                value!({"name": c.name, "kind": c.kind, "precision": c.precision, "threads": c.threads})
            }).collect::<Value>(),
            "level": Level::best().name(),
            "fma_per_second_one_core": result.fma_peak,
            "operations_per_candidate_step": Self::OPERATIONS,
            "measurements": result.measurements.iter().map(measurement).collect::<Value>(),
            "crossover": adapters.map(crossover).collect::<Value>(),
            "not_measured": result.refused,
            "interrupted": result.interrupted,
        })
    }
}
