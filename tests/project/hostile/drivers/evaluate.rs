//! Calls of `evaluate` and `device`: problems, evaluators and devices.

use crate::hostile::arguments::{COUNTS, FEW, NUMBERS, WIDE, records, signals, step, texts};
use crate::hostile::calls::{Calls, ask, drive};
use motorfit::candidates::Candidates;
use motorfit::criterion::{Criterion, Noise, Norm, Scale};
use motorfit::device::{
    BatchSearchEvaluator, DeviceSettings, DeviceSpec, EvaluatorSpec, OnLoss, PrecisionSpec, ThroughputCurve,
    ThroughputProfile, Work, check_threads, with_threads,
};
use motorfit::evaluate::{
    Batch, Evaluator, Group, Initial, Level, Model, Pending, PoleTables, Problem, Scalar, Signals, Simd, cpu_name,
    fma_loop,
};
use motorfit::identify::IdentifySpec;
use motorfit::motor::{Axis, Discretization, Parameter, Scope, Space};
use motorfit::named::Named;
use motorfit::optimize::Evaluate;
use std::sync::Arc;

/// Returns spaces with every kind of extension.
pub fn spaces() -> Vec<Space> {
    let with = |p: Parameter, (min, max): (f64, f64)| {
        let mut free = Space::table2().free().to_vec();
        free.push(Axis { parameter: p, scope: Scope::Shared, min, max });
        Space::new(free, Vec::new())
    };
    let bounds = |p: Parameter| match p {
        Parameter::CurrentAverage | Parameter::SpeedAverage => (1.0, 1e12),
        Parameter::Load | Parameter::Offset | Parameter::DeadTime => (-1e300, 1e300),
        _ => (1e-300, 1e300),
    };
    let mut all = vec![Space::table2()];
    all.extend(Parameter::EXTENSIONS.into_iter().filter_map(|p| with(p, bounds(p)).ok()));
    assert_eq!(all.len(), 1 + Parameter::EXTENSIONS.len());
    all
}

pub fn problems(calls: &mut Calls) {
    let models: Vec<Model> = Discretization::ALL
        .into_iter()
        .flat_map(|discretization| Initial::ALL.map(|initial| Model { discretization, initial }))
        .collect();
    let criteria: Vec<Criterion> = Norm::ALL
        .into_iter()
        .zip(Scale::ALL.into_iter().cycle())
        .zip(FEW)
        .map(|((norm, scale), origin)| Criterion {
            norm,
            scale,
            time_origin_s: Some(origin),
            noise: Noise::Decibels(origin),
        })
        .chain([Criterion::default()])
        .collect();
    let spaces = spaces();
    for (n, record) in records().iter().enumerate() {
        for criterion in criteria.iter().skip(n % 4).step_by(4) {
            let model = models[n % models.len()];
            ask!(calls, (record, criterion);
                "evaluate::Signals::new" => Signals::new(record, criterion, model.initial, model.discretization));
            let records = [record.clone(), record.clone()];
            let space = spaces[n % spaces.len()].clone();
            let made = calls.ask("evaluate::Problem::new", &(criterion, record), || {
                Problem::new(&records[..1 + n % 2], model, space.clone(), *criterion)
            });
            if let Some(problem) = made {
                one_problem(calls, problem, &spaces[(n + 1) % spaces.len()]);
            }
        }
    }
    ask!(calls, "none"; "evaluate::Problem::new" => Problem::new(&[], Model::default(), Space::table2(), Criterion::default()));
    for word in texts() {
        ask!(calls, word; "evaluate::Initial::named" => <Initial as Named>::named("initial", &word));
    }
    drive!(calls, (); "evaluate::Initial::name" => Initial::ALL.map(Initial::name));
}

/// Returns candidates of `width` parameters with extreme values.
fn candidates(width: usize) -> Vec<f64> {
    let mut values: Vec<f64> = NUMBERS.iter().flat_map(|v| vec![*v; width]).collect();
    values.extend(NUMBERS.iter().cycle().take(width * NUMBERS.len()));
    values
}

