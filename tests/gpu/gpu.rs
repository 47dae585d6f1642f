//! Proves: the GPU evaluators agree with the scalar oracle: f64 with the bounds of SIMD, f32 within a relative 2e-5 of the
//! residuals down to a distance of 1e-2 from the optimum, within 1e-4 at 1e-3 and 1e-3 at 1e-4; for every shape of batch (f64
//! within 1e-11, f32 within 1e-3) and beyond the limits of a dispatch; faults are errors, not panics. Runs on any adapter,
//! including software ones.
//! Does not prove: speed.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(clippy::cast_possible_truncation, clippy::float_cmp, reason = "small numbers; exact equality is meant")]

use crate::support::adapter::open;
use crate::support::suite::{check, edges, mixed_records, suite};
use crate::support::{NORMS, SCALES, batch, costs, criterion, driven, m2_record, near, problem, uniform};
use motorfit::candidates::Candidates;
use motorfit::criterion::{Criterion, Norm, Scale};
use motorfit::evaluate::gpu::{Gpu, Precision, Selector};
use motorfit::evaluate::{Group, Initial, Model, Problem, Scalar, Simd};
use motorfit::experiment::{Excitation, simulated};
use motorfit::motor::{Discretization, Parameters};
use std::sync::Arc;

/// Returns a motor with deviations of at least 1 % in each parameter, like the reference candidate of a search after some
/// generations.
fn reference() -> [f64; 5] {
    let truth = Parameters::M2.to_array();
    [0, 1, 2, 3, 4].map(|p| truth[p] * [1.02, 0.97, 1.015, 0.98, 1.03][p])
}

/// Returns costs computed in deviations from [`reference`].
fn costs_near_reference(gpu: &mut Gpu, problem: &Arc<Problem>, values: &[f64]) -> Vec<f64> {
    let reference = reference();
    let groups = [Group { problem, candidates: Candidates::new(values, 5), reference: Some(&reference) }];
    batch(gpu, &groups).unwrap()
}

#[test]
fn f64_agrees_with_the_oracle() {
    let Some(mut gpu) = open(Precision::F64) else { return };
    suite(&mut gpu).unwrap_or_else(|e| panic!("{e}"));
    let problem = problem(&[m2_record()], Model::default(), Criterion::default());
    check(&mut gpu, &problem, &uniform(10_000, 11)).unwrap_or_else(|e| panic!("{e}"));
}

#[test]
fn f32_in_deviations_is_close() {
    let Some(mut gpu) = open(Precision::F32) else { return };
    for (norm, scale) in NORMS.into_iter().flat_map(|n| SCALES.map(|s| (n, s))) {
        let problem = problem(&[m2_record()], Model::default(), criterion(norm, scale));
        let squared = matches!(norm, Norm::Ise | Norm::Itse | Norm::Mse);
        for (distance, values) in [
            ("box", uniform(500, 7)),
            ("1e-2", near(500, 1e-2, 1)),
            ("1e-3", near(500, 1e-3, 2)),
            ("1e-4", near(500, 1e-4, 3)),
        ] {
            let ours = costs_near_reference(&mut gpu, &problem, &values);
            let oracle = costs(&mut Scalar, &problem, &values);
            // The bound is on the residuals; the relative error of a sum of squares is twice as large.
            let error = |(a, b): (&f64, &f64)| (a - b).abs() / b / if squared { 2.0 } else { 1.0 };
            let mut errors: Vec<f64> = ours.iter().zip(&oracle).map(error).collect();
            errors.sort_by(f64::total_cmp);
            let (median, worst) = (errors[250], errors[499]);
            // Samples and deviations are stored in f32 with an error of 6e-8 of some 2e-2 of a signal. That is 6e-8·20 of a
            // residual at 1e-3, 6e-8·200 at 1e-4, and more if a criterion weights mainly the speed or late samples.
            let bound = match distance {
                "1e-4" => 1e-3,
                "1e-3" if scale == Scale::None || norm == Norm::Itae || norm == Norm::Itse => 1e-4,
                _ => 2e-5,
            };
            assert!(worst <= bound && median <= 2e-5, "{norm:?} {scale:?} {distance}: {median:.1e}, {worst:.1e}");
            if (norm, scale) == (Norm::Nrmse, Scale::Std) {
                println!("f32 {distance}: median {median:.1e}, worst {worst:.1e}");
            }
        }
    }
}

