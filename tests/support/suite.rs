//! Contract of an evaluator: comparison with the scalar oracle, generic over the evaluator.

use super::{NORMS, SCALES, changed, costs, criterion, driven, m2_record, near, problem, uniform};
use motorfit::criterion::{Criterion, Norm, Scale};
use motorfit::evaluate::{Evaluator, Initial, Model, Problem, Scalar};
use motorfit::motor::{Discretization, Parameters};
use std::sync::Arc;

/// Relative error of an evaluator that simulates: rounding of sums and recurrences over thousands of steps.
pub const SIMULATED: f64 = 1e-12;

/// Checks |c − c₀| ≤ ε·c₀ + 1e-14·c(zero output) with the relative error ε. The second term bounds the cancellation of simulation and
/// measurement near the optimum.
pub fn agree_within(ours: f64, oracle: f64, (relative, zero): (f64, f64)) -> std::result::Result<(), String> {
    if ours.to_bits() == oracle.to_bits() || (ours - oracle).abs() <= relative * oracle + 1e-14 * zero {
        return Ok(());
    }
    Err(format!("{ours:e} against {oracle:e}: off by {:.1e} of it", (ours - oracle).abs() / oracle))
}

/// Checks the costs of an evaluator that simulates.
pub fn agree(ours: f64, oracle: f64, zero: f64) -> std::result::Result<(), String> {
    agree_within(ours, oracle, (SIMULATED, zero))
}

/// Returns the cost of a zero output: that of a motor with an enormous resistance and inertia.
pub fn zero_output(problem: &Arc<Problem>) -> f64 {
    costs(&mut Scalar, problem, &[1e12, 1e12, 1e-12, 1e-12, 1e12])[0]
}

/// Compares an evaluator with the oracle on one problem.
pub fn check(evaluator: &mut dyn Evaluator, problem: &Arc<Problem>, values: &[f64]) -> std::result::Result<(), String> {
    check_within(evaluator, problem, values, SIMULATED)
}

/// Compares an evaluator of a relative error with the oracle on one problem.
pub fn check_within(
    evaluator: &mut dyn Evaluator,
    problem: &Arc<Problem>,
    values: &[f64],
    relative: f64,
) -> std::result::Result<(), String> {
    let ours = costs(evaluator, problem, values);
    let oracle = costs(&mut Scalar, problem, values);
    let zero = zero_output(problem);
    for (row, (ours, oracle)) in ours.iter().zip(&oracle).enumerate() {
        agree_within(*ours, *oracle, (relative, zero))
            .map_err(|e| format!("{} candidate {row}: {e}", evaluator.name()))?;
    }
    Ok(())
}

/// Checks everything that every evaluator that simulates must satisfy.
pub fn suite(evaluator: &mut dyn Evaluator) -> std::result::Result<(), String> {
    suite_within(evaluator, SIMULATED)
}

/// Checks everything that every evaluator of a relative error must satisfy.
pub fn suite_within(evaluator: &mut dyn Evaluator, relative: f64) -> std::result::Result<(), String> {
    let check = |evaluator: &mut dyn Evaluator, problem: &Arc<Problem>, values: &[f64]| {
        check_within(evaluator, problem, values, relative)
    };
    let records = [m2_record()];
    let model = Model::default();
    for (seed, (norm, scale)) in NORMS.into_iter().flat_map(|n| SCALES.map(|s| (n, s))).enumerate() {
        let problem = problem(&records, model, criterion(norm, scale));
        // The count is not a multiple of any block size.
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
        let prepared = [prepared_records(), mixed_records()].concat();
        let problem = problem_of(&prepared, discretization);
        check(evaluator, &problem, &near(29, 0.3, 5)).map_err(|e| format!("{discretization:?}, prepared: {e}"))?;
    }
    Ok(())
}

fn problem_of(records: &[motorfit::record::Record], discretization: Discretization) -> Arc<Problem> {
    problem(records, Model { discretization, initial: Initial::Measured }, criterion(Norm::Iae, Scale::Std))
}

