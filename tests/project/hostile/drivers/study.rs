//! Calls of `study`: comparisons, throughput measurements and slices of the cost.

use crate::hostile::arguments::{COUNTS, FEW, NUMBERS, records, step, texts};
use crate::hostile::calls::{Calls, ask, drive};
use crate::hostile::drivers::models::recording;
use motorfit::criterion::{Criterion, Scale};
use motorfit::evaluate::{Model, Scalar, Simd};
use motorfit::identify::model::ModelSpec;
use motorfit::identify::{IdentifySpec, Method};
use motorfit::model::BuiltIn;
use motorfit::motor::{Parameter, Parameters};
use motorfit::named::Named;
use motorfit::optimize::{Coordinates, GeneticOptions, GwoOptions};
use motorfit::study::compare::{
    Block, CompareSettings, CompareSpec, ComparedMachine, ComparedModel, ComparedParameter, Comparison,
    ComparisonSetting, ComparisonSubject, Domain, Invariance, MethodEstimates, MethodResult, Outcome, Preset,
    Steiglitz, compare, paper, reached,
};
use motorfit::study::{
    Contenders, CostMap, MapParameter, Measurement, Throughput, ThroughputSpec, contenders, cost_map, model_contenders,
    model_cost_map, throughput,
};
use std::ops::ControlFlow;

fn setting(population: usize, generations: usize) -> ComparisonSetting {
    let methods = vec![GwoOptions::default().into(), GeneticOptions::default().into()];
    let (criterion, coordinates) = (Criterion::default(), Coordinates::Mirror);
    ComparisonSetting { criterion, population, generations, methods, coordinates }
}

fn quick() -> CompareSpec {
    let plain = ComparisonSetting { coordinates: Coordinates::None, ..setting(6, 4) };
    CompareSpec { settings: vec![plain, setting(6, 4)], runs: 7, noise_records: 3, ..CompareSpec::default() }
}

/// Returns a comparison that takes some milliseconds, and inconsistent copies of it.
pub fn comparisons() -> Vec<Comparison> {
    let subject = ComparisonSubject::of_motor(vec![step(100)], Some(Parameters::M2));
    let found = compare(subject, &quick(), &mut |_| ControlFlow::Continue(())).unwrap();
    let mut all = vec![found.clone()];
    let mut with = |change: &dyn Fn(&mut Comparison)| {
        let mut other = found.clone();
        change(&mut other);
        all.push(other);
    };
    with(&|c| c.blocks.truncate(1));
    with(&|c| c.blocks[1].results.truncate(1));
    with(&|c| c.blocks.clear());
    with(&|c| c.blocks[0].results.clear());
    with(&|c| c.blocks[0].results[0].runs.clear());
    with(&|c| c.blocks[0].results.iter_mut().for_each(|r| r.runs.clear()));
    with(&|c| c.blocks[0].results[0].runs.truncate(2));
    with(&|c| c.blocks[0].results[0].runs[0].history.clear());
    with(&|c| c.blocks[0].setting.methods.clear());
    with(&|c| (c.blocks[0].setting.population, c.blocks[0].setting.generations) = (0, 0));
    with(&|c| c.initial.clear());
    with(&|c| c.steiglitz = None);
    with(&|c| c.reference = Err("".into()));
    with(&|c| (c.subject.machine, c.reference) = (ComparedMachine::Motor { truth: None }, Err("".into())));
    with(&|c| c.parameters.clear());
    with(&|c| c.parameters.truncate(2));
    with(&|c| c.subject.records.clear());
    with(&|c| c.spec.settings.clear());
    for value in FEW {
        let odd = Parameters { r: value, l: value, k: value, b: value, j: value };
        let machine = ComparedMachine::Motor { truth: Some(odd) };
        with(&|c| (c.subject.machine, c.spec.target, c.batch_seconds) = (machine.clone(), Some(value), value));
        with(&|c| {
            for run in c.blocks.iter_mut().flat_map(|b| &mut b.results).flat_map(|r| &mut r.runs) {
                (run.cost, run.parameters) = (value, Some(odd.to_array().to_vec()));
                run.history.iter_mut().for_each(|cost| *cost = value);
            }
        });
        with(&|c| c.blocks[0].results.iter_mut().for_each(|r| r.seconds = Some(value)));
    }
    all.extend(of_models(&found));
    all
}