fn one_problem(calls: &mut Calls, problem: Problem, other: &Space) {
    let recordings = problem.signals().len();
    let width = problem.space().free().len();
    let shown = format!("{:?} {:?} {:?}", problem.space().free().last(), problem.model(), problem.criterion());
    drive!(calls, shown;
        "evaluate::Problem::active" => problem.active(),
        "evaluate::Problem::criterion" => problem.criterion(),
        "evaluate::Problem::features" => problem.features(),
        "evaluate::Problem::first_active" => problem.first_active(&problem.signals()[0]),
        "evaluate::Problem::has_weight" => problem.has_weight(),
        "evaluate::Problem::input" => problem.input(),
        "evaluate::Problem::method" => problem.method(),
        "evaluate::Problem::model" => problem.model(),
        "evaluate::Problem::settings" => problem.settings(&problem.signals()[0]),
        "evaluate::Problem::signals" => problem.signals().len(),
        "evaluate::Problem::space" => problem.space(),
        "evaluate::Problem::only" => problem.only(recordings - 1),
        "evaluate::Problem::with_space" => problem.with_space(other.clone()),
        "evaluate::Problem::starting_from" => problem.only(0).starting_from(&[[f64::NAN; 2]]).starting_from(&[[0.0; 0]]),
        "evaluate::Simd::is_small" => COUNTS.map(|candidates| Simd::is_small(&problem, candidates)),
        "evaluate::PoleTables::serves" => PoleTables::serves(&problem),
        "evaluate::PoleTables::clear" => PoleTables::clear(),
    );
    for recording in COUNTS {
        calls.may_panic("evaluate::Problem::only", || problem.only(recording));
        calls.may_panic("evaluate::Problem::walk", || problem.walk(&[], recording, [0.0; 2], |_| ()));
        calls.may_panic("evaluate::Problem::simulate", || problem.simulate(&[1.0; 9], recording, [f64::NAN; 2]));
        drive!(calls, recording;
            "evaluate::Problem::parameters" => problem.parameters(&[f64::NAN], recording),
            "evaluate::Problem::motor" => problem.motor(&[], recording),
        );
    }
    for signals in problem.signals() {
        drive!(calls, shown;
            "evaluate::Signals::len" => signals.len(),
            "evaluate::Signals::is_empty" => signals.is_empty(),
            "evaluate::Signals::starts_at_rest" => signals.starts_at_rest(),
            "evaluate::Signals::is_driven" => signals.is_driven(),
            "evaluate::Signals::drive" => signals.drive().voltage.len(),
            "evaluate::Signals::has" => COUNTS.map(|channel| signals.has(channel)),
            "evaluate::Signals::measured" => COUNTS.map(|channel| signals.measured(channel).count()),
            "evaluate::Signals::counts" => COUNTS.map(|n| COUNTS.map(|m| signals.counts(n, m))),
            "evaluate::Signals::count" => COUNTS.map(|channel| signals.count(channel)),
        );
    }
    let problem = Arc::new(problem);
    let values = candidates(width);
    for row in values.chunks(width) {
        drive!(calls, (&shown, row);
            "evaluate::Scalar::cost" => Scalar::cost(&problem, row),
            "evaluate::Problem::simulate" => problem.simulate(row, 0, [0.0; 2]),
            "evaluate::Problem::walk" => problem.walk(row, 0, [f64::INFINITY, 0.0], |_| ()),
        );
    }
    drive!(calls, &shown; "evaluate::Scalar::cost" => (Scalar::cost(&problem, &[]), Scalar::cost(&problem, &[1.0; 99])));
    let evaluators: [Box<dyn Evaluator>; 4] =
        [Box::new(Scalar), Box::new(Simd::default()), Box::new(Simd::alone()), Box::new(PoleTables::default())];
    for mut evaluator in evaluators {
        evaluated(calls, &mut *evaluator, &problem, &values);
    }
}

