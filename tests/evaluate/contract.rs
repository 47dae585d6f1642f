//! Proves: the SIMD evaluator agrees with the scalar oracle for all criteria and scales, near and far from the optimum, at
//! every feature level of this machine and for every shape of batch, within 1e-12 of the cost plus 1e-14 of that of a zero
//! output; the tables of poles agree with it within 1e-8 of the cost; a corrupted evaluator fails this suite.
//! Does not prove: that the oracle is right (see motor.rs), or speed.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and print")]
#![allow(clippy::cast_possible_truncation, clippy::float_cmp, reason = "small numbers; exact equality is meant")]

use crate::support::suite::{check, check_within, edges, mixed_records, suite, suite_within, zero_output};
use crate::support::{SCALES, batch, changed, costs, criterion, driven, m2_record, near, problem, uniform};
use motorfit::Result;
use motorfit::candidates::Candidates;
use motorfit::criterion::{Criterion, Norm, Scale};
use motorfit::evaluate::{Batch, Evaluator, Group, Initial, Level, Model, PoleTables, Problem, Scalar, Simd};
use motorfit::motor::{Discretization, Parameters};
use motorfit::record::Record;
use std::sync::Arc;

#[test]
fn simd_agrees_with_the_oracle_at_every_level() {
    for level in Level::available() {
        suite(&mut Simd::at(level)).unwrap_or_else(|e| panic!("{e}"));
        println!("{} passes", level.name());
    }
}

#[test]
fn ten_thousand_candidates_of_the_box() {
    let problem = problem(&[m2_record()], Model::default(), Criterion::default());
    let values = uniform(10_000, 11);
    for level in Level::available() {
        check(&mut Simd::at(level), &problem, &values).unwrap_or_else(|e| panic!("{e}"));
    }
}

/// Relative error of the tables of poles, as the contract has it; their own limit is 1e-9.
const TABLES: f64 = 1e-8;

#[test]
fn tables_of_poles_agree_with_the_oracle_at_every_level() {
    for level in Level::available() {
        suite_within(&mut PoleTables::at(level), TABLES).unwrap_or_else(|e| panic!("{e}"));
        edges(&mut PoleTables::at(level), TABLES).unwrap_or_else(|e| panic!("{e}"));
    }
    // Two joint recordings on even clocks; with noise, costs near the optimum are theirs too.
    let records = mixed_records();
    let noisy = |n: usize, y: &mut f64| *y += 0.02 * ((n * 7919 % 997) as f64 / 997.0 - 0.5);
    let voltage_only = |record: &Record| {
        changed(record, |s| {
            s.torque = None;
            [&mut s.current, &mut s.speed].into_iter().flatten().for_each(|signal| {
                signal.iter_mut().enumerate().for_each(|(n, y)| noisy(n, y));
            });
        })
    };
    let even = [voltage_only(&records[0]), voltage_only(&records[1])];
    for discretization in [Discretization::Zoh, Discretization::Foh] {
        for initial in [Initial::Zero, Initial::Measured] {
            let problem = problem(&even, Model { discretization, initial }, Criterion::default());
            assert!(PoleTables::serves(&problem), "{discretization:?} {initial:?}");
            for values in [uniform(9001, 12), near(301, 0.3, 13), near(301, 1e-3, 14), near(301, 1e-5, 15)] {
                check_within(&mut PoleTables::default(), &problem, &values, 2e-9).unwrap_or_else(|e| panic!("{e}"));
            }
        }
    }
    let unserved = problem(&records, Model::default(), Criterion::default());
    assert!(!PoleTables::serves(&unserved), "a torque and an irregular clock");
}

