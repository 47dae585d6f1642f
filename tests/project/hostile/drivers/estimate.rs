//! Calls of `estimate` with unusual recordings that identify the motor.

use crate::hostile::arguments::step;
use crate::hostile::calls::{Calls, ask, drive};
use motorfit::device::BatchSearchEvaluator;
use motorfit::estimate::{
    Block, Fitted, Point, descend, fit_problem, global_reference, initial_states, refine_coarse, refine_on,
    residual_squares, robust_uncertainty, steiglitz_mcbride, steiglitz_mcbride_on,
};
use motorfit::evaluate::{Model, Simd};
use motorfit::experiment::with_noise;
use motorfit::motor::{Axis, Parameter, Parameters, Scope, Space};
use motorfit::optimize::Evaluate as _;
use motorfit::record::{Record, Samples};
use std::sync::Arc;

/// Returns recordings of a step with noise: scaled, shifted, reversed, irregularly sampled, without a channel.
fn identifiable() -> Vec<Record> {
    let plain = with_noise(&step(150), [0.01, 0.1], 1).unwrap();
    let scaled = |signal: &Option<Vec<f64>>, by: f64| signal.as_ref().map(|s| s.iter().map(|v| by * v).collect());
    let mut all = vec![plain.clone()];
    let mut with = |change: &dyn Fn(&mut Samples)| {
        let mut samples = plain.samples().clone();
        change(&mut samples);
        all.extend(Record::new(samples));
    };
    for by in [1e-9, 1e-3, 1e3, 1e9, -1.0] {
        with(&|s| s.current = scaled(&s.current, by));
        with(&|s| s.speed = scaled(&s.speed, by));
        with(&|s| s.voltage.iter_mut().for_each(|v| *v *= by));
        with(&|s| s.time_s.iter_mut().for_each(|t| *t *= by.abs()));
    }
    with(&|s| s.time_s.iter_mut().for_each(|t| *t += 1e6));
    with(&|s| s.time_s.iter_mut().for_each(|t| *t += 2e-4 * (700.0 * *t).sin()));
    with(&|s| s.current = None);
    with(&|s| s.speed = None);
    with(&|s| s.torque = Some(vec![0.01; s.time_s.len()]));
    with(&|s| s.speed.iter_mut().flatten().for_each(|w| *w = w.round()));
    with(&|s| s.current.iter_mut().flatten().for_each(|i| *i = i.min(2.0)));
    assert!(all.len() > 20, "{} are accepted", all.len());
    all
}

pub fn identifiable_recordings(calls: &mut Calls) {
    let wide = |p: Parameter| Axis { parameter: p, scope: Scope::Shared, min: 1e-12, max: 1e12 };
    let space = Space::new(Parameter::ALL.map(wide).to_vec(), Vec::new()).unwrap();
    let (mut estimated, mut refined_all, mut referred) = (0, 0, 0);
    for (n, record) in identifiable().iter().enumerate() {
        let one = std::slice::from_ref(record);
        let estimate = calls.ask("estimate::steiglitz_mcbride", record, || steiglitz_mcbride(record, Model::default()));
        let Some(problem) = calls.ask("estimate::fit_problem", record, || fit_problem(one, &space, Model::default()))
        else {
            continue;
        };
        of_fitted(calls, &problem, &Parameters::M2.to_array());
        ask!(calls, record; "estimate::steiglitz_mcbride_on" => steiglitz_mcbride_on(&problem, 0));
        let estimate = estimate.and_then(Result::ok).map(|estimate| estimate.parameters.to_array());
        estimated += usize::from(estimate.is_some());
        let usual = Parameters::M2.to_array();
        for start in [estimate.unwrap_or(usual), usual, usual.map(|v| 30.0 * v), [1e-12; 5], [1e12; 5]] {
            for sigma in [[0.01, 0.1], [1e-12; 2], [1e12, 1e-12]] {
                let with = (record, start, sigma);
                ask!(calls, with;
                    "estimate::residual_squares" => residual_squares(&problem, &start),
                    "estimate::initial_states" => initial_states(&problem, &start, sigma),
                    "estimate::refine_coarse" => refine_coarse(&problem, &start, &[sigma.to_vec()]),
                );
                let local = BatchSearchEvaluator::new(Box::new(Simd::default()), vec![Arc::new(problem.clone())]);
                for evaluations in [0, 5, 6, 100, u64::MAX] {
                    drive!(calls, (&with, evaluations); "optimize::LocalSearch::descend" =>
                        local.local_search().map(|local| local.descend(0, &start, evaluations)));
                    drive!(calls, &with; "estimate::descend" => descend(&problem, &start[1..], evaluations));
                    drive!(calls, (&with, evaluations); "estimate::descend" => descend(&problem, &start, evaluations));
                }
                let refined =
                    calls.ask("estimate::refine_on", &with, || refine_on(&problem, &start, Some(&[sigma.to_vec()])));
                let Some(refined) = refined else { continue };
                refined_all += 1;
                drive!(calls, with; "estimate::robust_uncertainty" => robust_uncertainty(&problem, &refined));
                assert!(refined.values.iter().all(|v| v.is_finite()), "{with:?}");
            }
        }
        if n % 6 == 0 {
            let found =
                calls.ask("estimate::global_reference", record, || global_reference(&problem, &[vec![0.01, 0.1]]));
            referred += usize::from(found.is_some());
        }
    }
    // Most calls reach the end of the estimators instead of an early return.
    assert!(estimated > 10 && refined_all > 150 && referred > 2, "{estimated} {refined_all} {referred}");
}

