//! Proves: for hostile arguments public functions of the library return an error that names the value, clamp it if that is its
//! only meaning, or return values that are not finite; none panics without documentation, and none accepts them silently.
//! Every public function is called with hostile arguments, or is on a list with the reason why not (`covered`).
//! Does not prove: the same for arguments that are not listed.
#![allow(clippy::unwrap_used, reason = "a test may stop")]
#![allow(clippy::float_cmp, reason = "exact equality is meant")]

mod arguments;
mod calls;
mod covered;
mod csv;
mod drivers;
mod list;

use crate::support::{costs, m2_record, near, problem};
use motorfit::Error;
use motorfit::candidates::Candidates;
use motorfit::criterion::{Criterion, Noise};
use motorfit::device::BatchSearchEvaluator;
use motorfit::estimate::{fit_problem, global_reference, residual_squares};
use motorfit::evaluate::{Evaluator, Model, Problem, Scalar, Simd};
use motorfit::identify::{IdentifySpec, identify, validate};
use motorfit::motor::{Axis, Discretization, Parameter, Parameters, Scope, SimulationInput, Space, simulate};
use motorfit::optimize::{Evaluate as _, Sample, Sampling};
use motorfit::record::{FilterKind, Lines, LowPass, Preparation, Record};
use motorfit::study::sweep::{Shard, Sweep};
use motorfit::text::{decimals, engineering, significant};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

/// Asserts that a result is an error with a remedy, whose message contains `part`.
fn refused<T>(result: motorfit::Result<T>, part: &str) -> Error {
    let Err(error) = result else { panic!("accepted, but should say {part}") };
    assert!(error.to_string().contains(part), "{error}");
    assert!(!error.hint().is_empty(), "{error} has no hint");
    error
}

/// Returns a folder with a recording, and a function that plans a study of it with further keys in a new folder.
fn planner() -> (tempfile::TempDir, impl Fn(&str, &str) -> motorfit::Result<(Sweep, bool)>) {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().to_path_buf();
    std::fs::write(root.join("a.csv"), motorfit::record::write_csv(&m2_record())).unwrap();
    let plan = move |more: &str, name: &str| {
        let study = root.join(format!("{name}.toml"));
        let text = format!("recordings = [\"a.csv\"]\nmethods = [\"sm\"]\ndevice = \"cpu\"\n{more}");
        std::fs::write(&study, text).unwrap();
        Sweep::plan(&study, &root.join(name), None)
    };
    (folder, plan)
}

#[test]
fn invalid_boxes_give_no_sample() {
    for bounds in [(f64::NAN, 1.0), (0.0, f64::NAN), (2.0, 1.0), (0.0, f64::INFINITY), (-f64::MAX, f64::MAX)] {
        for sampling in [Sampling::Uniform, Sampling::LatinHypercube, Sampling::Sobol, Sampling::Grid] {
            refused(Sample::new(sampling, 3, vec![(0.0, 1.0), bounds], 1), "of axis 1");
        }
    }
    // A box of zero width is valid.
    let mut values = [0.0; 4];
    Sample::new(Sampling::Uniform, 2, vec![(1.0, 1.0), (0.0, 0.0)], 1).unwrap().fill(0, &mut values);
    assert_eq!(values, [1.0, 0.0, 1.0, 0.0]);
    for sampling in [Sampling::Uniform, Sampling::LatinHypercube, Sampling::Sobol, Sampling::Grid] {
        for number in [u64::MAX, u64::MAX - 1, (1 << 53) + 1] {
            refused(Sample::new(sampling, number, vec![(0.0, 1.0)], 1), "empty or too large");
        }
    }
}

