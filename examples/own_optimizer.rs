//! Minimizes the costs of the evaluator by an external optimizer: CMA-ES of the crate cmaes, which evaluates single candidates
//! on all threads. An optimizer that evaluates complete generations would pass them as one `Batch`, or implement
//! `motorfit::optimize::Optimizer`.
//!
//! ```sh
//! cargo run --release --example own_optimizer
//! ```
#![allow(clippy::print_stdout, reason = "an example prints")]

use cmaes::{CMAESOptions, DVector, ParallelObjectiveFunction};
use motorfit::candidates::Candidates;
use motorfit::criterion::Criterion;
use motorfit::evaluate::{Batch, Evaluator, Group, Model, Problem, Simd};
use motorfit::experiment::{Excitation, simulated};
use motorfit::motor::{Discretization, Parameters, Space};
use std::sync::Arc;

/// Cost as a function of the logarithms of the parameters.
#[derive(Clone)]
struct Cost(Arc<Problem>);

impl ParallelObjectiveFunction for Cost {
    fn evaluate_parallel(&self, logarithms: &DVector<f64>) -> f64 {
        let values: Vec<f64> = logarithms.iter().map(|v| v.exp()).collect();
        let groups = [Group { problem: &self.0, candidates: Candidates::new(&values, 5), reference: None }];
        let mut cost = [f64::INFINITY];
        // The CPU evaluator fails only for a wrong number of parameters.
        let _ = Simd::default().evaluate(&Batch { groups: &groups }, &mut cost);
        cost[0].min(1e30)
    }
}

fn main() -> motorfit::Result<()> {
    let step = Excitation::step(10.5, 1.0, 3.0, 0.001)?;
    let record = simulated(&Parameters::M2, &step, Discretization::Zoh)?;
    let problem = Arc::new(Problem::new(&[record], Model::default(), Space::table2(), Criterion::default())?);
    let middle: Vec<f64> = Space::table2().bounds().iter().map(|(a, b)| (a * b).sqrt().ln()).collect();
    let mut search = CMAESOptions::new(middle, 0.7)
        .population_size(64)
        .max_generations(300)
        .seed(1)
        .fun_target(1e-9)
        .build(Cost(problem))
        .map_err(|e| motorfit::Error::usage(format!("{e:?}"), "Change the options of the search."))?;
    let found = search.run_parallel();
    let best = found.overall_best.map(|best| (best.value, best.point));
    let Some((cost, point)) = best else { return Ok(()) };
    let found: Vec<f64> = point.iter().map(|v| v.exp()).collect();
    println!("CMA-ES: cost {cost:.2e}, R L K B J = {found:.6?}");
    for (found, truth) in found.iter().zip(Parameters::M2.to_array()) {
        assert!((found / truth - 1.0).abs() < 1e-3, "{found} for {truth}");
    }
    Ok(())
}
