//! Evaluates the costs of 10,000 candidates in one batch on the CPU.
//!
//! ```sh
//! cargo run --release --example evaluate_batch
//! ```
#![allow(clippy::print_stdout, reason = "an example prints")]

use motorfit::candidates::Candidates;
use motorfit::criterion::Criterion;
use motorfit::evaluate::{Batch, Evaluator, Group, Model, Problem, Simd};
use motorfit::motor::{Parameters, Space};
use motorfit::record::read_recording;
use std::path::Path;
use std::sync::Arc;

fn main() -> motorfit::Result<()> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/m2-step.csv");
    let record = read_recording(&path, &[])?;
    // A problem consists of recordings, a model, a search space and a criterion.
    let problem = Arc::new(Problem::new(&[record], Model::default(), Space::table2(), Criterion::default())?);
    // One candidate per row, R, L, K, B, J: the true motor with resistances from 0.1 to 1 ohm.
    let values: Vec<f64> = (0..10_000)
        .flat_map(|n| Parameters { r: 0.1 + 0.9 * f64::from(n) / 9_999.0, ..Parameters::M2 }.to_array())
        .collect();
    let groups = [Group { problem: &problem, candidates: Candidates::new(&values, 5), reference: None }];
    let mut costs = vec![0.0; 10_000];
    let mut evaluator = Simd::default();
    evaluator.evaluate(&Batch { groups: &groups }, &mut costs)?;
    let best = (0..costs.len()).min_by(|a, b| costs[*a].total_cmp(&costs[*b])).unwrap_or(0);
    println!("{}: lowest cost {:.5} at R = {:.4} ohm", evaluator.name(), costs[best], values[5 * best]);
    assert!((values[5 * best] - Parameters::M2.r).abs() < 0.005);
    Ok(())
}