#[test]
fn wrong_numbers_of_values_are_rejected() {
    let record = m2_record();
    let plain = fit_problem(std::slice::from_ref(&record), &Space::table2(), Model::default()).unwrap();
    let motor = Parameters::M2.to_array();
    for count in 0..5 {
        refused(residual_squares(&plain, &motor[..count]), "expected 5, one for each free parameter");
    }
    refused(residual_squares(&plain, &[1.0; 6]), "found 6 values");
    assert!(residual_squares(&plain, &motor).unwrap()[0].iter().all(|sum| *sum < 1e-12));
    for wrong in [f64::NAN, 0.0, -1.0, f64::INFINITY] {
        refused(global_reference(&plain, &[vec![1.0, wrong]]), "found a \u{3c3} of");
    }
    refused(global_reference(&plain, &[]), "found 0 pairs of \u{3c3}");
    let found = identify(&[record], &IdentifySpec::default()).unwrap();
    refused(validate(&[], &IdentifySpec::default(), &found), "no held-out recording");
}

#[test]
fn parameters_of_missing_recordings_are_rejected() {
    let space = |n: u32| {
        let mut free = Space::table2().free().to_vec();
        free[0].scope = Scope::Recording(n);
        Space::new(free, Vec::new())
    };
    refused(space(u32::MAX), "recording 4294967295");
    let error =
        refused(Problem::new(&[m2_record()], Model::default(), space(1).unwrap(), Criterion::default()), "R[1]");
    assert!(error.to_string().contains("below 1"), "{error}");
    assert!(Problem::new(&[m2_record()], Model::default(), space(0).unwrap(), Criterion::default()).is_ok());
    let fixed = Space::new(
        vec![Axis { parameter: Parameter::R, scope: Scope::Shared, min: 0.1, max: 1.0 }],
        [Parameter::L, Parameter::K, Parameter::B, Parameter::J].map(|p| (p, Scope::Recording(7), 1.0)).to_vec(),
    );
    refused(Problem::new(&[m2_record()], Model::default(), fixed.unwrap(), Criterion::default()), "L[7]");
}

#[test]
fn a_drive_without_steps_gives_values_that_are_not_finite() {
    let nothing = SimulationInput { step_s: &[], step_index: &[], voltage: &[], voltage_end: &[], torque: &[] };
    assert_eq!(simulate(&Parameters::M2, &nothing, [1.0, 2.0], Discretization::Zoh), [const { Vec::<f64>::new() }; 2]);
    assert!(nothing.step(0).is_nan() && nothing.end(usize::MAX).is_nan());
    let no_steps = SimulationInput { voltage: &[1.0, 2.0, 3.0], ..nothing };
    let missing = SimulationInput { step_s: &[0.001], step_index: &[0, 9, 0], ..no_steps };
    for (drive, known) in [(no_steps, 1), (missing, 2)] {
        let [current, speed] = simulate(&Parameters::M2, &drive, [1.0, 2.0], Discretization::Zoh);
        assert_eq!(current.len(), 3);
        let finite = |signal: &[f64]| signal.iter().take_while(|value| value.is_finite()).count();
        assert_eq!((finite(&current), finite(&speed)), (known, known));
        assert!(current[known..].iter().all(|value| value.is_nan()));
    }
}

#[test]
fn numbers_have_as_many_digits_as_there_are() {
    for digits in [0, 1, 767, 65_535, 65_536, usize::MAX] {
        for value in [1.0 / 3.0, -1.0e-300, 1e300, 5e-324, 0.0, f64::NAN] {
            let text = significant(value, digits);
            assert!(text.len() < 800, "{} characters", text.len());
            let read: f64 = text.parse().unwrap();
            assert!(digits < 17 || read.to_bits() == value.to_bits() || value.is_nan(), "{value:e} became {text}");
            assert!(engineering(value, "V", digits).ends_with('V'));
        }
    }
    assert_eq!(significant(0.25, 0), "0.2");
    for value in [1.0 / 3.0, 5e-324, f64::MAX, f64::NAN] {
        let (most, all) = (decimals(value, 767), decimals(value, usize::MAX));
        assert!(most == all && most.len() < 800, "{} characters", all.len());
    }
    // The noise of a missing channel is zero.
    assert_eq!(Noise::Sigma([Some(1.0); 2]).sigma(2, &[0.0; 8]).to_bits(), 0);
}

