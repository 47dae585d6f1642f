//! Minimizes a cost function of the caller by Jaya: inertia and Coulomb friction are estimated from the speed of a motor that
//! coasts to rest, simulated by this program.
//!
//! ```sh
//! cargo run --release --example own_evaluator
//! ```
#![allow(clippy::print_stdout, reason = "an example prints")]

use motorfit::candidates::Candidates;
use motorfit::optimize::{Budget, ConfiguredSearch, JayaOptions, Run, SearchSettings, minimize};
use std::ops::ControlFlow;

/// Returns the speed \[rad/s\] of a motor that coasts from 100 rad/s, sampled every 10 ms: `J dω/dt = −B ω − T_c sign(ω)`.
fn coast(inertia: f64, coulomb: f64) -> Vec<f64> {
    let (viscous, mut speed) = (1e-4, 100.0_f64);
    let mut samples = Vec::with_capacity(200);
    for _ in 0..200 {
        samples.push(speed);
        for _ in 0..100 {
            speed = (speed - 1e-4 * (viscous * speed + coulomb) / inertia).max(0.0);
        }
    }
    samples
}

fn main() -> motorfit::Result<()> {
    let measured = coast(2e-4, 0.01);
    // The evaluator receives the candidates of each search and fills in their costs.
    let mut evaluate = |populations: &[Candidates<'_>], costs: &mut [f64]| {
        let rows = populations.iter().flat_map(|population| (0..population.count()).map(|n| population.row(n)));
        for (row, cost) in rows.zip(costs) {
            let model = coast(row[0], row[1]);
            *cost = model.iter().zip(&measured).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
        }
        Ok(())
    };
    let bounds = vec![(1e-5, 1e-3), (1e-4, 0.1)];
    let setup = SearchSettings { bounds, population: 30, generations: 300, seed: 1, ..SearchSettings::default() };
    let mut runs = [Run::new(ConfiguredSearch::from(JayaOptions::default()).begin(setup)?)];
    let budget = Budget { generations: 300, slice: usize::MAX };
    minimize(&mut runs, budget, &mut evaluate, &mut |_| ControlFlow::Continue(()))?;
    let [run] = runs;
    let Some(best) = run.optimizer.best() else { return Ok(()) };
    println!("J = {:.3e} kg·m², T_c = {:.4} N·m, cost {:.1e}", best.values[0], best.values[1], best.cost);
    assert!((best.values[0] / 2e-4 - 1.0).abs() < 0.01 && (best.values[1] / 0.01 - 1.0).abs() < 0.01);
    Ok(())
}