/// Returns the subject of a small recording of the DC motor as a model, with some of its parameters fixed.
fn model_subject(fixed: &[(&str, f64)]) -> ComparisonSubject {
    let spec = ModelSpec {
        fixed: fixed.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect(),
        ..ModelSpec::default()
    };
    let of = ComparedModel { model: BuiltIn::DcMotor.model().unwrap(), recordings: vec![recording()], spec };
    ComparisonSubject { records: vec![step(60)], machine: ComparedMachine::Model(Box::new(of)) }
}

/// Returns a comparison with a model, and inconsistent copies of it; `motor` is one with the DC motor.
fn of_models(motor: &Comparison) -> Vec<Comparison> {
    let spec = CompareSpec { steiglitz_mcbride: false, ..quick() };
    let found = compare(model_subject(&[("J", 1e-4)]), &spec, &mut |_| ControlFlow::Continue(())).unwrap();
    let mut all = vec![found.clone()];
    let mut with = |change: &dyn Fn(&mut Comparison)| {
        let mut other = found.clone();
        change(&mut other);
        all.push(other);
    };
    let of_model = |c: &mut Comparison, change: &dyn Fn(&mut ComparedModel)| {
        if let ComparedMachine::Model(of) = &mut c.subject.machine {
            change(of);
        }
    };
    with(&|c| c.blocks.clear());
    with(&|c| c.parameters.clear());
    with(&|c| c.parameters.truncate(3));
    with(&|c| c.reference = Err("".into()));
    with(&|c| c.reference = motor.reference.clone());
    with(&|c| c.steiglitz = motor.steiglitz.clone());
    with(&|c| c.subject.machine = motor.subject.machine.clone());
    with(&|c| of_model(c, &|of| of.recordings.clear()));
    with(&|c| of_model(c, &|of| of.recordings[0].measured.truncate(1)));
    with(&|c| of_model(c, &|of| of.spec.fixed.clear()));
    with(&|c| of_model(c, &|of| of.model = BuiltIn::Pmsm.model().unwrap()));
    for value in FEW {
        with(&|c| {
            for run in c.blocks.iter_mut().flat_map(|b| &mut b.results).flat_map(|r| &mut r.runs) {
                (run.cost, run.parameters) = (value, Some(vec![value; 5]));
            }
        });
        with(&|c| {
            c.parameters.iter_mut().for_each(|p| p.domain = Domain::Free { axis: usize::MAX, min: value, max: -value })
        });
        with(&|c| c.parameters.iter_mut().for_each(|p| p.domain = Domain::Fixed(value)));
    }
    all
}

pub fn compared(calls: &mut Calls) {
    let all = comparisons();
    let parameters = all[0].parameters.clone();
    for comparison in all {
        let shown = format!("{:?}", comparison.blocks);
        drive!(calls, shown;
            "study::compare::Comparison::expected" => comparison.expected(),
            "study::compare::Invariance::name" => Invariance::ALL.map(Invariance::name),
            "study::compare::InvarianceTest::of" => comparison.invariance.iter().map(|t| t.of(&comparison).is_some()).collect::<Vec<_>>(),
            "study::compare::ComparisonSubject::truth" => comparison.subject.truth(),
            "study::compare::ComparisonSubject::model" => comparison.subject.model().is_some(),
        );
        of_parameters(calls, &comparison);
        for block in &comparison.blocks {
            drive!(calls, shown;
                "study::compare::Comparison::estimates" => comparison.estimates(block),
                "study::compare::reached" => (reached(block, None), NUMBERS.map(|target| reached(block, Some(target)))),
                "study::compare::Block::has_results" => block.has_results(),
                "study::compare::Block::ranking" => block.ranking(),
            );
            for result in &block.results {
                of_method(calls, result);
            }
        }
    }
    for value in FEW {
        let odd = Parameters { r: value, l: value, k: value, b: value, j: value };
        let steiglitz =
            Steiglitz { estimate: Ok(odd), spread: vec![odd; 2], records: 0, sigma: [value; 2], seconds: value };
        drive!(calls, value; "study::compare::Steiglitz::estimates" => steiglitz.estimates());
        for all in [vec![], vec![odd], vec![odd; 3]] {
            let all = all.into_iter().map(|motor: Parameters| motor.to_array().to_vec()).collect();
            let of = MethodEstimates { method: "", best: Some(vec![value; 3]), all, seconds: None };
            drive!(calls, of;
                "study::compare::MethodEstimates::deviations" => [of.deviations(&parameters), of.deviations(&[])],
                "study::compare::MethodEstimates::errors" => [of.errors(&[value; 7]), of.errors(&[])],
                "study::compare::MethodEstimates::values" => COUNTS.map(|n| of.values(n).len()),
            );
        }
    }
    drive!(calls, ();
        "study::compare::CompareSpec::paper" => CompareSpec::paper(),
        "study::compare::Preset::name" => Preset::ALL.map(Preset::name),
        "study::compare::ComparisonSetting::paper" => Scale::ALL.map(ComparisonSetting::paper),
    );
    ask!(calls, (); "study::compare::ComparisonSubject::m2" => ComparisonSubject::m2());
}