#[test]
fn a_search_without_problems_evaluates_nothing() {
    refused(BatchSearchEvaluator::<Problem>::open(&IdentifySpec::default(), Vec::new()).map(drop), "nothing to search");
    let mut none = BatchSearchEvaluator::new(Box::new(Scalar), Vec::new());
    assert!(none.slice() >= 1);
    none.begin(&[]).unwrap();
    none.finish(&[], &mut []).unwrap();
    let one = [Candidates::new(&[1.0; 5], 5)];
    assert!(none.begin(&one).is_err(), "there is no problem to evaluate a candidate on");
}

#[test]
fn invalid_filters_and_rates_are_rejected() {
    let record = m2_record();
    let with = |kind, order, cutoff_hz| {
        let filter = Some(LowPass { kind, order, cutoff_hz });
        Preparation { filter, ..Preparation::default() }.apply(&record)
    };
    for cutoff_hz in [f64::NAN, 0.0, -1.0, f64::INFINITY] {
        refused(with(FilterKind::Butterworth, 4, cutoff_hz), "cut-off");
    }
    for order in [0, 13, usize::MAX] {
        refused(with(FilterKind::Butterworth, order, 50.0), "expected a whole number from 1 to 12");
    }
    for rate in [f64::NAN, 0.0, -1.0, 5e-324, 1e-300, 9e-7] {
        refused(Preparation { rate_hz: Some(rate), ..Preparation::default() }.apply(&record), "rate is");
    }
    for ripple_db in [f64::NAN, 0.0, -1.0, 7.0] {
        refused(with(FilterKind::Chebyshev { ripple_db }, 4, 50.0), "ripple");
    }
    assert!(with(FilterKind::Butterworth, 4, 50.0).is_ok());
    for every in [1501, usize::MAX / 2 + 2, usize::MAX] {
        let preparation = Preparation { decimate: Some(every), ..Preparation::default() };
        refused(preparation.apply(&record), "leaves too little of 3001");
    }
    assert!(Preparation { decimate: Some(2), ..Preparation::default() }.apply(&record).is_ok());
}