#[test]
fn f32_keeps_the_order() {
    let Some(mut gpu) = open(Precision::F32) else { return };
    let problem = problem(&[m2_record()], Model::default(), Criterion::default());
    let values = near(1000, 1e-4, 5);
    let ours = costs_near_reference(&mut gpu, &problem, &values);
    let oracle = costs(&mut Scalar, &problem, &values);
    let lowest = |costs: &[f64]| (0..1000).min_by(|a, b| costs[*a].total_cmp(&costs[*b])).unwrap();
    assert_eq!(lowest(&ours), lowest(&oracle), "the best of 1000");
    let pairs = (0..1000).flat_map(|a| (0..a).map(move |b| (a, b)));
    let swapped = pairs.filter(|&(a, b)| (ours[a] < ours[b]) != (oracle[a] < oracle[b])).count();
    println!("f32: {swapped} of 499500 pairs misordered at 1e-4 from the optimum");
    assert!(swapped <= 49, "{swapped} of 499500 pairs");
}

#[test]
fn every_shape_of_batch() {
    for precision in [Precision::F64, Precision::F32] {
        let Some(mut gpu) = open(precision) else { continue };
        let bound = if precision == Precision::F64 { 1e-11 } else { 1e-3 };
        let records = mixed_records();
        let mut problems: Vec<Arc<Problem>> = Vec::new();
        for norm in [Norm::Nrmse, Norm::Itae, Norm::Itse] {
            problems.extend(records.iter().map(|r| {
                let model = Model { discretization: Discretization::Foh, initial: Initial::Measured };
                problem(std::slice::from_ref(r), model, criterion(norm, Scale::Peak))
            }));
        }
        problems.push(problem(&records, Model::default(), Criterion::default()));
        let values: Vec<Vec<f64>> = (0..problems.len()).map(|n| near([1, 3, 129, 517][n % 4], 0.2, n as u64)).collect();
        let reference = reference();
        let group =
            |(problem, values)| Group { problem, candidates: Candidates::new(values, 5), reference: Some(&reference) };
        let groups: Vec<Group<'_>> = problems.iter().zip(values.iter().map(Vec::as_slice)).map(group).collect();
        let ours = batch(&mut gpu, &groups).unwrap();
        let oracle = batch(&mut Scalar, &groups).unwrap();
        for (row, (ours, oracle)) in ours.iter().zip(&oracle).enumerate() {
            assert!((ours - oracle).abs() <= bound * oracle, "{precision:?} {row}: {ours:e} against {oracle:e}");
        }
        // A cost depends neither on the batch nor on the index in it, and is the same in every call.
        assert_eq!(batch(&mut gpu, &groups[2..3]).unwrap(), ours[4..133]);
        assert_eq!(batch(&mut gpu, &groups).unwrap(), ours);
        assert!(batch(&mut gpu, &[]).unwrap().is_empty());
        let none = Group { candidates: Candidates::new(&[], 5), ..groups[0] };
        assert_eq!(batch(&mut gpu, &[none, groups[0]]).unwrap(), ours[..1]);
    }
}

#[test]
fn recordings_longer_than_a_dispatch_may_loop() {
    let time: Vec<f64> = (0..200_001_u32).map(|n| f64::from(n) * 1e-3).collect();
    let stairs = (0..200_001_u32).map(|n| if (n / 5000) % 2 == 1 { 9.0 } else { 2.0 }).collect();
    // Every sample is a segment, which doubles the iterations.
    let sine = (0..200_001_u32).map(|n| 6.0 * (0.01 * f64::from(n)).sin()).collect();
    for voltage in [stairs, sine] {
        let record = driven(time.clone(), voltage, None);
        let short = m2_record();
        let problems = [record, short].map(|r| problem(&[r], Model::default(), Criterion::default()));
        for (precision, bound) in [(Precision::F64, 1e-10), (Precision::F32, 1e-3)] {
            let Some(mut gpu) = open(precision) else { continue };
            let (values, reference) = (near(9, 0.1, 1), reference());
            let candidates = Candidates::new(&values, 5);
            let groups = problems.each_ref().map(|problem| Group { problem, candidates, reference: Some(&reference) });
            let (ours, oracle) = (batch(&mut gpu, &groups).unwrap(), batch(&mut Scalar, &groups).unwrap());
            for (ours, oracle) in ours.iter().zip(&oracle) {
                assert!((ours - oracle).abs() <= bound * oracle, "{precision:?}: {ours:e} against {oracle:e}");
            }
        }
    }
}