fn of_parameters(calls: &mut Calls, comparison: &Comparison) {
    let parameters = &comparison.parameters;
    drive!(calls, parameters;
        "study::compare::ComparedParameter::values" => [&[][..], &[1.0; 9]].map(|of| ComparedParameter::values(parameters, of)),
        "study::compare::ComparedParameter::candidate" => [&[][..], &[1.0; 9]].map(|of| ComparedParameter::candidate(parameters, of)),
    );
    for parameter in parameters {
        drive!(calls, parameter;
            "study::compare::ComparedParameter::is_free" => parameter.is_free(),
            "study::compare::ComparedParameter::bounds" => parameter.bounds(),
            "study::compare::ComparedParameter::fixed" => parameter.fixed(),
        );
    }
    if let Ok(reference) = &comparison.reference {
        drive!(calls, parameters;
            "study::compare::Reference::values" => reference.values(parameters),
            "study::compare::Reference::is_unidentified" => texts().iter().any(|word| reference.is_unidentified(word)),
            "study::compare::Reference::trust" => reference.trust().reasons.len(),
            "study::compare::Reference::motor" => reference.motor().is_some(),
            "study::compare::Reference::model" => reference.model().is_some(),
        );
    }
    if let Some(of) = comparison.subject.model() {
        ask!(calls, parameters;
            "study::compare::ComparedModel::problem" => of.problem(Criterion::default()).map(drop));
    }
}

fn of_method(calls: &mut Calls, result: &MethodResult) {
    drive!(calls, result;
        "study::compare::MethodResult::best" => result.best().map(|best| best.cost),
        "study::compare::MethodResult::costs" => result.costs(),
        "study::compare::MethodResult::estimates" => result.estimates(),
        "study::compare::MethodResult::summary" => result.summary(u64::MAX),
    );
}

/// Compares on models with settings that may not suit them.
fn of_model_specs(calls: &mut Calls, specs: &[CompareSpec]) {
    for fixed in [&[][..], &[("nothing", 1.0)], &[("R", f64::NAN)], &["R", "L", "K", "B", "J"].map(|name| (name, 1.0))]
    {
        for spec in specs {
            let spec = CompareSpec { steiglitz_mcbride: fixed.len() == 1, ..spec.clone() };
            ask!(calls, (fixed, &spec); "study::compare::compare" =>
                compare(model_subject(fixed), &spec, &mut |_| ControlFlow::Continue(())));
        }
    }
    for record in records() {
        let model = BuiltIn::DcMotor.model().unwrap();
        ask!(calls, record; "study::compare::ComparisonSubject::of_model" =>
            ComparisonSubject::of_model(model, vec![record.clone()], ModelSpec::default()));
        drive!(calls, record; "study::compare::ComparisonSubject::of_motor" => ComparisonSubject::of_motor(vec![record.clone()], None));
    }
}

