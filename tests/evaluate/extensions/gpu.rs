//! Proves: the GPU evaluators agree with the scalar oracle for extensions, in f64 to 1e-12 and in f32 to 3e-4.

use super::contract::{RANGES, candidates, check, check_on};
use crate::support::adapter::open;
use crate::support::{batch, changed, costs, driven, m2_record, near, problem};
use motorfit::candidates::Candidates;
use motorfit::criterion::Criterion;
use motorfit::evaluate::gpu::{Gpu, Precision};
use motorfit::evaluate::{Group, Model, Problem, Scalar, Simd};
use motorfit::motor::{Axis, Parameter, Parameters, Scope, Space};
use motorfit::record::Record;
use std::sync::Arc;

/// Relative tolerance of each precision, ten times the error of a software adapter: in f64 the order of sums differs; in f32 a
/// rounding error of 6e-8 grows over thousands of steps.
const PRECISIONS: [(Precision, f64); 2] = [(Precision::F64, 1e-12), (Precision::F32, 3e-4)];

fn each(test: impl Fn(&mut Gpu, f64)) {
    for (precision, relative) in PRECISIONS {
        if let Some(mut gpu) = open(precision) {
            println!("{precision:?}");
            test(&mut gpu, relative);
        }
    }
}

/// Returns recordings with regular sampling, so that delayed inputs are evaluated on the device: a switched voltage with load
/// torque; a ramp at another period; a masked step; one that starts in motion.
fn even() -> Vec<Record> {
    let times = |count: u32, h: f64| -> Vec<f64> { (0..count).map(|n| f64::from(n) * h).collect() };
    let switched = (0..701_u32).map(|n| if (n / 37 * 7919) % 3 == 0 { 8.0 } else { -3.0 }).collect();
    let torque = (0..701_u32).map(|n| if n > 400 { 0.02 } else { 0.0 }).collect();
    let ramp = (0..333_u32).map(|n| 0.05 * f64::from(n) - 3.0).collect();
    let moving = (0..500_u32).map(|n| 6.0 + 3.0 * (0.05 * f64::from(n)).sin()).collect();
    let moving = changed(&driven(times(500, 1e-3), moving, None), |s| {
        let rest = |signal: &mut Vec<f64>| signal.drain(..100).count();
        let cut = [&mut s.time_s, &mut s.voltage].map(rest);
        assert_eq!(cut, [100; 2]);
        s.current.iter_mut().chain(&mut s.speed).for_each(|signal| drop(signal.drain(..100)));
    });
    let short = driven(vec![0.0, 1e-3], vec![5.0, 5.0], None);
    vec![
        driven(times(701, 1e-3), switched, Some(torque)),
        driven(times(333, 2e-3), ramp, None),
        m2_record(),
        moving,
        short,
    ]
}

#[test]
fn all_precisions_agree_with_the_oracle() {
    each(|gpu, relative| check(gpu, relative));
}

#[test]
fn delayed_inputs_agree_with_the_oracle() {
    each(|gpu, relative| check_on(gpu, relative, &even()));
}

/// Returns a problem with these extensions, free within bounds.
fn problem_with(records: &[Record], extensions: &[(Parameter, f64, f64)]) -> Arc<Problem> {
    let mut axes = Space::table2().free().to_vec();
    axes.extend(extensions.iter().map(|&(parameter, min, max)| Axis { parameter, scope: Scope::Shared, min, max }));
    let space = Space::new(axes, Vec::new()).unwrap();
    Arc::new(Problem::new(records, Model::default(), space, Criterion::default()).unwrap())
}

/// Returns the bounds of these parameters.
fn ranges(parameters: &[Parameter]) -> Vec<(Parameter, f64, f64)> {
    RANGES.into_iter().filter(|range| parameters.contains(&range.0)).collect()
}

fn group<'a>(problem: &'a Arc<Problem>, values: &'a [f64]) -> Group<'a> {
    Group { problem, candidates: Candidates::new(values, problem.space().free().len()), reference: None }
}

fn agree(ours: &[f64], oracle: &[f64], relative: f64) {
    assert_eq!(ours.len(), oracle.len());
    for (row, (ours, oracle)) in ours.iter().zip(oracle).enumerate() {
        let fits = ours.to_bits() == oracle.to_bits() || (ours - oracle).abs() <= relative * oracle;
        assert!(fits, "{row}: {ours:e} against {oracle:e}");
    }
    let off = ours.iter().zip(oracle).filter(|(ours, oracle)| ours != oracle).map(|(a, b)| (a - b).abs() / b);
    println!("off by {:.1e} at most", off.fold(0.0, f64::max));
}

#[test]
fn f32_is_evaluated_without_deviations() {
    let (Some(mut f32), Some(mut plain)) = (open(Precision::F32), open(Precision::F32Plain)) else { return };
    let problem = problem_with(&even(), &RANGES);
    let values = candidates(problem.space(), 33, 1);
    assert_eq!(costs(&mut f32, &problem, &values), costs(&mut plain, &problem, &values));
}

