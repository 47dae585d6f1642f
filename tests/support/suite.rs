//! The contract of an evaluator, against the oracle; generic over the evaluator.

use super::{NORMS, SCALES, costs, criterion, driven, m2_record, near, problem, uniform};
use motorfit::criterion::Criterion;
use motorfit::evaluate::{Evaluator, Initial, Model, Problem, Scalar};
use motorfit::motor::Discretization;
use std::sync::Arc;

/// The bound: |c − c₀| ≤ 1e-12·c₀ + 1e-14·c(all-zero output). The first term is the rounding of sums and recurrences
/// over thousands of steps; the second what is left where simulation and measurement cancel.
pub fn agree(ours: f64, oracle: f64, zero: f64) -> std::result::Result<(), String> {
    if ours.to_bits() == oracle.to_bits() || (ours - oracle).abs() <= 1e-12 * oracle + 1e-14 * zero {
        return Ok(());
    }
    Err(format!("{ours:e} against {oracle:e}: off by {:.1e} of it", (ours - oracle).abs() / oracle))
}

/// The cost of a motor that does not move: enormous resistance and inertia.
pub fn zero_output(problem: &Arc<Problem>) -> f64 {
    costs(&mut Scalar, problem, &[1e12, 1e12, 1e-12, 1e-12, 1e12])[0]
}

/// Compares an evaluator with the oracle on one problem.
pub fn check(evaluator: &mut dyn Evaluator, problem: &Arc<Problem>, values: &[f64]) -> std::result::Result<(), String> {
    let ours = costs(evaluator, problem, values);
    let oracle = costs(&mut Scalar, problem, values);
    let zero = zero_output(problem);
    for (row, (ours, oracle)) in ours.iter().zip(&oracle).enumerate() {
        agree(*ours, *oracle, zero).map_err(|e| format!("{} candidate {row}: {e}", evaluator.name()))?;
    }
    Ok(())
}

/// The suite that every evaluator passes.
pub fn suite(evaluator: &mut dyn Evaluator) -> std::result::Result<(), String> {
    let records = [m2_record()];
    let model = Model::default();
    for (seed, (norm, scale)) in NORMS.into_iter().flat_map(|n| SCALES.map(|s| (n, s))).enumerate() {
        let problem = problem(&records, model, criterion(norm, scale));
        // Counts that are no multiple of anything.
        check(evaluator, &problem, &uniform(61, seed as u64)).map_err(|e| format!("{norm:?} {scale:?} box: {e}"))?;
        for distance in [1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
            check(evaluator, &problem, &near(13, distance, seed as u64))
                .map_err(|e| format!("{norm:?} {scale:?} at {distance:e}: {e}"))?;
        }
    }
    for discretization in [Discretization::Zoh, Discretization::Foh, Discretization::Rk4, Discretization::Euler] {
        let problem =
            problem(&mixed_records(), Model { discretization, initial: Initial::Measured }, Criterion::default());
        check(evaluator, &problem, &near(29, 0.3, 5)).map_err(|e| format!("{discretization:?}: {e}"))?;
    }
    Ok(())
}

/// Recordings of different lengths: PRBS-like with torque, a ramp at another period, and irregular times.
pub fn mixed_records() -> Vec<motorfit::record::Record> {
    let regular = |count: u32, h: f64| -> Vec<f64> { (0..count).map(|n| f64::from(n) * h).collect() };
    let switched = (0..701_u32).map(|n| if (n / 37 * 7919) % 3 == 0 { 8.0 } else { -3.0 }).collect();
    let torque = (0..701_u32).map(|n| if n > 400 { 0.02 } else { 0.0 }).collect();
    let ramp = (0..333_u32).map(|n| 0.05 * f64::from(n)).collect();
    let irregular = (0..257_u32).map(|n| (f64::from(n) + 0.3 * (f64::from(n) * 1.7).sin()) * 1e-3).collect();
    let sine = (0..257_u32).map(|n| 6.0 * (0.1 * f64::from(n)).sin()).collect();
    vec![
        driven(regular(701, 1e-3), switched, Some(torque)),
        driven(regular(333, 2e-3), ramp, None),
        driven(irregular, sine, None),
    ]
}