pub fn compare_specs(calls: &mut Calls) {
    let usual = quick();
    let mut specs = vec![
        CompareSpec { settings: Vec::new(), ..usual.clone() },
        CompareSpec { runs: 0, ..usual.clone() },
        CompareSpec { runs: usize::MAX, ..usual.clone() },
        CompareSpec { settings: vec![setting(0, 3)], ..usual.clone() },
        CompareSpec { settings: vec![setting(5, 0)], ..usual.clone() },
        CompareSpec { settings: vec![setting(5, 2), setting(7, 3)], runs: 1, noise_records: 0, ..usual.clone() },
        CompareSpec { settings: vec![ComparisonSetting { methods: Vec::new(), ..setting(5, 2) }], ..usual.clone() },
        CompareSpec {
            settings: vec![ComparisonSetting { methods: vec![Method::Auto; 2], ..setting(5, 2) }],
            ..usual.clone()
        },
        CompareSpec {
            settings: vec![ComparisonSetting { methods: vec![Method::SteiglitzMcBride], ..setting(5, 2) }],
            ..usual.clone()
        },
    ];
    for value in FEW {
        specs.push(CompareSpec { target: Some(value), noise_db: value, runs: 2, ..usual.clone() });
    }
    for spec in &specs {
        let subject = ComparisonSubject::of_motor(vec![step(60)], Some(Parameters::M2));
        ask!(calls, spec; "study::compare::compare" => compare(subject.clone(), spec, &mut |_| ControlFlow::Continue(())));
    }
    let short = CompareSpec { runs: 2, settings: vec![setting(4, 2)], ..usual };
    for record in records().into_iter().step_by(3) {
        for (records, truth) in
            [(vec![], None), (vec![record.clone()], None), (vec![record.clone(), step(30)], Some(Parameters::M2))]
        {
            let subject = ComparisonSubject::of_motor(records, truth);
            ask!(calls, subject;
                "study::compare::compare" => compare(subject.clone(), &short, &mut |_| ControlFlow::Continue(())),
                "study::compare::compare" => compare(subject.clone(), &short, &mut |_| ControlFlow::Break(())),
            );
        }
    }
    of_model_specs(calls, &[&specs[..7], &[short]].concat());
    for word in texts() {
        ask!(calls, word; "study::compare::Preset::named" => <Preset as Named>::named("preset", &word));
        ask!(calls, word; "study::compare::Invariance::named" => <Invariance as Named>::named("verdict", &word));
        drive!(calls, word; "study::compare::paper::printed" => paper::printed(&word));
        let own = |n: usize, m: usize| if n == m { vec![word.clone()] } else { Vec::new() };
        for n in 0..7 {
            let settings = CompareSettings {
                methods: if n == 6 { Vec::new() } else { vec![GeneticOptions::default().into()] },
                criteria: if n == 0 { own(0, 0) } else { vec!["euclidean:peak".to_owned()] },
                population: vec![usize::MAX],
                generations: vec![0],
                set: own(n, 1),
                transforms: own(n, 4),
                bounds: own(n, 2),
                fix: own(n, 3),
            };
            ask!(calls, (n, &word);
                "study::compare::CompareSettings::settings" => settings.settings(),
                "study::compare::CompareSettings::space" =>
                    settings.space(&ComparisonSubject::of_motor(vec![step(30)], None), Model::default()),
            );
        }
    }
}

pub fn maps(calls: &mut Calls) {
    for (costs, value) in [(vec![], 0.0), (vec![vec![]], f64::NAN), (vec![vec![1.0; 2]; 2], f64::INFINITY)] {
        let none = || MapParameter { symbol: String::new(), name: String::new(), unit: String::new() };
        let (optimum, ranges) = ([value; 2], [[value, 1.0]; 2]);
        let map =
            CostMap { parameters: [none(), none()], ranges, costs, optimum, ellipse: Vec::new(), warnings: Vec::new() };
        drive!(calls, value;
            "study::CostMap::value" => COUNTS.map(|place| [map.value(0, place), map.value(1, place)]),
        );
        calls.may_panic("study::CostMap::value", || map.value(usize::MAX, 0));
    }
    let model = BuiltIn::DcMotor.model().unwrap();
    let model_spec = ModelSpec { population: 4, generations: 2, ..ModelSpec::default() };
    for recordings in [Vec::new(), vec![recording()]] {
        for (side, names) in [(0, ["R", "L"]), (2, ["R", "R"]), (2, ["R", ""]), (3, ["R", "J"])] {
            ask!(calls, (side, names); "study::model_cost_map" => {
                model_cost_map((&model, &recordings), &model_spec, names, side)
            });
        }
    }
    let spec = IdentifySpec { population: 4, generations: 2, ..IdentifySpec::default() };
    for record in records().iter().step_by(4).chain([&step(60)]) {
        for side in [0, 1, 2, 3, usize::MAX] {
            for parameters in [[Parameter::R, Parameter::L], [Parameter::R; 2], [Parameter::Load, Parameter::R]] {
                ask!(calls, (record, side, parameters); "study::cost_map" => cost_map(std::slice::from_ref(record), &spec, parameters, side));
            }
        }
    }
    ask!(calls, "none"; "study::cost_map" => cost_map(&[], &spec, [Parameter::R, Parameter::L], 2));
}