#[test]
fn mixed_batches_keep_their_order() {
    use Parameter as P;
    let uneven = (0..257_u32).map(|n| (f64::from(n) + 0.3 * (f64::from(n) * 1.7).sin()) * 1e-3).collect();
    let uneven = driven(uneven, (0..257_u32).map(|n| 6.0 * (0.1 * f64::from(n)).sin()).collect(), None);
    each(|gpu, relative| {
        let problems = [
            problem_with(&even(), &ranges(&[P::Coulomb, P::Load])),
            problem(&[m2_record()], Model::default(), Criterion::default()),
            // Dead time with irregular sampling is evaluated on the CPU.
            problem_with(&[m2_record(), uneven.clone()], &ranges(&[P::DeadTime, P::Coulomb])),
            problem_with(&even(), &ranges(&[P::DeadTime, P::Latency])),
            problem_with(std::slice::from_ref(&uneven), &ranges(&[P::Coulomb, P::SpeedAverage])),
            problem_with(&even()[..1], &RANGES),
        ];
        let counts = [3, 129, 5, 70, 1, 33];
        let values: Vec<Vec<f64>> =
            problems.iter().zip(counts).map(|(p, count)| candidates(p.space(), count, count)).collect();
        let groups: Vec<Group<'_>> = problems.iter().zip(&values).map(|(p, values)| group(p, values)).collect();
        let ours = batch(gpu, &groups).unwrap();
        agree(&ours, &batch(&mut Scalar, &groups).unwrap(), relative);
        // A cost depends neither on the batch nor on the index in it.
        assert_eq!(batch(gpu, &groups[3..4]).unwrap(), ours[137..207]);
        assert_eq!(batch(gpu, &groups[2..3]).unwrap(), ours[132..137]);
        assert_eq!(batch(gpu, &groups).unwrap(), ours);
        let none = Group { candidates: Candidates::new(&[], groups[5].candidates.width()), ..groups[5] };
        assert_eq!(batch(gpu, &[none, groups[0]]).unwrap(), ours[..3]);
    });
}

#[test]
fn long_recordings_take_several_dispatches() {
    let times: Vec<f64> = (0..200_001_u32).map(|n| f64::from(n) * 1e-3).collect();
    let stairs = (0..200_001_u32).map(|n| if (n / 700) % 2 == 1 { 9.0 } else { -2.0 }).collect();
    let torque = (0..200_001_u32).map(|n| if n % 60_000 < 1000 { 0.01 } else { 0.0 }).collect();
    let records = [driven(times, stairs, Some(torque)), m2_record()];
    let problem = problem_with(&records, &RANGES);
    let undelayed: Vec<_> =
        RANGES.into_iter().filter(|range| ![Parameter::DeadTime, Parameter::Latency].contains(&range.0)).collect();
    let undelayed = problem_with(&records, &undelayed);
    each(|gpu, relative| {
        for problem in [&problem, &undelayed] {
            let values = candidates(problem.space(), 9, 4);
            // The running sums of the moving averages are rounded 200,000 times.
            agree(&costs(gpu, problem, &values), &costs(&mut Scalar, problem, &values), 10.0 * relative);
        }
    });
}

#[test]
fn long_windows_are_split_and_the_longest_go_to_the_cpu() {
    let windows = [(Parameter::CurrentAverage, 1.0, 2500.0), (Parameter::SpeedAverage, 1.0, 1e9)];
    let problem = problem_with(&[m2_record()], &windows);
    let mut values = candidates(problem.space(), 2500, 2);
    // Windows from one sample to more than the recording.
    values.chunks_exact_mut(7).enumerate().for_each(|(n, row)| row[6] = 1.0 + 2.7 * n as f64);
    each(|gpu, relative| {
        agree(&costs(gpu, &problem, &values), &costs(&mut Simd::default(), &problem, &values), relative);
        let mut beyond = candidates(problem.space(), 3, 2);
        beyond[5] = 2900.5;
        agree(&costs(gpu, &problem, &beyond), &costs(&mut Scalar, &problem, &beyond), relative);
    });
}

#[test]
fn invalid_candidates_do_not_affect_others() {
    let problem = problem_with(&even()[..1], &RANGES);
    let width = problem.space().free().len();
    let motor = candidates(problem.space(), 1, 7);
    let mut values = Vec::new();
    for axis in 0..width {
        for poison in [f64::NAN, f64::INFINITY, 1e300, -1.0, 5e-324] {
            let mut row = motor.clone();
            row[axis] = poison;
            values.extend([row, motor.clone()].concat());
        }
    }
    each(|gpu, relative| {
        let costs = costs(gpu, &problem, &values);
        let alone = self::costs(gpu, &problem, &motor)[0];
        agree(&[alone], &self::costs(&mut Scalar, &problem, &motor), relative);
        for (n, pair) in costs.chunks(2).enumerate() {
            assert!(pair[0] <= 1e30 || pair[0] == f64::INFINITY, "{n}: {}", pair[0]);
            assert_eq!(pair[1].to_bits(), alone.to_bits(), "{n}");
            assert!(n % 5 != 0 || pair[0].is_infinite(), "NaN costs {}", pair[0]);
        }
    });
}

#[test]
fn extensions_that_change_nothing_cost_the_same_on_the_device() {
    let neutral: Vec<(Parameter, f64)> = Parameter::EXTENSIONS
        .into_iter()
        .map(|p| (p, if p == Parameter::Saturation { 1e9 } else { p.neutral() }))
        .collect();
    let space = Space::table2_with(&[], &neutral).unwrap();
    let extended = Problem::new(&[m2_record()], Model::default(), space, Criterion::default()).unwrap();
    let linear = problem(&[m2_record()], Model::default(), Criterion::default());
    let values = near(40, 0.3, 3);
    assert_eq!(values.len(), 40 * Parameters::M2.to_array().len());
    each(|gpu, relative| {
        agree(&costs(gpu, &Arc::new(extended.clone()), &values), &costs(&mut Scalar, &linear, &values), relative);
    });
}