#[test]
fn lines_may_go_back_and_end_at_the_last_number() {
    let list = [5, 6, 2, 3, u64::MAX - 1, u64::MAX, u64::MAX, 0, 1];
    let mut lines = Lines::default();
    list.into_iter().for_each(|line| lines.push(line));
    assert_eq!((0..9).filter_map(|n| lines.get(n)).collect::<Vec<_>>(), list);
    assert_eq!((lines.get(9), lines.get(usize::MAX)), (None, None));
    assert_eq!(lines.of([8, 0, 5, 99].into_iter()).len(), 3);
    // Deserialized data may be inconsistent.
    let broken: Lines = serde_json::from_str(r#"{"stretches":[],"count":3}"#).unwrap();
    assert_eq!(broken.get(0), None);
}

#[test]
fn shards_are_counted_from_one() {
    let (folder, plan) = planner();
    let (sweep, _) = plan("", "out").unwrap();
    for (index, count) in [(0, 1), (0, 0), (2, 1), (1, 0), (u64::MAX, u64::MAX), (1, u64::MAX)] {
        let shard = Shard { index, count };
        let wrong = format!("found shard {index} of {count}");
        refused(sweep.run(shard, &mut |_| ControlFlow::Continue(())), &wrong);
        refused(sweep.take(shard, b"{}\n"), &wrong);
        assert!(sweep.finished(shard).unwrap().is_empty());
        let _ = sweep.recordings(shard);
    }
    for count in [0, u64::MAX] {
        refused(sweep.left(count), "found shard 1 of");
    }
    assert!(!Path::new(&folder.path().join("out/results-0-of-1.jsonl")).exists(), "nothing was written");
    assert_eq!(sweep.left(1).unwrap(), [1]);
}

#[test]
fn a_problem_is_that_of_its_recordings() {
    // A wrong index of a recording is a documented panic.
    let problem = problem(&[m2_record()], Model::default(), Criterion::default());
    let simulated = std::panic::catch_unwind(|| problem.simulate(&Parameters::M2.to_array(), 1, [0.0; 2]));
    assert!(simulated.is_err());
    let signals = &problem.signals()[0];
    assert!(!signals.has(2) && signals.measured(2).all(|value| value == 0.0));
    // Missing values of parameters are NaN.
    let [current, _] = problem.simulate(&[1.0], 0, [0.0; 2]);
    assert!(current[1].is_nan());
}

#[test]
fn sizes_have_limits() {
    for threads in [0, 1025, 1_000_000_000, usize::MAX] {
        let error = refused(motorfit::device::with_threads(Some(threads), || Ok(())), &format!("threads is {threads}"));
        assert!(error.hint().to_string().contains("1 to 1024"), "{}", error.hint());
        refused(motorfit::study::contenders(threads, false, false), "threads is");
    }
    assert_eq!(motorfit::device::with_threads(Some(2), || Ok(rayon::current_num_threads())).unwrap(), 2);
    // 1001 samples, 1 s.
    let record = Record::new(m2_record().samples().slice(1000..2001)).unwrap();
    let at = |rate: f64| Preparation { rate_hz: Some(rate), ..Preparation::default() }.apply(&record);
    let error = refused(at(1e7), "more than 100 samples of each");
    assert!(error.hint().to_string().contains("at most 100000 Hz"), "{}", error.hint());
    refused(at(1.01e5), "more than 100 samples of each");
    assert_eq!(at(1e5).unwrap()[0].len(), 100_001);
    refused(at(1e9), "more than 100000000 samples");
}

#[test]
fn a_window_may_be_longer_than_the_recording() {
    // Both evaluators follow the definition: a moving average over a million values is dominated by the state before the
    // recording. A unit test in `motor/sensor.rs` checks that the kernel stores only the existing past.
    let record = Record::new(m2_record().samples().slice(900..1901)).unwrap();
    let held = [(Parameter::CurrentAverage, 1e6), (Parameter::SpeedAverage, 1e6)];
    let fixed = held.map(|(parameter, value)| (parameter, Scope::Shared, value)).to_vec();
    let space = Space::new(Space::table2().free().to_vec(), fixed).unwrap();
    let problem = Arc::new(Problem::new(&[record], Model::default(), space, Criterion::default()).unwrap());
    let candidates = near(64, 0.3, 1);
    let [kernel, oracle] =
        [&mut Simd::default() as &mut dyn Evaluator, &mut Scalar].map(|e| costs(e, &problem, &candidates));
    for (kernel, oracle) in kernel.iter().zip(&oracle) {
        assert!((kernel / oracle - 1.0).abs() < 1e-9, "{kernel} {oracle}");
    }
    let linear = Arc::new(problem.with_space(Space::table2()));
    let [plain, seen] = [&linear, &problem].map(|of| of.simulate(&candidates[..5], 0, [0.0; 2])[1].clone());
    let mut sum = 0.0;
    for (plain, seen) in plain.iter().zip(seen) {
        sum += plain;
        assert!((seen - sum * 1e-6).abs() < 1e-9, "{seen} {sum}");
    }
}

#[test]
fn a_million_seeds_are_a_list() {
    // Comparing all pairs would take 5·10^11 comparisons, which is minutes.
    let (folder, plan) = planner();
    let list = |last: u64| (0..999_999).chain([last]).map(|n| n.to_string()).collect::<Vec<_>>().join(",");
    let (sweep, _) = plan(&format!("seeds = [{}]\n", list(999_999)), "good").unwrap();
    assert_eq!(sweep.manifest().runs, 1_000_000);
    refused(plan(&format!("seeds = [{}]\n", list(0)), "bad"), "seeds has a value twice");
    assert!(!folder.path().join("bad").exists());
}

#[cfg(unix)]
#[test]
fn results_are_read_from_regular_files_only() {
    let (folder, plan) = planner();
    let (sweep, _) = plan("", "out").unwrap();
    let path = folder.path().join("out/results-1-of-1.jsonl");
    // The pipe has no writer, so opening it for reading would block.
    assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
    let (sender, receiver) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        let run = sweep.run(Shard::ALL, &mut |_| ControlFlow::Continue(())).map(drop);
        let all = [run, sweep.merge().map(drop), sweep.status().map(drop), sweep.left(1).map(drop)];
        let of_other = sweep.run(Shard { index: 1, count: 2 }, &mut |_| ControlFlow::Continue(())).map(drop);
        sender.send(all.into_iter().chain([of_other]).collect::<Vec<_>>()).unwrap();
    });
    let results = receiver.recv_timeout(std::time::Duration::from_secs(60)).expect("the pipe was opened");
    for result in results {
        let error = refused(result, "is not a regular file, expected a results file");
        assert_eq!(error.path(), Some(path.as_path()));
    }
    std::fs::remove_file(&path).unwrap();
    std::fs::create_dir(&path).unwrap();
    let sweep = Sweep::open(&folder.path().join("out")).unwrap();
    refused(sweep.merge(), "is not a regular file");
}