fn evaluated(calls: &mut Calls, evaluator: &mut dyn Evaluator, problem: &Arc<Problem>, values: &[f64]) {
    let width = problem.space().free().len();
    let name = evaluator.name();
    let (none, wrong) = (Candidates::new(&[], width), Candidates::new(&[1.0], 1));
    let of = |candidates, reference| Group { problem, candidates, reference };
    let groups = [
        vec![],
        vec![of(none, None)],
        vec![of(wrong, None)],
        vec![of(Candidates::new(values, width), None), of(none, None), of(Candidates::new(values, width), None)],
        vec![of(Candidates::new(values, width), Some(&[f64::NAN]))],
    ];
    for groups in &groups {
        let batch = Batch { groups };
        drive!(calls, name; "evaluate::Batch::count" => batch.count());
        for size in [0, 1, batch.count(), batch.count() + 1] {
            let mut costs = vec![7.0; size];
            ask!(calls, (&name, size);
                "evaluate::Batch::check" => batch.check(&costs),
                "evaluate::Evaluator::evaluate" => evaluator.evaluate(&batch, &mut costs),
                "evaluate::Evaluator::evaluate_timed" => evaluator.evaluate_timed(&batch, &mut costs),
                "evaluate::Evaluator::begin" => evaluator.begin(&batch),
                "evaluate::Evaluator::finish" => evaluator.finish(&batch, Pending::default(), &mut costs),
                "evaluate::Evaluator::finish" => evaluator.finish(&batch, Pending::of("another's"), &mut costs),
            );
            if size == batch.count() && groups.len() == 3 {
                assert!(costs.iter().all(|cost| !cost.is_nan()), "{name} gives costs that are no numbers");
            }
        }
    }
    drive!(calls, name;
        "evaluate::Evaluator::overlaps" => evaluator.overlaps(),
        "evaluate::Evaluator::is_exact" => evaluator.is_exact(),
        "evaluate::Evaluator::name" => evaluator.name(),
        "evaluate::Pending::of" => Pending::of(1_u8),
        "evaluate::Pending::take" => (Pending::of(1_u8).take::<String>(), Pending::default().take::<u8>()),
    );
}

pub fn levels(calls: &mut Calls) {
    for level in Level::available() {
        drive!(calls, level;
            "evaluate::Level::name" => level.name(),
            "evaluate::Level::is_available" => level.is_available(),
            "evaluate::Simd::at" => Simd::at(level),
            "evaluate::PoleTables::at" => PoleTables::at(level),
        );
    }
    drive!(calls, ();
        "evaluate::Level::available" => Level::available().count(),
        "evaluate::Level::best" => Level::best(),
        "evaluate::Simd::at" => [Level::Portable, Level::Avx2, Level::Avx512].map(Simd::at),
        "evaluate::Simd::alone" => Simd::alone(),
        "evaluate::cpu_name" => cpu_name(),
        // The run time is proportional to the rounds, so larger counts are left out.
        "evaluate::fma_loop" => [0, 1, 1000].map(|rounds| fma_loop(Level::best(), rounds)),
        "evaluate::fma_loop" => [Level::Portable, Level::Avx2, Level::Avx512].map(|level| fma_loop(level, 1)),
    );
}