#[test]
fn costs_of_tables_depend_on_the_candidate_alone() {
    let new = || {
        PoleTables::clear();
        problem(&[m2_record()], Model::default(), Criterion::default())
    };
    let values = uniform(20_000, 21);
    let together = costs(&mut PoleTables::default(), &new(), &values);
    // The tables serve them: their rounding differs from the kernel's.
    let simulated = costs(&mut Simd::default(), &new(), &values);
    let served = together.iter().zip(&simulated).filter(|(a, b)| a.to_bits() != b.to_bits()).count();
    assert!(served > 18_000, "{served} of 20000 served");
    // New tables on several threads, of two callers at once.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    let shared = new();
    let run = || costs(&mut PoleTables::default(), &shared, &values);
    let (one, two) = pool.install(|| rayon::join(run, run));
    assert!(one == together && two == together);
    // New tables, in another order, alone.
    let other = new();
    for (n, candidate) in values.chunks(5).enumerate().rev().step_by(397) {
        assert_eq!(costs(&mut PoleTables::default(), &other, candidate)[0].to_bits(), together[n].to_bits());
    }
    // In a batch with groups of the same problem and of another one, some of them with cutoffs that no cost reaches.
    let unserved = problem(&[m2_record()], Model::default(), Criterion { norm: Norm::Iae, ..Criterion::default() });
    let cutoffs = vec![f64::INFINITY; 3000];
    let group = |problem, from: usize, to: usize| {
        let candidates = Candidates::new(&values[5 * from..5 * to], 5);
        let candidates = if to - from == 3000 { candidates.with_cutoffs(&cutoffs) } else { candidates };
        Group { problem, candidates, reference: None }
    };
    let (shared, others) = (new(), costs(&mut Simd::default(), &unserved, &values[..500]));
    let groups = [
        group(&shared, 0, 100),
        group(&unserved, 0, 50),
        group(&shared, 100, 3100),
        group(&shared, 3100, 3100),
        group(&unserved, 50, 100),
        group(&shared, 3100, 3101),
    ];
    let found = batch(&mut PoleTables::default(), &groups).unwrap();
    let expected = [&together[..100], &others[..50], &together[100..3100], &others[50..100], &together[3100..3101]];
    assert!(found == expected.concat());
}

#[test]
fn cutoffs_of_tables_lose_no_candidate() {
    let problem = problem(&[m2_record()], Model::default(), Criterion::default());
    let mut values = [uniform(100, 31), near(100, 1e-3, 32), near(100, 1e-6, 33)].concat();
    // Some that no table serves, and M2 itself, whose cost is zero up to rounding.
    values.extend([f64::NAN, 1.0, 1.0, 1.0, 1.0]);
    values.extend([1.0, 1e-3, 0.05, -1.0, 1e-4]);
    values.extend([1.0, 1e-12, 0.05, 1e-4, 1e-4]);
    values.extend(Parameters::M2.to_array());
    let exact = costs(&mut Scalar, &problem, &values);
    let zero = zero_output(&problem);
    for factor in [0.0, 0.5, 0.999, 1.001, 2.0, f64::INFINITY] {
        let cutoffs: Vec<f64> = exact.iter().map(|cost| (factor * cost).min(1e29)).collect();
        let candidates = Candidates::new(&values, 5).with_cutoffs(&cutoffs);
        let group = Group { problem: &problem, candidates, reference: None };
        let found = batch(&mut PoleTables::default(), &[group]).unwrap();
        for ((found, exact), cutoff) in found.iter().zip(&exact).zip(&cutoffs) {
            let bound = TABLES * exact + 1e-14 * zero;
            let is_same = found.to_bits() == exact.to_bits() || (found - exact).abs() <= bound;
            assert!(is_same || cutoff <= found && *found <= exact + bound, "{found} for {exact}, cutoff {cutoff}");
        }
    }
}

/// Evaluator whose costs are changed by a function of row and cost; the suite must reject it.
struct Corrupted(fn(usize, f64) -> f64);

impl Evaluator for Corrupted {
    fn evaluate(&mut self, batch: &Batch<'_>, costs: &mut [f64]) -> Result<()> {
        Simd::default().evaluate(batch, costs)?;
        costs.iter_mut().enumerate().for_each(|(row, cost)| *cost = (self.0)(row, *cost));
        Ok(())
    }

    fn name(&self) -> String {
        "corrupted".to_owned()
    }
}

#[test]
fn a_corrupted_evaluator_fails() {
    suite(&mut Corrupted(|_, cost| cost)).unwrap();
    let wrong: [fn(usize, f64) -> f64; 4] = [
        |_, cost| cost * (1.0 + 1e-11),
        |row, cost| if row == 60 { cost * 1.001 } else { cost },
        |_, cost| f64::from(cost as f32),
        |row, cost| if row == 7 { f64::NAN } else { cost },
    ];
    for (n, corruption) in wrong.into_iter().enumerate() {
        assert!(suite(&mut Corrupted(corruption)).is_err(), "corruption {n} went unnoticed");
    }
}