#[test]
fn rows_beyond_a_sample_are_not_drawn() {
    // Beyond the last row the walk of the permutation would not terminate.
    for sampling in [Sampling::Uniform, Sampling::LatinHypercube, Sampling::Sobol, Sampling::Grid] {
        let sample = Sample::new(sampling, 100, vec![(0.0, 1.0)], 1).unwrap();
        for (first, rows) in [(100, 1), (99, 2), (u64::MAX - 1, 1), (u64::MAX, 2)] {
            let fill = || sample.fill(first, &mut vec![0.0; rows]);
            assert!(std::panic::catch_unwind(fill).is_err(), "{rows} rows from {first} on");
        }
        sample.fill(99, &mut [0.0]);
        sample.fill(100, &mut []);
    }
}

#[test]
fn inconsistent_limits_and_progress() {
    use motorfit::study::sweep::{Limits, SweepProgress};
    for (low, high) in [(f64::NAN, 1.0), (0.0, f64::NAN), (1.0, 1.0), (2.0, 1.0)] {
        refused(Limits::new(vec![("R".to_owned(), low, high)]), "is empty");
    }
    // Counts given by a caller may be inconsistent.
    let progress = SweepProgress { done: 1, total: 0, before: 2, failed: 0, under_way: 0.5, seconds: 1.0 };
    assert_eq!((progress.rate(), progress.remaining()), (Some(0.5), Some(0.0)));
}

#[test]
fn long_words_are_like_no_other() {
    let long = "a".repeat(65_536);
    assert_eq!(motorfit::text::nearest(&long, &[&long, "a"]), None);
    assert_eq!(motorfit::text::nearest("curent", &[&long, "current"]), Some("current"));
}

#[test]
fn a_space_has_a_limit_of_recordings() {
    let space = Space::table2();
    for recordings in [65_537, u32::MAX as usize + 2, usize::MAX] {
        refused(space.per_recording(&[Parameter::R], recordings), "expected 65536 at most");
    }
    let many = space.per_recording(&[Parameter::R], 65_536).unwrap();
    // Comparing all pairs of scopes would take 2·10^9 comparisons.
    assert!(Space::new(many.free().to_vec(), Vec::new()).is_ok());
    let twice = [many.free(), &many.free()[..1]].concat();
    refused(Space::new(twice, Vec::new()), "R is given twice");
}