pub fn devices(calls: &mut Calls) {
    for word in texts() {
        ask!(calls, word;
            "device::DeviceSpec::from_str" => word.parse::<DeviceSpec>(),
            "device::EvaluatorSpec::named" => <EvaluatorSpec as Named>::named("evaluator", &word),
            "device::PrecisionSpec::named" => <PrecisionSpec as Named>::named("precision", &word),
        );
    }
    drive!(calls, ();
        "device::EvaluatorSpec::name" => EvaluatorSpec::ALL.map(EvaluatorSpec::name),
        "device::PrecisionSpec::name" => PrecisionSpec::ALL.map(PrecisionSpec::name),
        "device::DeviceSettings::from" => DeviceSettings::from(&IdentifySpec::default()),
        "device::ThroughputProfile::this_cpu" => ThroughputProfile::this_cpu(),
    );
    for threads in COUNTS {
        ask!(calls, threads; "device::check_threads" => check_threads(Some(threads)));
        if threads != 1000 {
            ask!(calls, threads; "device::with_threads" => with_threads(Some(threads), || Ok(())));
        }
    }
    let problem = Arc::new(Problem::new(&[step(30)], Model::default(), Space::table2(), Criterion::default()).unwrap());
    let mut unknown = BatchSearchEvaluator::new(Box::new(Scalar), vec![problem.clone()]).on_loss(OnLoss::ReopenOrCpu);
    let failure = motorfit::Error::usage("", "");
    drive!(calls, ();
        "device::BatchSearchEvaluator::new" => BatchSearchEvaluator::new(Box::new(Scalar), Vec::new()).slice(),
        "device::BatchSearchEvaluator::slice" => unknown.slice(),
        "device::BatchSearchEvaluator::device" => unknown.device(),
        "device::BatchSearchEvaluator::warnings" => unknown.warnings().len(),
        "device::BatchSearchEvaluator::take_warnings" => unknown.take_warnings(),
        "device::BatchSearchEvaluator::on_loss" =>
            BatchSearchEvaluator::new(Box::new(Scalar), Vec::new()).on_loss(OnLoss::Reopen).slice(),
        "device::BatchSearchEvaluator::replacing_failed" =>
            BatchSearchEvaluator::new(Box::new(Scalar), Vec::new()).replacing_failed(&failure).warnings().len(),
    );
    for count in [0, 1, 3] {
        drive!(calls, count; "device::BatchSearchEvaluator::set_problems" => unknown.set_problems(vec![problem.clone(); count]));
        for populations in [0, 1, 2] {
            let populations = vec![Candidates::new(&[1.0; 10], 5); populations];
            let mut costs = vec![0.0; 2];
            ask!(calls, (count, populations.len());
                "optimize::Evaluate::begin" => Evaluate::begin(&mut unknown, &populations),
                "optimize::Evaluate::finish" => Evaluate::finish(&mut unknown, &populations, &mut costs),
            );
        }
    }
    for device in
        [DeviceSpec::Cpu, DeviceSpec::Auto, DeviceSpec::GpuIndex(usize::MAX), DeviceSpec::GpuName("\0".to_owned())]
    {
        for (population, precision, evaluator) in [
            (0, PrecisionSpec::F32, EvaluatorSpec::Kernel),
            (usize::MAX, PrecisionSpec::Auto, EvaluatorSpec::Auto),
            (7, PrecisionSpec::F64, EvaluatorSpec::Tables),
        ] {
            let settings = DeviceSettings {
                device: device.clone(),
                precision,
                evaluator,
                throughput_profile: None,
                threads: Some(usize::MAX),
                population,
                generations: population,
                needs_all_costs: population == 7,
            };
            ask!(calls, settings;
                "device::BatchSearchEvaluator::open" => BatchSearchEvaluator::<Problem>::open(settings.clone(), Vec::new()).map(|e| e.slice()),
                "device::BatchSearchEvaluator::open" => BatchSearchEvaluator::open(settings.clone(), vec![problem.clone()]).map(|e| e.slice()),
            );
        }
    }
    profiles(calls);
}

fn profiles(calls: &mut Calls) {
    let mut curves = vec![ThroughputCurve { points: Vec::new() }];
    curves.extend(
        NUMBERS.map(|v| ThroughputCurve { points: vec![(0, 0, v), (u64::MAX, u64::MAX, v), (1, 2, v), (0, 0, v)] }),
    );
    for curve in curves {
        for (samples, population) in WIDE.into_iter().flat_map(|a| WIDE.map(|b| (a, b))) {
            drive!(calls, (&curve, samples, population); "device::ThroughputCurve::seconds" => curve.seconds(samples, population));
            let adapter = motorfit::device::AdapterThroughput {
                name: String::new(),
                kind: String::new(),
                backend: String::new(),
                driver: String::new(),
                precision: "f32".to_owned(),
                opening_s: f64::NAN,
                curve: curve.clone(),
            };
            let profile = ThroughputProfile {
                motorfit: String::new(),
                cpu: String::new(),
                threads: usize::MAX,
                curve: curve.clone(),
                adapters: vec![adapter; 2],
            };
            for threads in [0, 1, usize::MAX] {
                let equivalent_samples = [None, Some(0), Some(u64::MAX)][threads.min(2)];
                let work = Work { samples, population, generations: population, threads, equivalent_samples };
                drive!(calls, (&curve, work);
                    "device::ThroughputProfile::faster" => (profile.faster(work, None), profile.faster(work, Some("\0"))),
                    "device::ThroughputProfile::is_current" => profile.is_current(),
                );
            }
        }
    }
}

