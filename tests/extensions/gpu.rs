//! The evaluators of GPUs against the oracle, with any extensions.

use super::contract::{RANGES, candidates, check, check_on, space};
use super::support::adapter::open;
use super::support::{batch, changed, costs, driven, m2_record, near, problem};
use motorfit::candidates::Candidates;
use motorfit::criterion::Criterion;
use motorfit::evaluate::gpu::{Gpu, Precision};
use motorfit::evaluate::{Group, Model, Problem, Scalar, Simd};
use motorfit::motor::{Axis, Parameter, Parameters, Scope, Space};
use motorfit::record::Record;
use std::sync::Arc;

/// What each precision may be off: in f64 sums are in another order; f32 keeps 6e-8 of a signal, grown by thousands of
/// steps, of costs of about a tenth of the signal.
const PRECISIONS: [(Precision, f64); 3] =
    [(Precision::F64, 1e-11), (Precision::F32, 1e-3), (Precision::F32Plain, 1e-3)];

fn each(test: impl Fn(&mut Gpu, f64)) {
    for (precision, relative) in PRECISIONS {
        if let Some(mut gpu) = open(precision) {
            println!("{precision:?}");
            test(&mut gpu, relative);
        }
    }
}

/// Even clocks, so that late inputs are evaluated on the device: switched with torque; a ramp at another period; a step
/// that is masked; from the middle of a movement.
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
fn all_precisions_mean_the_same() {
    each(|gpu, relative| check(gpu, relative));
}

#[test]
fn late_inputs_mean_the_same_on_the_device() {
    each(|gpu, relative| check_on(gpu, relative, &even()));
}