/// Returns recordings with masks, and with a first-order hold of the voltage.
fn prepared_records() -> Vec<motorfit::record::Record> {
    use motorfit::record::{Mask, Preparation};
    let decimated = Preparation { decimate: Some(3), ..Preparation::default() };
    let mask = Mask::Time { channels: [true, false], from: 0.1, to: 1.02 };
    let masked = Preparation { mask: vec![mask], ..Preparation::default() };
    let both = Preparation { mask: vec![mask], rate_hz: Some(400.0), ..Preparation::default() };
    let record = m2_record();
    [decimated, masked, both].iter().flat_map(|preparation| preparation.apply(&record).unwrap()).collect()
}

/// Returns recordings of different lengths: a binary voltage with load torque, a ramp at another period, irregular sampling.
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

/// Checks an evaluator with relative tolerance `relative` at edge cases: recordings without a channel, at rest, or of two
/// samples; invalid candidates.
pub fn edges(evaluator: &mut dyn Evaluator, relative: f64) -> std::result::Result<(), String> {
    let record = m2_record();
    let zero = Model { initial: Initial::Zero, ..Model::default() };
    let none = criterion(Norm::Euclidean, Scale::None);
    let without_current = changed(&record, |s| s.current = None);
    let without_speed = changed(&record, |s| s.speed = None);
    // Samples before the input starts count as well; a recording that is all rest is not simulated at all.
    let offset = changed(&record, |s| s.current.iter_mut().flatten().for_each(|v| *v += 0.01));
    let still = changed(&record, |s| s.voltage.fill(0.0));
    let two = driven(vec![0.0, 1e-3], vec![5.0, 5.0], None);
    for (name, record, model, criterion) in [
        ("without current", without_current, Model::default(), none),
        ("without speed", without_speed, Model::default(), none),
        ("offset at rest", offset, zero, criterion(Norm::Itae, Scale::Peak)),
        ("all at rest", still, zero, Criterion::default()),
        ("two samples", two, zero, none),
    ] {
        let problem = problem(&[record], model, criterion);
        let values = [uniform(31, 2), vec![f64::NAN, 1.0, 1.0, 1.0, 1.0]].concat();
        let (ours, oracle) = (costs(evaluator, &problem, &values), costs(&mut Scalar, &problem, &values));
        let bound = |oracle: f64| relative * oracle + 1e-14 * zero_output(&problem);
        for (row, (ours, oracle)) in ours.iter().zip(&oracle).enumerate() {
            if ours.to_bits() != oracle.to_bits() && ((ours - oracle).abs() > bound(*oracle) || ours.is_nan()) {
                return Err(format!("{name}, candidate {row}: {ours:e} against {oracle:e}"));
            }
        }
        if !ours[31].is_infinite() {
            return Err(format!("{name}: NaN costs {}", ours[31]));
        }
    }
    poison(evaluator)
}

/// Checks that invalid candidates cost at most 1e30 or infinity, and do not affect others.
fn poison(evaluator: &mut dyn Evaluator) -> std::result::Result<(), String> {
    let m2 = Parameters::M2.to_array();
    let mut values = Vec::new();
    for axis in 0..5 {
        for poison in [0.0, -0.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 5e-324, -1.0, 1e300, 1e-300] {
            let mut candidate = m2;
            candidate[axis] = poison;
            values.extend(candidate);
        }
    }
    values.extend(m2);
    for discretization in [Discretization::Zoh, Discretization::Euler] {
        let model = Model { discretization, initial: Initial::Auto };
        let problem = problem(&[m2_record()], model, Criterion::default());
        let costs = costs(evaluator, &problem, &values);
        let wrong = |c: &f64| c.is_nan() || !(*c <= 1e30 || *c == f64::INFINITY);
        if costs.iter().any(wrong) || !costs[2].is_infinite() || costs[45] >= 0.1 {
            return Err(format!("{discretization:?}: {costs:?}"));
        }
    }
    // The Euler method diverges for a step that is far too long.
    let slow: Vec<f64> = (0..400_u32).map(|n| f64::from(n) * 0.1).collect();
    let model = Model { discretization: Discretization::Euler, initial: Initial::Auto };
    let problem = problem(&[driven(slow, vec![5.0; 400], None)], model, Criterion::default());
    let diverged = costs(evaluator, &problem, &m2)[0];
    if diverged.is_infinite() { Ok(()) } else { Err(format!("a divergence costs {diverged}")) }
}