#[cfg(feature = "gpu")]
pub fn gpus(calls: &mut Calls) {
    use motorfit::evaluate::gpu::{
        BufferKind, Fetch, Gpu, Precision, Selector, ShaderFeatures, Submission, Variant, assemble, list,
    };
    for word in texts() {
        ask!(calls, word; "evaluate::gpu::Precision::named" => <Precision as Named>::named("precision", &word));
    }
    for precision in Precision::ALL {
        for features in [None, Some(ShaderFeatures { brushes: true, delayed: true, averages: [true; 2] })] {
            for (absolute, fetch) in [(true, Fetch::Direct), (false, Fetch::Subgroup)] {
                let variant = Variant { precision, absolute, weighted: absolute, uniform: !absolute, fetch, features };
                drive!(calls, variant;
                    "evaluate::gpu::assemble" => assemble(variant),
                    "evaluate::gpu::Precision::name" => precision.name(),
                    "evaluate::gpu::Precision::operations" => precision.operations(),
                );
            }
        }
    }
    drive!(calls, ();
        "evaluate::gpu::list" => list(),
        "evaluate::gpu::BufferKind::name" => [BufferKind::Uniform, BufferKind::Read, BufferKind::Write].map(BufferKind::name),
    );
    for space in spaces() {
        let Ok(problem) = Problem::new(&[step(30)], Model::default(), space, Criterion::default()) else { continue };
        let problem = Arc::new(problem);
        let (width, none) = (problem.space().free().len(), Candidates::new(&[], 0));
        let values = candidates(width);
        let all = Candidates::new(&values, width);
        drive!(calls, width; "evaluate::gpu::Submission::candidates_max" => Submission::candidates_max(&problem));
        for (count, reference) in [(0, None), (usize::MAX, None), (3, Some([f64::NAN].as_slice())), (all.count(), None)]
        {
            let made = calls.ask("evaluate::gpu::Submission::new", &(count, reference), || {
                Submission::new(&problem, count, reference)
            });
            let Some(submission) = made else { continue };
            drive!(calls, count;
                "evaluate::gpu::Submission::shader" => submission.shader(),
                "evaluate::gpu::Submission::buffers" => submission.buffers(),
                "evaluate::gpu::Submission::bindings" => submission.bindings(),
                "evaluate::gpu::Submission::rounds" => submission.rounds(),
                "evaluate::gpu::Submission::workgroups" => submission.workgroups(),
                "evaluate::gpu::Submission::steps" => submission.steps(),
            );
            let size = submission.buffers().last().map_or(0, |sums| sums.size);
            for candidates in [all, none, all.rows(0, 1)] {
                ask!(calls, count;
                    "evaluate::gpu::Submission::maps" => submission.maps(candidates),
                    "evaluate::gpu::Submission::costs" => submission.costs(candidates, &[]),
                    "evaluate::gpu::Submission::costs" => submission.costs(candidates, &vec![255; size]),
                );
            }
        }
    }
    for selector in [Selector::Index(usize::MAX), Selector::Name("\0".to_owned())] {
        ask!(calls, selector; "evaluate::gpu::Gpu::open" => Gpu::open(&selector, None).map(drop));
    }
    let Some(mut gpu) = calls.ask("evaluate::gpu::Gpu::open", &"the best", || Gpu::open(&Selector::Best, None)) else {
        // Without an adapter these cannot be called.
        calls.called.extend(["evaluate::gpu::Gpu::facts", "evaluate::gpu::Gpu::name", "evaluate::gpu::Gpu::precision"]);
        return;
    };
    drive!(calls, ();
        "evaluate::gpu::Gpu::facts" => gpu.facts(),
        "evaluate::gpu::Gpu::name" => gpu.name(),
        "evaluate::gpu::Gpu::precision" => gpu.precision(),
    );
    for space in spaces() {
        let Ok(problem) = Problem::new(&[step(30)], Model::default(), space, Criterion::default()) else { continue };
        let values = candidates(problem.space().free().len());
        evaluated(calls, &mut gpu, &Arc::new(problem), &values);
    }
}