/// Returns inconsistent throughput measurements.
pub fn benchmarks() -> Vec<Throughput> {
    let mut all = Vec::new();
    for (value, number) in FEW.into_iter().flat_map(|v| COUNTS.map(|n| (v, n))) {
        let measurement = Measurement {
            contender: number,
            population: number,
            samples: number,
            seconds: Some(value),
            interval: [value, -value],
            rounds: number,
            kernel: Some([value, 0.0]),
            again: Some((value, [value; 2])),
        };
        let contenders = if number % 2 == 0 { Vec::new() } else { contenders(1, false, false).unwrap().list };
        let measurements =
            vec![measurement.clone(), Measurement { seconds: None, contender: 0, ..measurement.clone() }, measurement];
        all.push(Throughput {
            contenders,
            refused: vec![String::new()],
            measurements,
            fma_peak: Some(value),
            interrupted: true,
        });
    }
    all
}

pub fn speeds(calls: &mut Calls) {
    for result in benchmarks() {
        let first = result.measurements[0].clone();
        drive!(calls, first;
            "study::Measurement::rate" => first.rate(),
            "study::Measurement::kernel_rate" => first.kernel_rate(),
            "study::Measurement::spread" => first.spread(),
            "study::Throughput::baseline" => result.baseline(),
            "study::Throughput::control" => result.control(),
            "study::Throughput::throughput_profile" => result.throughput_profile(),
            "study::Throughput::of" => COUNTS.map(|n| result.of(n).count()),
            "study::Throughput::case" => COUNTS.map(|n| result.case(n, n, n).is_some()),
            "study::Throughput::crossover" => COUNTS.map(|n| COUNTS.map(|m| result.crossover(n, m, n))),
        );
    }
    drive!(calls, (); "study::Contenders::none" => Contenders::none().list.len());
    for threads in COUNTS.into_iter().filter(|threads| *threads != 1000) {
        ask!(calls, threads;
            "study::contenders" => contenders(threads, false, true).map(drop),
            "study::model_contenders" => model_contenders(&BuiltIn::DcMotor.model().unwrap(), threads, false).map(drop),
            "study::Contenders::add_on_cpu" => Contenders::none().add_on_cpu(String::new(), Box::new(Scalar), threads),
        );
    }
    for (count, budget_s) in COUNTS.into_iter().flat_map(|c| FEW.map(|b| (c, b))) {
        for (populations, samples) in
            [(vec![count], vec![5]), (vec![3, 3], vec![count]), (vec![], vec![count]), (vec![1], vec![])]
        {
            let spec = ThroughputSpec { populations, samples, budget_s };
            let is_long = |spec: &ThroughputSpec| {
                let most = |list: &[usize]| list.iter().copied().max().unwrap_or(0);
                most(&spec.populations) * most(&spec.samples) > 100_000 || spec.budget_s > 1.0
            };
            let checked = calls.ask("study::ThroughputSpec::checked", &spec, || spec.clone().checked());
            // The run time is the requested budget, so only short ones are run.
            if checked.as_ref().is_none_or(|spec| !is_long(spec) && spec.budget_s < 1e-3) {
                let who = || {
                    let mut own = Contenders::none();
                    own.add_on_cpu(String::new(), Box::new(Simd::default()), 1).unwrap();
                    own
                };
                ask!(calls, spec;
                    "study::throughput" => throughput(&spec, who(), &mut |_, _| ControlFlow::Continue(())).map(drop),
                    "study::throughput" => throughput(&spec, Contenders::none(), &mut |_, _| ControlFlow::Break(())).map(drop),
                );
            }
        }
    }
    let outcome = Outcome { parameters: None, cost: f64::NAN, history: vec![f64::NAN], evaluations: u64::MAX };
    let result = MethodResult { method: Method::Auto, runs: vec![outcome; 9], seconds: Some(f64::NAN) };
    of_method(calls, &result);
    let block = Block { setting: setting(1, 1), results: vec![result; 3], reference_cost: None, steiglitz_cost: None };
    drive!(calls, block; "study::compare::Block::ranking" => block.ranking());
}