#[test]
fn criteria_are_their_formulas() {
    // The formulas are applied to simulated signals of one candidate; time starts at 0.
    let record = m2_record();
    let candidate = near(1, 0.2, 3);
    let p = Parameters::from_array([candidate[0], candidate[1], candidate[2], candidate[3], candidate[4]]);
    let model = motorfit::motor::simulate(&p, &motorfit::experiment::drive(&record), [0.0; 2], Discretization::Zoh);
    let measured = record.measured().map(Option::unwrap);
    let errors = |s: [f64; 2]| -> Vec<[f64; 2]> {
        (0..3001).map(|n| [(measured[0][n] - model[0][n]) / s[0], (measured[1][n] - model[1][n]) / s[1]]).collect()
    };
    let std = |y: &[f64]| {
        let mean = y.iter().sum::<f64>() / 3001.0;
        (y.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 3001.0).sqrt()
    };
    let peak = |y: &[f64]| y.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    for scale in SCALES {
        let s = match scale {
            Scale::None => [1.0, 1.0],
            Scale::Peak => measured.map(peak),
            Scale::Std => measured.map(std),
            _ => [0.012, 1.04],
        };
        let e = errors(s);
        let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
            e.iter().enumerate().map(|(n, e)| f(n as f64 * 0.001, e[0]) + f(n as f64 * 0.001, e[1])).sum()
        };
        let squares = sum(&|_, e| e * e);
        for (norm, expected) in [
            (Norm::Euclidean, squares.sqrt()),
            (Norm::Ise, 0.001 * squares),
            (Norm::Iae, 0.001 * sum(&|_, e| e.abs())),
            (Norm::Itse, 0.001 * sum(&|t, e| t * e * e)),
            (Norm::Itae, 0.001 * sum(&|t, e| t * e.abs())),
            (Norm::Mse, squares / 3001.0),
            (Norm::Nrmse, (squares / 3001.0).sqrt()),
        ] {
            let problem = problem(std::slice::from_ref(&record), Model::default(), criterion(norm, scale));
            let cost = costs(&mut Scalar, &problem, &candidate)[0];
            // Only the order of summation differs.
            assert!((cost / expected - 1.0).abs() < 1e-12, "{norm:?} {scale:?}: {cost} against {expected}");
        }
    }
    let origin = Criterion { time_origin_s: Some(1.0), ..criterion(Norm::Itae, Scale::None) };
    let problem = problem(std::slice::from_ref(&record), Model::default(), origin);
    let expected: f64 = errors([1.0; 2])
        .iter()
        .enumerate()
        .map(|(n, e)| 0.001 * (n as f64 * 0.001 - 1.0).max(0.0) * (e[0].abs() + e[1].abs()))
        .sum();
    assert!((costs(&mut Simd::default(), &problem, &candidate)[0] / expected - 1.0).abs() < 1e-12);
}

#[test]
fn many_runs_on_many_recordings_in_one_batch() {
    let records = mixed_records();
    let problems: Vec<Arc<Problem>> =
        records.iter().map(|r| problem(std::slice::from_ref(r), Model::default(), Criterion::default())).collect();
    let counts = [1, 17, 100];
    let values: Vec<Vec<f64>> = counts.iter().map(|&count| uniform(count, count as u64)).collect();
    let groups: Vec<Group<'_>> = (problems.iter().zip(&values))
        .map(|(problem, values)| Group { problem, candidates: Candidates::new(values, 5), reference: None })
        .collect();
    for level in Level::available() {
        let together = batch(&mut Simd::at(level), &groups).unwrap();
        let alone: Vec<f64> =
            problems.iter().zip(&values).flat_map(|(p, v)| costs(&mut Simd::at(level), p, v)).collect();
        assert_eq!(together, alone, "a cost depends on what else is in the batch");
        // A cost does not depend on the index in the batch or on the number of threads either.
        let single = costs(&mut Simd::at(level), &problems[2], &values[2][5 * 99..]);
        assert_eq!(single[0].to_bits(), alone[117].to_bits());
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        assert_eq!(pool.install(|| batch(&mut Simd::at(level), &groups).unwrap()), together);
    }
    assert!(batch(&mut Simd::default(), &[]).unwrap().is_empty());
    let none = Group { problem: &problems[0], candidates: Candidates::new(&[], 5), reference: None };
    assert!(batch(&mut Simd::default(), &[none]).unwrap().is_empty());
    let narrow = Group { problem: &problems[0], candidates: Candidates::new(&[1.0; 4], 4), reference: None };
    assert!(batch(&mut Simd::default(), &[narrow]).is_err());
}

#[test]
fn a_long_recording() {
    let time: Vec<f64> = (0..200_001_u32).map(|n| f64::from(n) * 1e-3).collect();
    let voltage = (0..200_001_u32).map(|n| if (n / 5000) % 2 == 1 { 9.0 } else { 2.0 }).collect();
    let problem = problem(&[driven(time, voltage, None)], Model::default(), Criterion::default());
    let zero = zero_output(&problem);
    for level in Level::available() {
        for values in [uniform(9, 1), near(9, 0.5, 1), near(9, 1e-4, 1)] {
            let (ours, oracle) =
                (costs(&mut Simd::at(level), &problem, &values), costs(&mut Scalar, &problem, &values));
            for (ours, oracle) in ours.into_iter().zip(oracle) {
                // The steady state dominates here, not the transient as in the M2 recording. Rounding of Φ = I + D changes it
                // by ε/(h·pole), some 1e-14 for this motor: hence ten times the second term of the general bound.
                let bound = 1e-12 * oracle + 1e-13 * zero;
                assert!((ours - oracle).abs() <= bound, "{ours:e} against {oracle:e} at {}", level.name());
            }
        }
    }
}