#[expect(clippy::too_many_lines, reason = "a list of calls")]
pub fn estimates(calls: &mut Calls) {
    use motorfit::estimate::{
        RefineOptions, SmFailure, Whiteness, describe_direction, fit_problem, global_reference, initial_states, refine,
        refine_coarse, refine_on, residual_squares, robust_uncertainty, signal_deviations, steiglitz_mcbride,
        steiglitz_mcbride_on,
    };
    for word in texts() {
        ask!(calls, word; "estimate::SmFailure::named" => <SmFailure as Named>::named("", &word));
    }
    drive!(calls, ();
        "estimate::SmFailure::name" => SmFailure::ALL.map(SmFailure::name),
        "estimate::SmFailure::message" => SmFailure::ALL.map(SmFailure::message),
        "estimate::signal_deviations" => signal_deviations(&[]),
        "estimate::describe_direction" => (describe_direction(&[], Space::table2().free()), describe_direction(&[f64::NAN; 9], Space::table2().free()), describe_direction(&[1.0; 9], &[])),
    );
    for signal in &signals() {
        drive!(calls, signal; "estimate::Whiteness::of" => NUMBERS.map(|size| Whiteness::of(signal, size)));
    }
    let spaces = spaces();
    for (n, record) in records().iter().enumerate().step_by(5) {
        let one = std::slice::from_ref(record);
        let two = [record.clone(), step(60)];
        let space = if n % 3 == 0 { spaces[n % spaces.len()].clone() } else { Space::table2() };
        let width = space.free().len();
        drive!(calls, record; "estimate::signal_deviations" => signal_deviations(one));
        ask!(calls, record;
            "estimate::steiglitz_mcbride" => steiglitz_mcbride(record, Model::default()),
            "estimate::refine" => refine(one, &space, &[], &RefineOptions::default()),
            "estimate::refine" => refine(&[], &space, &[1.0; 5], &RefineOptions::default()),
            "estimate::fit_problem" => fit_problem(&two, &space, Model::default()).map(drop),
            "estimate::fit_problem" => fit_problem(&[], &space, Model::default()).map(drop),
        );
        let Ok(problem) = fit_problem(one, &space, Model::default()) else { continue };
        let middle: Vec<f64> = space.free().iter().map(Axis::middle).collect();
        for recording in [0, 1, usize::MAX] {
            ask!(calls, recording; "estimate::steiglitz_mcbride_on" => steiglitz_mcbride_on(&problem, recording));
        }
        let starts = FEW.iter().map(|v| vec![*v; width]).chain([middle, vec![1.0; width + 1], Vec::new()]);
        for (start, sigma) in starts.zip([f64::NAN, 0.0, 1.0, -1.0, 1.0, 5e-324, f64::MAX, 1.0, 1e9, 1.0]) {
            let sigmas = [vec![sigma; 2], vec![1.0; 2]];
            let with = (record, &start, sigma);
            let options = RefineOptions { model: Model::default(), sigma: Some(sigmas[..1].to_vec()) };
            ask!(calls, with;
                "estimate::residual_squares" => residual_squares(&problem, &start),
                "estimate::initial_states" => initial_states(&problem, &start, [sigma; 2]),
                "estimate::refine_on" => refine_on(&problem, &start, Some(&sigmas)),
                "estimate::refine_coarse" => refine_coarse(&problem, &start, &sigmas[..1]),
                "estimate::refine_coarse" => refine_coarse(&problem, &start, &[]),
                "estimate::refine" => refine(one, &space, &start, &options),
            );
            let refined = calls.ask("estimate::refine_on", &with, || refine_on(&problem, &start, Some(&sigmas[..1])));
            let Some(mut refined) = refined else { continue };
            drive!(calls, with;
                "estimate::Refined::weighted" => (refined.weighted(&sigmas), refined.weighted(&[])),
                "estimate::Refined::state" => (refined.state(0), refined.state(usize::MAX)),
                "estimate::Uncertainty::variance_inflation" => refined.uncertainty.variance_inflation(),
                "estimate::robust_uncertainty" => robust_uncertainty(&problem, &refined),
            );
            refined.values.truncate(1);
            drive!(calls, with; "estimate::robust_uncertainty" => robust_uncertainty(&problem, &refined));
            refined.initial.clear();
            refined.sigmas.clear();
            drive!(calls, with; "estimate::robust_uncertainty" => robust_uncertainty(&problem, &refined));
        }
        if n % 7 == 0 {
            for sigma in [
                vec![vec![1.0; 2]],
                vec![vec![f64::NAN; 2]],
                vec![vec![1e-300; 2]],
                vec![vec![1.0; 2]; 3],
                vec![vec![1.0]],
            ] {
                let find = || global_reference(&problem, &sigma);
                let Some(found) = calls.ask("estimate::global_reference", &(record, &sigma), find) else { continue };
                drive!(calls, &sigma; "estimate::Reference::is_conclusive" => found.is_conclusive());
            }
        }
    }
    let problem = fit_problem(&[step(60)], &Space::table2(), Model::default()).unwrap();
    let found = calls.ask("estimate::global_reference", &"a step", || global_reference(&problem, &[vec![0.01; 2]]));
    drive!(calls, (); "estimate::Reference::is_conclusive" => found.map(|found| found.is_conclusive()));
}