/// Drives the interface of a problem that is fitted.
pub fn of_fitted(calls: &mut Calls, problem: &dyn Fitted, values: &[f64]) {
    let initial: Vec<Vec<f64>> = (0..problem.recordings()).map(|n| problem.initial(n)).collect();
    let points =
        [Point { values: values.to_vec(), initial: initial.clone() }, Point { values: values.to_vec(), initial }];
    let axes = problem.axes().len();
    drive!(calls, values;
        "estimate::Fitted::axes" => problem.axes(),
        "estimate::Fitted::acts" => (0..axes).map(|axis| problem.acts(axis, usize::MAX)).collect::<Vec<_>>(),
        "estimate::Fitted::has_kinks" => problem.has_kinks(),
        "estimate::Fitted::side_by_side" => problem.side_by_side(),
        "estimate::Fitted::recordings" => problem.recordings(),
        "estimate::Fitted::outputs" => problem.outputs(),
        "estimate::Block::none" => Block::none(0),
        "estimate::Block::is_finite" => Block { squares: f64::NAN, ..Block::none(3) }.is_finite(),
    );
    for recording in 0..problem.recordings() {
        let (initial, filters) = (problem.initial(recording), vec![vec![0.5]; problem.outputs()]);
        drive!(calls, (values, recording);
            "estimate::Fitted::samples" => problem.samples(recording),
            "estimate::Fitted::effective_sample_ratio" => problem.effective_sample_ratio(recording),
            "estimate::Fitted::initial" => problem.initial(recording),
            "estimate::Fitted::states" => problem.states(recording),
            "estimate::Fitted::blocks" => problem.blocks(&points, recording).len() + problem.blocks(&[], recording).len(),
            "estimate::Fitted::residuals" => problem.residuals(values, recording, &initial),
            "estimate::Fitted::all_residuals" => problem.all_residuals(values, recording, &initial),
            "estimate::Fitted::shaped" => problem.shaped(values, recording, &initial, &filters),
        );
        for of in (0..problem.outputs()).map(|output| (recording, output)) {
            drive!(calls, (values, of);
                "estimate::Fitted::has" => problem.has(of),
                "estimate::Fitted::count" => problem.count(of),
                "estimate::Fitted::measured" => problem.measured(of),
                "estimate::Fitted::rms" => problem.rms(of),
                "estimate::Fitted::noise" => problem.noise(of),
                "estimate::Fitted::deviation" => problem.deviation(of),
                "estimate::Fitted::noise_share" => [f64::NAN, 0.0, 1.0, f64::MAX].map(|sigma| problem.noise_share(of, sigma)),
                "estimate::Fitted::is_above_noise" => [f64::NAN, 0.0, 1.0].map(|sigma| problem.is_above_noise(of, sigma)),
            );
        }
    }
}