#[test]
fn more_workgroups_than_one_dimension_and_more_candidates_than_one_buffer() {
    let Some(mut gpu) = open(Precision::F64) else { return };
    let times: Vec<f64> = (0..6_u32).map(|n| f64::from(n) * 1e-3).collect();
    let problem = problem(&[driven(times, vec![5.0; 6], None)], Model::default(), Criterion::default());
    let values = near(900_000, 0.2, 1);
    let mut simd = Simd::default();
    // 900,000 candidates need 72 MB of step maps, more than one submission allows.
    let oracle = costs(&mut simd, &problem, &values);
    let close = |ours: &[f64], oracle: &[f64]| ours.iter().zip(oracle).all(|(a, b)| (a - b).abs() <= 1e-11 * b);
    assert!(close(&costs(&mut gpu, &problem, &values), &oracle));
    // 70,000 groups of one candidate take one workgroup each.
    let group = |row: usize| Group {
        problem: &problem,
        candidates: Candidates::new(&values[5 * row..5 * row + 5], 5),
        reference: None,
    };
    let groups: Vec<Group<'_>> = (0..70_000).map(group).collect();
    assert!(close(&batch(&mut gpu, &groups).unwrap(), &oracle[..70_000]));
}

#[test]
fn edges_in_both_precisions() {
    for (precision, relative) in [(Precision::F64, 1e-12), (Precision::F32, 2e-5)] {
        let Some(mut gpu) = open(precision) else { continue };
        edges(&mut gpu, relative).unwrap_or_else(|e| panic!("{precision:?}: {e}"));
    }
}

#[test]
fn f32_is_accurate_for_recordings_shorter_than_a_time_constant() {
    let Some(mut gpu) = open(Precision::F32) else { return };
    // The steady state of a deviation is then up to 1000 times larger than the recorded signals.
    for (k, j, duration) in [(0.8, 0.05, 0.02), (0.8, 0.05, 0.2), (0.01, 1e-7, 0.02), (0.01, 1e-7, 2.0)] {
        let truth = Parameters { r: 1.0, l: 1e-3, k, b: 1e-4 * k, j };
        let excitation = Excitation::step(10.0, 0.005, duration, 0.001).unwrap();
        let record = simulated(&truth, &excitation, Discretization::Zoh).unwrap();
        let problem = problem(&[record], Model::default(), Criterion::default());
        let truth = truth.to_array();
        // Deviations are resolved to 6e-8 of 2e-2, so the error at a distance of 1e-3 is ten times that at 1e-2.
        for (distance, bound) in [(0.3, 2e-5), (1e-2, 2e-5), (1e-3, 1e-4)] {
            let away = |n: u32, p: usize| 1.0 + distance * (1.3 * f64::from(n * 7 + p as u32 * 13 + 1)).sin();
            let values: Vec<f64> = (0..400).flat_map(|n| [0, 1, 2, 3, 4].map(|p| truth[p] * away(n, p))).collect();
            let reference = [0, 1, 2, 3, 4].map(|p| truth[p] * [1.02, 0.97, 1.015, 0.98, 1.03][p]);
            let candidates = Candidates::new(&values, 5);
            let groups = [Group { problem: &problem, candidates, reference: Some(&reference) }];
            let (ours, oracle) = (batch(&mut gpu, &groups).unwrap(), batch(&mut Scalar, &groups).unwrap());
            for (ours, oracle) in ours.iter().zip(&oracle) {
                let error = (ours - oracle).abs() / oracle;
                assert!(error <= bound, "J {j}, {duration} s, {distance}: off by {error:.1e}");
            }
        }
    }
}

#[test]
fn unknown_adapters_are_errors() {
    for selector in [Selector::Index(99), Selector::Name("no such adapter".to_owned())] {
        let error = Gpu::open(&selector, None).err().unwrap();
        assert_eq!(error.kind(), motorfit::ErrorKind::Device);
        assert!(!error.hint().is_empty());
    }
}

#[test]
fn plain_f32_is_accurate_only_far_from_the_optimum() {
    let Some(mut gpu) = open(Precision::F32Plain) else { return };
    let problem = problem(&[m2_record()], Model::default(), Criterion::default());
    let worst = |gpu: &mut Gpu, values: &[f64]| {
        let (ours, oracle) = (costs(gpu, &problem, values), costs(&mut Scalar, &problem, values));
        ours.iter().zip(&oracle).map(|(a, b)| (a - b).abs() / b).fold(0.0, f64::max)
    };
    // A rounding error of 6e-8 grows over 3000 steps; the costs are of the size of the signal.
    assert!(worst(&mut gpu, &uniform(500, 7)) < 1e-4);
    assert!(worst(&mut gpu, &near(500, 1e-4, 3)) > 1e-2, "where deviations are within 1e-3");
}