/// Returns recordings on irregular clocks: three distinct steps; some 600, with torque; steps of 0.6 to 9.5 periods.
fn irregular_records() -> Vec<Record> {
    let clock = |count: u32, step: fn(u32) -> f64| {
        let mut now = 0.0;
        let next = |n: u32| {
            now += 1e-3 * step(n);
            now
        };
        (0..count).map(next).collect::<Vec<f64>>()
    };
    let switched =
        |count: u32| (0..count).map(|n| if (n / 41 * 7919) % 3 == 0 { 8.0 } else { -3.0 }).collect::<Vec<_>>();
    let torque = (0..1500_u32).map(|n| if n > 400 { 0.02 } else { 0.0 }).collect();
    vec![
        driven(clock(900, |n| 1.0 + 0.1 * f64::from(n * 7 % 3)), switched(900), None),
        driven(clock(1500, |n| 0.7 + 0.001 * f64::from(n * 7919 % 601)), switched(1500), Some(torque)),
        driven(
            clock(700, |n| if n % 50 == 7 { 9.5 } else { 0.6 + 0.01 * f64::from(n * 31 % 80) }),
            switched(700),
            None,
        ),
    ]
}

#[test]
fn irregular_clocks_at_every_level() {
    let records = irregular_records();
    let steps: Vec<usize> = records.iter().map(|record| record.steps().step_s.len()).collect();
    assert_eq!(steps, [3, 597, 81]);
    for discretization in [Discretization::Zoh, Discretization::Foh, Discretization::Rk4, Discretization::Euler] {
        let model = Model { discretization, initial: Initial::Measured };
        for (record, level) in records.iter().flat_map(|record| Level::available().map(move |level| (record, level))) {
            let problem = problem(std::slice::from_ref(record), model, Criterion::default());
            for values in [uniform(61, 4), near(25, 0.3, 5), near(25, 1e-3, 5)] {
                check(&mut Simd::at(level), &problem, &values).unwrap_or_else(|e| panic!("{discretization:?}: {e}"));
            }
            let poisoned = [f64::NAN, 0.0, f64::INFINITY].map(|poison| [poison, 0.01, 0.05, 1e-4, 1e-4]).concat();
            let costs = costs(&mut Simd::at(level), &problem, &[poisoned, Parameters::M2.to_array().to_vec()].concat());
            assert!(costs[0].is_infinite() && costs[2].is_infinite() && costs[3] < 1.0, "{costs:?}");
        }
    }
}

#[test]
fn a_candidate_that_is_no_number_has_no_cost_on_a_recording_at_rest() {
    let still = changed(&irregular_records()[1], |s| s.voltage.fill(0.0));
    for record in [still.clone(), changed(&still, |s| s.torque = None)] {
        let model = Model { initial: Initial::Zero, ..Model::default() };
        let problem = problem(&[record], model, criterion(Norm::Euclidean, Scale::None));
        for level in Level::available() {
            let candidates = [Parameters::M2.to_array(), [1.0, f64::NAN, 1.0, 1.0, 1.0]].concat();
            let costs = costs(&mut Simd::at(level), &problem, &candidates);
            assert!(costs[0].is_finite() && costs[1].is_infinite(), "{costs:?}");
        }
    }
}

#[test]
fn edges_at_every_level() {
    for level in Level::available() {
        edges(&mut Simd::at(level), 1e-12).unwrap_or_else(|e| panic!("{}: {e}", level.name()));
    }
    edges(&mut Scalar, 0.0).unwrap();
    let truth = |channel: usize| {
        let record = changed(&m2_record(), |s| if channel == 0 { s.current = None } else { s.speed = None });
        let problem = problem(&[record], Model::default(), criterion(Norm::Euclidean, Scale::None));
        costs(&mut Simd::default(), &problem, &Parameters::M2.to_array())[0]
    };
    assert!(truth(0) < 1e-10 && truth(1) < 1e-10, "the other channel alone fits");
    let rest = problem(&[m2_record()], Model::default(), Criterion::default());
    assert_eq!(rest.active(), 2001, "1000 samples before the step find the motor at rest");
}
