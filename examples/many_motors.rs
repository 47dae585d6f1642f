//! Identifies many motors at once: each recording is a group of the batch, and one call evaluates all groups.
//!
//! ```sh
//! cargo run --release --example many_motors
//! ```
#![allow(clippy::print_stdout, reason = "an example prints")]

use motorfit::criterion::Criterion;
use motorfit::device::BatchSearchEvaluator;
use motorfit::evaluate::{Model, Problem, Simd};
use motorfit::experiment::{Excitation, simulated};
use motorfit::motor::{Discretization, Parameters, Space};
use motorfit::optimize::{Budget, ConfiguredSearch, GwoOptions, Run, SearchSettings, minimize};
use std::ops::ControlFlow;
use std::sync::Arc;

fn main() -> motorfit::Result<()> {
    // Thirty-two motors whose resistance and inertia differ slightly.
    let motors: Vec<Parameters> = (0..32)
        .map(|n| Parameters { r: 0.5 + 0.01 * f64::from(n), j: 1e-4 + 1e-6 * f64::from(n), ..Parameters::M2 })
        .collect();
    let step = Excitation::step(10.5, 0.1, 0.6, 0.001)?;
    let problem = |motor: &Parameters| -> motorfit::Result<Arc<Problem>> {
        let record = simulated(motor, &step, Discretization::Zoh)?;
        Ok(Arc::new(Problem::new(&[record], Model::default(), Space::table2(), Criterion::default())?))
    };
    let problems: Vec<Arc<Problem>> = motors.iter().map(problem).collect::<Result<_, _>>()?;
    // One search per motor; in each generation the populations of all searches are one batch.
    let run = |run: u64| -> motorfit::Result<Run> {
        let setup = SearchSettings {
            bounds: Space::table2().bounds(),
            population: 60,
            generations: 80,
            seed: 1,
            run,
            ..SearchSettings::default()
        };
        Ok(Run::new(ConfiguredSearch::from(GwoOptions::default()).begin(setup)?))
    };
    let mut runs: Vec<Run> = (0..32).map(run).collect::<Result<_, _>>()?;
    let mut searches = BatchSearchEvaluator::new(Box::new(Simd::default()), problems);
    let budget = Budget { generations: 80, slice: usize::MAX };
    minimize(&mut runs, budget, &mut searches, &mut |_| ControlFlow::Continue(()))?;
    let worst = runs.iter().map(Run::cost).fold(0.0, f64::max);
    let best = runs[31].optimizer.best().map(|best| best.values[0]);
    println!("32 motors: highest cost {worst:.4}; the last has R = {best:.4?} ohm, true value {:.4}", motors[31].r);
    assert!(worst < 0.05);
    Ok(())
}
