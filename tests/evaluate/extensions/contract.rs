//! Proves: the SIMD evaluator agrees with the scalar oracle for single and combined extensions, at every feature level.

use crate::support::suite::{agree, mixed_records};
use crate::support::{costs, driven, m2_record};
use motorfit::criterion::{Criterion, Norm, Scale};
use motorfit::evaluate::{Evaluator, Initial, Level, Model, Problem, Scalar, Simd};
use motorfit::motor::{Axis, Discretization, Parameter, Parameters, Scope, Space};
use motorfit::record::{Mask, Preparation, Record};
use std::sync::Arc;

/// Bounds of the extensions' parameters in these tests, in SI units.
pub const RANGES: [(Parameter, f64, f64); 11] = [
    (Parameter::Coulomb, 0.0, 0.05),
    (Parameter::Load, -0.02, 0.02),
    (Parameter::DeadTime, -0.001, 0.03),
    (Parameter::Latency, 0.0, 0.05),
    (Parameter::Offset, -0.5, 0.5),
    (Parameter::BrushDrop, 0.0, 1.5),
    (Parameter::Deadband, 0.0, 2.0),
    (Parameter::Saturation, 4.0, 12.0),
    (Parameter::NegativeGain, 0.7, 1.3),
    (Parameter::CurrentAverage, 1.0, 40.0),
    (Parameter::SpeedAverage, 1.0, 70.0),
];

/// Returns a space of the motor's five parameters and these extensions, with one latency per recording.
pub fn space(extensions: &[Parameter], recordings: usize) -> Space {
    let mut axes = Space::table2().free().to_vec();
    for (parameter, min, max) in RANGES {
        if extensions.contains(&parameter) {
            axes.push(Axis { parameter, scope: Scope::Shared, min, max });
        }
    }
    Space::new(axes, Vec::new()).unwrap().per_recording(&[Parameter::Latency], recordings).unwrap()
}

/// Returns candidates near the paper's motor, with extensions over their full bounds.
pub fn candidates(space: &Space, count: usize, seed: usize) -> Vec<f64> {
    let m2 = Parameters::M2;
    let wave = |n: usize| 0.5 + 0.5 * ((n * 37 + seed * 11 + 1) as f64 * 1.37).sin();
    let mut values = Vec::new();
    for row in 0..count {
        for (n, axis) in space.free().iter().enumerate() {
            let share = wave(row * 17 + n * 5);
            let own = if axis.parameter.is_extension() {
                // Includes both bounds.
                axis.min + (axis.max - axis.min) * (1.2 * share - 0.1).clamp(0.0, 1.0)
            } else {
                m2.get(axis.parameter) * (0.7 + 0.6 * share)
            };
            values.push(own);
        }
    }
    values
}

/// Returns recordings with zero-order and first-order hold, regular and irregular sampling, masked and prepared.
fn records() -> Vec<Record> {
    let mask = Mask::Time { channels: [true, false], from: 0.1, to: 1.02 };
    let masked = Preparation { mask: vec![mask], ..Preparation::default() };
    let decimated = Preparation { decimate: Some(3), ..Preparation::default() };
    let record = m2_record();
    let prepared = [masked, decimated].into_iter().flat_map(|preparation| preparation.apply(&record).unwrap());
    let short = driven(vec![0.0, 1e-3], vec![5.0, 5.0], None);
    mixed_records().into_iter().chain(prepared).chain([short]).collect()
}

/// Returns sets of extensions: single, pairs that are hard to tell apart, and all together.
pub fn sets() -> Vec<Vec<Parameter>> {
    use Parameter as P;
    let mut sets: Vec<Vec<Parameter>> = P::EXTENSIONS.into_iter().map(|p| vec![p]).collect();
    sets.push(vec![P::DeadTime, P::Latency]);
    sets.push(vec![P::DeadTime, P::SpeedAverage, P::Coulomb]);
    sets.push(vec![P::Coulomb, P::BrushDrop, P::Load]);
    sets.push(P::EXTENSIONS.to_vec());
    sets
}

/// Compares an evaluator with the oracle on all extensions, with relative tolerance `relative`.
pub fn check(evaluator: &mut dyn Evaluator, relative: f64) {
    check_on(evaluator, relative, &records());
}

/// Compares an evaluator with the oracle on all extensions and the given recordings.
pub fn check_on(evaluator: &mut dyn Evaluator, relative: f64, records: &[Record]) {
    let criteria = [(Norm::Nrmse, Scale::Std), (Norm::Itae, Scale::Peak)];
    let mut worst = 0.0_f64;
    for (seed, set) in sets().iter().enumerate() {
        for (discretization, initial) in [
            (Discretization::Zoh, Initial::Zero),
            (Discretization::Foh, Initial::Measured),
            (Discretization::Rk4, Initial::Zero),
        ] {
            for (norm, scale) in criteria {
                let space = space(set, records.len());
                let model = Model { discretization, initial };
                let criterion = Criterion { norm, scale, ..Criterion::default() };
                let problem = Arc::new(Problem::new(records, model, space.clone(), criterion).unwrap());
                // Not a multiple of any number of candidates side by side; at AVX-512 they fill the wider blocks of even clocks.
                let values = candidates(&space, 29, seed);
                let (ours, oracle) = (costs(evaluator, &problem, &values), costs(&mut Scalar, &problem, &values));
                for (row, (ours, oracle)) in ours.iter().zip(&oracle).enumerate() {
                    worst = worst.max((ours - oracle).abs() / oracle);
                    let fits = if relative == 0.0 {
                        agree(*ours, *oracle, *oracle).is_ok()
                    } else {
                        (ours - oracle).abs() <= relative * oracle
                    };
                    let symbols: Vec<&str> = set.iter().map(|p| p.symbol()).collect();
                    assert!(fits, "{symbols:?} {discretization:?} {norm:?} {row}: {ours:e} against {oracle:e}");
                }
            }
        }
    }
    println!("{}: off by {worst:.1e} at most", evaluator.name());
}

#[test]
fn simd_agrees_with_the_oracle_with_extensions() {
    let even: Vec<Record> = records().into_iter().filter(|record| record.steps().step_index.is_empty()).collect();
    assert!(even.len() >= 3 && even.len() < records().len());
    for level in Level::available() {
        check(&mut Simd::at(level), 0.0);
        // On even clocks alone other kernels run.
        check_on(&mut Simd::at(level), 0.0, &even);
    }
}

#[test]
fn extensions_that_change_nothing_cost_the_same() {
    let records = [m2_record()];
    let linear = Arc::new(Problem::new(&records, Model::default(), Space::table2(), Criterion::default()).unwrap());
    let axes = Space::table2().free().to_vec();
    let neutral: Vec<(Parameter, Scope, f64)> = Parameter::EXTENSIONS
        .into_iter()
        .map(|p| (p, Scope::Shared, if p == Parameter::Saturation { 1e9 } else { p.neutral() }))
        .collect();
    let extended = Space::new(axes, neutral).unwrap();
    let extended = Arc::new(Problem::new(&records, Model::default(), extended, Criterion::default()).unwrap());
    let values = candidates(&Space::table2(), 40, 3);
    for evaluator in [&mut Scalar as &mut dyn Evaluator, &mut Simd::default()] {
        let (a, b) = (costs(&mut Scalar, &linear, &values), costs(evaluator, &extended, &values));
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() < 1e-11 * a, "{a:e} {b:e}");
        }
    }
}

/// Pieces of constant input end where the input of any candidate of a block changes, and no cost may depend on that.
#[test]
fn a_cost_does_not_depend_on_the_candidates_beside_it() {
    // Runs of 1 to 700 samples, longer than a block of sums and shorter than a piece.
    let edges = [1_u32, 2, 40, 90, 790, 791, 1500, 2200, 2230, 2900];
    let time_s = (0..3500_u32).map(|n| f64::from(n) * 1e-3).collect();
    let voltage =
        (0..3500_u32).map(|n| 3.0 * f64::from(edges.iter().filter(|edge| **edge <= n).count() as u8 % 4)).collect();
    let records = [driven(time_s, voltage, None), mixed_records().remove(2)];
    for set in sets() {
        let space = space(&set, records.len());
        for discretization in [Discretization::Zoh, Discretization::Foh] {
            let model = Model { discretization, initial: Initial::Zero };
            let problem = Arc::new(Problem::new(&records, model, space.clone(), Criterion::default()).unwrap());
            let values = candidates(&space, 50, 7);
            for level in Level::available() {
                let together = costs(&mut Simd::at(level), &problem, &values);
                let oracle = costs(&mut Scalar, &problem, &values);
                for (row, candidate) in values.chunks(space.free().len()).enumerate() {
                    let alone = costs(&mut Simd::at(level), &problem, candidate)[0];
                    assert_eq!(alone.to_bits(), together[row].to_bits(), "{set:?} {discretization:?}, candidate {row}");
                    agree(alone, oracle[row], oracle[row]).unwrap_or_else(|e| panic!("{set:?} {row}: {e}"));
                }
            }
        }
    }
}
