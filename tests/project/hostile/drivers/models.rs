//! Calls of `model`, `units`, and of what evaluates, estimates and shows users' models.

use crate::hostile::arguments::{COUNTS, FEW, NUMBERS, step, texts};
use crate::hostile::calls::{Calls, ask, drive};
use crate::hostile::drivers::estimate::of_fitted;
use crate::hostile::drivers::identify::{batch_costs, fitted, mangled as mangled_motors, of_machine};
use crate::hostile::drivers::report::of_shown;
use motorfit::candidates::Candidates;
use motorfit::estimate::model::{ModelStarts, best_model_start, model_ends, model_optima, open_flat, refine_model};
use motorfit::estimate::{Refined, separate_fits};
use motorfit::evaluate::model::{ModelAxis, ModelProblem, ModelRecording, ModelSettings, ModelSpace, signal_requests};
use motorfit::evaluate::{Evaluator, Simd};
use motorfit::experiment::white_noise;
use motorfit::identify::model::{
    ModelIdentification, ModelSpec, ModelTerms, hold_out_model, identify_model, integration, model_likelihood_profiles,
};
use motorfit::identify::{BatchCosts, IdentifySpec, identify};
use motorfit::model::{BuiltIn, Function, GenericTerm, IntegrationMethod, Model, Role, ShaderPrecision};
use motorfit::named::Named;
use motorfit::record::{
    Mask, Offset, Preparation, ReadOptions, Reading, Record, Samples, diagnose, parse_signal_columns, read_bytes,
    read_signal_inputs, step_lengths, write_csv,
};
use motorfit::report::{
    EvaluateDocument, ExportFormat, ModelInspection, ModelSignalFacts, Recorded, Reproduced, SignalStatistics,
    exported_model, exported_motor, identify_document, identify_page, likelihood_document, model_check_document,
    model_check_page, model_inspect_document, model_inspect_page, selection_table, signals_csv, verdict,
};
use motorfit::setting::Setting;
use motorfit::settings::{Given, Value, model_reading, model_spec};
use motorfit::study::sweep::{Limits, Outcome, RunEstimate, RunEstimates};
use motorfit::units::{Dimension, parse_unit};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

/// Returns a small recording of the DC motor as a model.
pub fn recording() -> ModelRecording {
    let time_s: Vec<f64> = (0..60).map(|n| f64::from(n) * 1e-3).collect();
    let wave = |rate: f64| -> Vec<f64> { time_s.iter().map(|t| (rate * t).sin()).collect() };
    ModelRecording {
        step_s: vec![1e-3],
        inputs: vec![wave(200.0), vec![0.0; 60]],
        measured: vec![Some(wave(150.0)), Some(wave(90.0))],
        counting: Vec::new(),
        effective_sample_ratio: 1.0,
        name: None,
        assumed: None,
        time_s,
    }
}

/// Returns a model with an optional term.
fn optional() -> Model {
    Model::parse(&BuiltIn::DcMotor.source().replacen("min = ", "neutral = 1, term = \"a-term\", min = ", 1)).unwrap()
}

pub fn languages(calls: &mut Calls) {
    let good = BuiltIn::DcMotor.source();
    for word in texts() {
        let text = good.replace("(v - R*i - K*w)/L", &word.replace(['"', '\\'], "'"));
        ask!(calls, word;
            "model::Model::parse" => Model::parse(&word),
            "model::Model::parse" => Model::parse(&text),
            "model::Model::parse" => Model::parse(&good.replace("V*s/rad", &word)),
            "model::Model::parse" => Model::parse(&good.replace("min = 1e-3", &format!("neutral = {word}, term = '{word}', min = 1e-3"))),
            "model::Model::open" => Model::open(Path::new(&word)),
            "model::Model::with_generic" => optional().with_generic(&[GenericTerm::Load, GenericTerm::Load]),
            "model::Model::fixed_without" => optional().fixed_without(&[&word, ""]),
            "record::parse_signal_columns" => parse_signal_columns(&word, &["vd", &word]),
            "record::read_signal_inputs" => read_signal_inputs(Path::new(&word), &ReadOptions::default()),
        );
        ask!(calls, word;
            "model::BuiltIn::named" => <BuiltIn as Named>::named("model", &word),
            "model::Function::named" => <Function as Named>::named("function", &word),
            "model::GenericTerm::named" => <GenericTerm as Named>::named("term", &word),
            "model::ShaderPrecision::named" => <ShaderPrecision as Named>::named("precision", &word),
            "model::IntegrationMethod::named" => <IntegrationMethod as Named>::named("method", &word),
        );
        drive!(calls, word; "units::parse_unit" => parse_unit(&word).map(|unit| unit.to(&unit)));
        if let Ok(unit) = parse_unit(&word) {
            drive!(calls, word; "units::Unit::to" => unit.to(&unit));
        }
    }
    for halves in [i32::MIN, -7, -1, 0, 1, 3, 1000, i32::MAX] {
        let large = (0..40).fold(Dimension::TIME, |all, _| all.times(all));
        drive!(calls, halves;
            "units::Dimension::power" => [Dimension::TIME, large].map(|of| of.power(halves)),
            "units::Dimension::times" => large.times(large),
            "units::Dimension::per" => Dimension::ONE.per(large).per(large),
        );
    }
    for of in BuiltIn::ALL {
        built_in(calls, of);
    }
    for function in Function::ALL {
        drive!(calls, function;
            "model::Function::arguments" => function.arguments(),
            "model::Function::name" => function.name(),
        );
    }
    for method in IntegrationMethod::ALL {
        drive!(calls, method; "model::IntegrationMethod::name" => method.name());
    }
}

/// Calls of a built-in model.
fn built_in(calls: &mut Calls, of: BuiltIn) {
    let Some(model) = calls.ask("model::BuiltIn::model", &of, || of.model()) else { return };
    drive!(calls, of;
        "model::BuiltIn::name" => of.name(),
        "model::BuiltIn::source" => of.source(),
        "model::Model::text" => model.text().len(),
        "model::Model::name" => model.name().len(),
        "model::Model::digest" => model.digest(),
        "model::Model::parameters" => model.parameters().len(),
        "model::ModelParameter::usual" => model.parameters().iter().map(|of| of.usual()).sum::<f64>(),
        "model::Model::terms" => model.terms().len(),
        "model::GenericTerm::name" => GenericTerm::ALL.map(GenericTerm::name),
        "model::Model::generic_terms" => model.generic_terms(),
        "model::GenericTerm::applies" => GenericTerm::ALL.map(|term| term.applies(&model)),
        "model::ModelOutput::is_late" => model.outputs().iter().any(|of| of.is_late()),
        "model::Model::inputs" => model.inputs().len(),
        "model::Model::states" => model.states().len(),
        "model::Model::outputs" => model.outputs().len(),
        "model::Model::equations" => model.equations().len(),
        "model::Model::is_affine" => model.is_affine(),
        "model::Model::reactions" => model.reactions(),
        "model::Model::operations" => model.operations(),
        "model::Model::has_corners" => model.has_corners(),
        "model::Model::has_continuous_law" => model.has_continuous_law(),
        "model::Model::has_feedthrough" => COUNTS.map(|number| model.has_feedthrough(number, number)),
        "model::Model::wgsl" => ShaderPrecision::ALL.map(|precision| model.wgsl(precision).is_ok()),
        "model::ShaderPrecision::bytes" => ShaderPrecision::ALL.map(ShaderPrecision::bytes),
        "model::ShaderPrecision::name" => ShaderPrecision::ALL.map(|precision| precision.name().len()),
        "evaluate::model::signal_requests" => signal_requests(&model).len(),
        "report::model_check_document" => model_check_document(&model),
        "report::model_check_page" => model_check_page(&model, &[of.source().to_owned()]),
    );
    for equation in model.equations() {
        drive!(calls, equation; "model::Equation::formula" => equation.formula());
        if let Some(formula) = equation.formula() {
            drive!(calls, equation; "model::Formula::kind" => format!("{:?}", formula.kind()));
        }
    }
}

pub fn signals(calls: &mut Calls) {
    for number in NUMBERS {
        drive!(calls, number; "experiment::white_noise" => white_noise(3, number, 1, 2));
        ask!(calls, number;
            "record::step_lengths" => step_lengths(&[0.0, number, 1.0]),
            "record::step_lengths" => step_lengths(&[number]),
        );
        for other in FEW {
            let axis =
                |is_logarithmic| ModelAxis { parameter: 0, recording: None, min: number, max: other, is_logarithmic };
            drive!(calls, (number, other);
                "evaluate::model::ModelAxis::range" => [true, false].map(|log| axis(log).range()),
                "evaluate::model::ModelAxis::at" => [true, false].map(|log| axis(log).at(other)),
            );
        }
    }
    let model = BuiltIn::DcMotor.model().unwrap();
    let good = recording();
    drive!(calls, good;
        "evaluate::model::ModelRecording::len" => good.len(),
        "evaluate::model::ModelRecording::is_empty" => good.is_empty(),
        "evaluate::model::ModelRecording::regular_step_s" => good.regular_step_s(),
        "evaluate::model::ModelRecording::longest_step_s" => good.longest_step_s(),
    );
    for n in COUNTS {
        drive!(calls, n;
            "evaluate::model::ModelRecording::count" => good.count(n),
            "evaluate::model::ModelRecording::counts" => [good.counts(0, n), good.counts(n, 0)],
            "evaluate::model::ModelRecording::counted" => good.counted(n),
        );
    }
    let options = ReadOptions { signals: signal_requests(&model), ..ReadOptions::default() };
    for text in [
        "time_s,voltage,current,speed\n0,1,2,3\n1,2,3,4\n2,3,4,5\n",
        "t,v\n0,1\n",
        "time_s,voltage_A,i\n0,1,2\n1,1,2\n",
    ] {
        let read = calls.ask("record::read_bytes", &text, || read_bytes(text.as_bytes(), None, &options));
        for record in read.into_iter().flatten() {
            ask!(calls, text; "evaluate::model::ModelRecording::new" => ModelRecording::new(&model, &record));
            of_a_motor(calls, &record);
        }
    }
    let plain = Record::new(Samples {
        time_s: vec![0.0, 1.0],
        voltage: vec![1.0; 2],
        speed: Some(vec![1.0; 2]),
        ..Samples::default()
    });
    let plain = plain.unwrap();
    ask!(calls, plain; "evaluate::model::ModelRecording::new" => ModelRecording::new(&model, &plain));
}

/// Calls functions of the DC motor with the signals of a model.
fn of_a_motor(calls: &mut Calls, record: &Record) {
    drive!(calls, record;
        "record::Record::is_of_model" => record.is_of_model(),
        "record::diagnose" => diagnose(record),
        "record::write_csv" => write_csv(record),
    );
    let one = std::slice::from_ref(record);
    ask!(calls, record; "identify::identify" => identify(one, &IdentifySpec::default()));
    for rate_hz in [0.7, 1.0, 3.0] {
        let preparation = Preparation {
            rate_hz: Some(rate_hz),
            offset: Offset::Auto,
            mask: vec![Mask::Auto],
            ..Preparation::default()
        };
        ask!(calls, rate_hz; "record::Preparation::apply" => preparation.apply(record));
    }
    let filter = "butterworth:0.1:1".parse().ok();
    for decimate in [None, Some(1), Some(2)] {
        ask!(calls, decimate; "record::Preparation::apply" => Preparation { filter, decimate, ..Preparation::default() }.apply(record));
    }
}

pub fn settings(calls: &mut Calls) {
    let model = BuiltIn::DcMotor.model().unwrap();
    for word in texts() {
        let mut given = Given::default();
        for setting in [Setting::Bounds, Setting::Fix, Setting::PerRecording, Setting::With] {
            given.put(setting, Value::List(vec![word.clone()]));
        }
        given.put(Setting::Columns, Value::Text(word.clone()));
        given.put(Setting::Method, Value::Text(word.clone()));
        for setting in [Setting::Bounds, Setting::Fix, Setting::With, Setting::Method, Setting::Columns] {
            drive!(calls, word; "settings::Given::without" => given.without(setting).has(setting));
            let one = given.without(setting);
            calls.call("settings::model_spec", &word, || model_spec(&one).is_ok());
            calls.call("settings::model_reading", &word, || model_reading(&one, &model).map(|_: Reading| ()).is_ok());
        }
        let names = [word.clone()];
        for number in FEW {
            ask!(calls, (&word, number);
                "evaluate::model::ModelSpace::with_bounds" => ModelSpace::new(&model, 1).with_bounds(&model, &word, [number, 1.0]),
                "evaluate::model::ModelSpace::with_bounds" => ModelSpace::new(&model, 1).with_bounds(&model, "R", [number, 1.0]),
                "evaluate::model::ModelSpace::with_fixed" => ModelSpace::new(&model, 1).with_fixed(&model, "R", number),
            );
        }
        ask!(calls, word; "evaluate::model::ModelSpace::per_recording" => ModelSpace::new(&model, 2).per_recording(&model, &names, 2));
    }
}

/// Returns recordings of which most do not fit the model.
fn mangled() -> Vec<ModelRecording> {
    let good = recording();
    let mut all = vec![good.clone()];
    let mut with = |change: &dyn Fn(&mut ModelRecording)| {
        let mut own = good.clone();
        change(&mut own);
        all.push(own);
    };
    with(&|of| of.time_s.clear());
    with(&|of| of.inputs.clear());
    with(&|of| of.measured.clear());
    with(&|of| of.measured.fill(None));
    with(&|of| of.step_s.clear());
    with(&|of| of.counting = vec![vec![false; 60]; of.measured.len()]);
    with(&|of| of.counting = vec![vec![true; 60]]);
    with(&|of| of.counting = vec![vec![true; 3]; of.measured.len()]);
    with(&|of| of.inputs[0].truncate(1));
    with(&|of| of.effective_sample_ratio = f64::NAN);
    for number in NUMBERS {
        with(&|of| of.step_s = vec![number]);
        with(&|of| of.inputs[0][3] = number);
        with(&|of| of.measured[0] = Some(vec![number; 60]));
    }
    all
}

pub fn problems(calls: &mut Calls) {
    let model = BuiltIn::DcMotor.model().unwrap();
    let settings = |method| ModelSettings { method, ..ModelSettings::default() };
    let mut spaces = vec![drive_space(calls, &model)];
    spaces.push(ModelSpace { free: Vec::new(), fixed: Vec::new() });
    spaces.push(ModelSpace { free: Vec::new(), fixed: vec![None; 5] });
    spaces.push(ModelSpace { free: Vec::new(), fixed: vec![Some(f64::NAN); 5] });
    for parameter in [5, usize::MAX] {
        let axis = ModelAxis { parameter, recording: None, min: 1.0, max: 2.0, is_logarithmic: true };
        spaces.push(ModelSpace { free: vec![axis], fixed: vec![Some(1.0); 5] });
    }
    ask!(calls, "none"; "evaluate::model::ModelProblem::new" => ModelProblem::new(&model, spaces[0].clone(), Vec::new(), settings(None)));
    for (space, n) in spaces.iter().flat_map(|space| COUNTS.map(|n| (space, n))) {
        drive!(calls, n; "evaluate::model::ModelSpace::values" => [&[][..], &[1.0; 9]].map(|free| space.values(free, n).len()));
    }
    for recording in mangled() {
        for space in &spaces {
            let made = || ModelProblem::new(&model, space.clone(), vec![recording.clone()], settings(None));
            let Some(problem) = calls.ask("evaluate::model::ModelProblem::new", &recording, made) else { continue };
            one(calls, &problem);
        }
    }
    for substeps in [0, 1, 3, 64] {
        for method in IntegrationMethod::ALL {
            let with = settings(Some((method, substeps)));
            ask!(calls, substeps; "evaluate::model::ModelProblem::new" => ModelProblem::new(&model, spaces[0].clone(), vec![recording()], with));
        }
    }
}

fn drive_space(calls: &mut Calls, model: &Model) -> ModelSpace {
    drive!(calls, "spaces"; "evaluate::model::ModelSpace::new" => [0, 1, 3].map(|n| ModelSpace::new(model, n).free.len()));
    drive!(calls, "spaces"; "evaluate::model::ModelSpace::all_fixed" => ModelSpace::all_fixed(&[f64::NAN]).fixed.len());
    ModelSpace::new(model, 1)
}

fn one(calls: &mut Calls, problem: &ModelProblem) {
    let axes = problem.space().free.len();
    drive!(calls, axes;
        "evaluate::model::ModelProblem::model" => problem.model().name().len(),
        "evaluate::model::ModelProblem::space" => problem.space().free.len(),
        "evaluate::model::ModelProblem::method" => problem.method().substeps,
        "evaluate::model::ModelMethod::is_exact" => problem.method().is_exact(),
        "evaluate::model::ModelMethod::is_stiff" => problem.method().is_stiff(),
        "evaluate::model::ModelProblem::with_space" => {
            let spaces = [problem.space().clone(), ModelSpace::all_fixed(&[]), ModelSpace::all_fixed(&[f64::NAN; 99])];
            spaces.map(|space| problem.with_space(space).is_ok())
        },
        "evaluate::model::ModelProblem::with_rough_steps" => problem.clone().with_rough_steps(true, None).method().is_rough,
        "evaluate::model::ModelMethod::described" => problem.method().described(),
        "evaluate::model::ModelProblem::criterion" => problem.criterion().norm,
        "evaluate::model::ModelProblem::recordings" => problem.recordings(),
        "evaluate::model::ModelProblem::work" => problem.work(),
        "evaluate::model::ModelProblem::counted" => problem.counted(),
    );
    for n in COUNTS {
        ask!(calls, n; "evaluate::model::ModelProblem::with_substeps" => problem.with_substeps(n));
    }
    for n in [0, 1, usize::MAX] {
        calls.may_panic("evaluate::model::ModelProblem::recording", || problem.recording(n).len());
        calls.may_panic("evaluate::model::ModelProblem::open_initial", || problem.open_initial(n).len());
    }
    for number in FEW {
        let values = vec![number; axes];
        let mut costs = [0.0];
        if axes > 0 {
            ask!(calls, number;
                "evaluate::model::ModelProblem::costs" => problem.costs(Candidates::new(&values, axes), &mut costs),
                "evaluate::model::ModelProblem::costs" => problem.costs(Candidates::new(&values, 1), &mut costs),
            );
            assert!(!costs[0].is_nan());
        }
        calls.may_panic("evaluate::model::ModelProblem::simulate", || {
            problem.simulate(&values, 0, &[number; 2]).outputs.len()
        });
        calls.may_panic("evaluate::model::ModelProblem::simulate", || problem.simulate(&[], 0, &[]).outputs.len());
    }
    let middle: Vec<f64> = problem.space().free.iter().map(|axis| axis.at(0.5)).collect();
    populations(calls, problem, &middle);
    refined(calls, problem, &middle);
    of_fitted(calls, problem, &middle);
    ask!(calls, middle;
        "estimate::model::refine_model" => refine_model(problem, &middle, &[vec![0.0; 2]], None),
        "estimate::model::refine_model" => refine_model(problem, &middle, &[vec![f64::NAN; 2]], None),
        "estimate::model::refine_model" => refine_model(problem, &[], &[], Some(&[])),
        "estimate::model::refine_model" => refine_model(problem, &middle, &[vec![0.0; 2]], Some(&[vec![0.0; 9]])),
        "estimate::model::best_model_start" => {
            let sigma = vec![vec![1.0; problem.model().outputs().len()]];
            best_model_start(problem, &[middle.clone(), Vec::new()], &[vec![0.0; 2]], &sigma)?;
            best_model_start(problem, std::slice::from_ref(&middle), &[vec![0.0; 2]], &Vec::new())
        },
        "estimate::model::best_model_start" => {
            let sigma = vec![vec![1.0; problem.model().outputs().len()]];
            best_model_start(problem, &[], &[], &sigma)
        },
        "estimate::model::model_ends" => model_ends(problem, &[middle.clone(), vec![f64::NAN; middle.len()], Vec::new()]),
        "estimate::model::model_ends" => model_ends(problem, std::slice::from_ref(&middle)),
        "estimate::model::model_optima" => {
            let starts = ModelStarts { given: std::slice::from_ref(&middle), populations: &mut |_, _, _| Ok((Vec::new(), 0)) };
            model_optima(problem, &mut Simd::default(), u64::MAX, starts, &mut |_, _| ControlFlow::Continue(()))
        },
        "estimate::model::model_optima" => {
            let starts = ModelStarts { given: &[vec![]], populations: &mut |_, _, _| Ok((vec![vec![]], 0)) };
            model_optima(problem, &mut Simd::default(), 0, starts, &mut |_, _| ControlFlow::Break(()))
        },
    );
}

/// Calls of what follows a refinement.
fn refined(calls: &mut Calls, problem: &ModelProblem, middle: &[f64]) {
    let Ok(found) = refine_model(problem, middle, &[vec![0.0; 2]], None) else { return };
    let other = Refined { values: Vec::new(), ..found.clone() };
    drive!(calls, found;
        "estimate::separate_fits" => separate_fits(problem, &found),
        "estimate::separate_fits" => separate_fits(problem, &other),
        "estimate::model::open_flat" => open_flat(problem, &mut found.clone()),
        "estimate::model::open_flat" => open_flat(problem, &mut other.clone()),
    );
}

/// Calls of what evaluates populations.
fn populations(calls: &mut Calls, problem: &ModelProblem, middle: &[f64]) {
    let mut costs = [0.0; 2];
    let shared = Arc::new(problem.clone());
    let mut simd: Box<dyn Evaluator<ModelProblem>> = Box::new(Simd::default());
    ask!(calls, middle;
        "evaluate::Evaluator::costs" => simd.costs(&shared, Candidates::new(middle, 1), &mut costs),
        "evaluate::Evaluator::costs" => simd.costs(&shared, Candidates::new(middle, middle.len().max(1)), &mut costs[..1]),
        "evaluate::Evaluator::costs" => simd.costs(&shared, Candidates::new(&[], middle.len().max(1)), &mut []),
    );
    drive!(calls, middle; "evaluate::Evaluator::name" => simd.name(), "evaluate::Simd::name" => Simd::default().name());
    #[cfg(feature = "gpu")]
    gpus(calls, &shared, middle);
    let recordings = (0..problem.recordings()).map(|n| problem.recording(n).clone()).collect();
    let costs = calls.ask("identify::BatchCosts::of_model", &middle, || {
        BatchCosts::of_model(problem.model(), recordings, &ModelSpec::default())
    });
    if let Some(of) = costs {
        let document = EvaluateDocument { candidates: 0, interrupted: true, seconds: f64::NAN };
        let best: [(f64, &[f64]); 2] = [(f64::NAN, &[]), (1.0, middle)];
        drive!(calls, middle; "report::EvaluateDocument::of" => document.of(&[], &of, best.into_iter()));
        batch_costs(calls, of);
    }
    let other = BuiltIn::DcMotor.model().unwrap();
    drive!(calls, middle; "evaluate::model::ModelSpace::names" => problem.space().names(&other).len());
}

/// Calls of the GPU evaluator; without an adapter its methods cannot be called.
#[cfg(feature = "gpu")]
fn gpus(calls: &mut Calls, problem: &Arc<ModelProblem>, middle: &[f64]) {
    use motorfit::evaluate::gpu::{Gpu, Selector};
    let Ok(mut gpu) = Gpu::open(&Selector::Best, None) else {
        calls.called.insert("evaluate::gpu::Gpu::serves_model");
        return;
    };
    let mut costs = [0.0; 3];
    ask!(calls, middle;
        "evaluate::gpu::Gpu::serves_model" => gpu.serves_model(problem),
        "evaluate::Evaluator::costs" => gpu.costs(problem, Candidates::new(middle, 1), &mut costs),
    );
    for number in FEW {
        let values = vec![number; middle.len()];
        let mut costs = [0.0];
        ask!(calls, number;
            "evaluate::Evaluator::costs" => gpu.costs(problem, Candidates::new(&values, middle.len().max(1)), &mut costs),
        );
        assert!(!costs[0].is_nan());
    }
}

/// Calls what depends on the parameters of a model alone, and what files for simulators hold.
pub fn exports(calls: &mut Calls) {
    let lists = NUMBERS.map(|value| vec![value; 10]).into_iter().chain([Vec::new(), vec![1.0]]);
    for values in lists {
        for of in BuiltIn::ALL.map(|of| of.model().unwrap()) {
            drive!(calls, values;
                "model::Model::roles" => of.roles(&values),
                "model::Model::derived" => of.derived().len(),
                "model::Model::derived_values" => of.derived_values(&values),
                "model::Model::parameters_in_roles" => of.parameters_in_roles(),
                "model::Model::initial_values" => of.initial_values(&values),
                "model::Model::delays_s" => of.delays_s(&values),
                "model::ModelOutput::is_averaged" => of.outputs().iter().filter(|output| output.is_averaged()).count(),
                "model::Model::constants" => of.constants().len(),
            );
        }
    }
    drive!(calls, ();
        "model::Role::unit" => Role::ALL.map(Role::unit),
        "model::Role::name" => Role::ALL.map(Role::name),
        "report::ExportFormat::extension" => ExportFormat::ALL.map(ExportFormat::extension),
        "report::ExportFormat::name" => ExportFormat::ALL.map(ExportFormat::name),
    );
    for word in texts() {
        ask!(calls, word;
            "model::Role::named" => <Role as Named>::named("role", &word),
            "report::ExportFormat::named" => <ExportFormat as Named>::named("format", &word),
        );
    }
    let motor = fitted();
    let step = step(60);
    for found in mangled_motors(&motor) {
        let of =
            calls.ask("report::exported_motor", &found.values, || exported_motor(std::slice::from_ref(&step), &found));
        let Some(of) = of else { continue };
        for format in ExportFormat::ALL {
            ask!(calls, format; "report::ExportFormat::write" => format.write(&of));
        }
    }
}

pub fn identifications(calls: &mut Calls) {
    let model = BuiltIn::DcMotor.model().unwrap();
    let time_s: Vec<f64> = (0..30).map(f64::from).collect();
    let plain =
        Record::new(Samples { voltage: time_s.clone(), current: Some(time_s.clone()), time_s, ..Samples::default() });
    let plain = plain.unwrap();
    for names in [&["auto", "x"][..], &["auto"], &["none"], &["", "no such term", "\u{0}"]] {
        let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
        ask!(calls, names;
            "identify::model::ModelTerms::parse" => ModelTerms::parse(&names),
            "identify::model::ModelTerms::taken" => ModelTerms::parse(&names).map(|with| with.taken(&model)),
        );
    }
    for recording in mangled() {
        for is_polished in [true, false] {
            let with = if is_polished { ModelTerms::All } else { ModelTerms::Auto };
            let spec = ModelSpec { is_polished, with, ..ModelSpec::default() };
            drive!(calls, recording;
                "identify::model::ModelSpec::settings" => spec.settings().is_first_order_hold,
            );
            ask!(calls, recording;
                "identify::model::ModelSpec::space" => spec.space(&model, 1),
                "identify::model::ModelSpec::problem" => spec.problem(&model, vec![recording.clone()]).map(drop),
                "identify::model::ModelSpec::problem" => spec.problem(&model, Vec::new()).map(drop),
            );
            let all = [recording.clone()];
            let found = calls.ask("identify::model::identify_model", &recording, || {
                identify_model(&model, &all, &spec, &mut |_| ControlFlow::Continue(()))
            });
            let Some(mut found) = found else { continue };
            let profiled = calls.ask("identify::model::model_likelihood_profiles", &recording, || {
                model_likelihood_profiles(&model, &all, &spec, &mut |_| ControlFlow::Continue(()))
            });
            if let Some((found, profiles)) = profiled {
                drive!(calls, recording;
                    "report::likelihood_document" => likelihood_document(&[], &found, &profiles));
            }
            ask!(calls, recording;
                "identify::model::hold_out_model" => hold_out_model(&mut found, &all, &all, &spec),
                "identify::model::hold_out_model" => hold_out_model(&mut found, &all, &[], &spec),
                "study::sweep::RunEstimate::from" => {
                    Ok::<_, motorfit::Error>(found.estimates.iter().map(|e| RunEstimate::from(e).name.len()).sum::<usize>())
                },
                "study::sweep::RunEstimates::all" => Ok::<_, motorfit::Error>(RunEstimates::from(&found).all().count()),
                "study::sweep::RunEstimates::from" => Ok::<_, motorfit::Error>(RunEstimates::from(&found)),
                "study::sweep::Outcome::of_model" => Ok::<_, motorfit::Error>(Outcome::of_model(&found, &Limits::default())),
            );
            let shown = format!("{recording:?}");
            drive!(calls, recording; "identify::model::integration" => integration(&found.machine.method));
            of_machine(calls, &shown, &found, std::slice::from_ref(&plain));
            of_shown(calls, &shown, (&spec, &found));
            of_report(calls, &recording, &plain, (&spec, &found));
        }
    }
}

/// Drives what shows a result of a model, with its own model and with another.
fn of_report(
    calls: &mut Calls,
    recording: &ModelRecording,
    plain: &Record,
    (spec, found): (&ModelSpec, &ModelIdentification),
) {
    let other = BuiltIn::Pmsm.model().unwrap();
    let how = Reproduced { command: "x".to_owned(), options: Vec::new() };
    let all = [recording.clone()];
    for of in [&found.machine.model.clone(), &other] {
        calls.ask("report::ModelInspection::of", recording, || {
            ModelInspection::of(of, plain, &mut |_| ControlFlow::Break(())).map(|inspected| inspected.facts.len())
        });
        drive!(calls, recording;
            "report::SignalStatistics::of" => SignalStatistics::of(&recording.time_s[..recording.time_s.len().min(2)]),
            "report::SignalStatistics::of" => SignalStatistics::of(&[]),
            "report::ModelSignalFacts::of" => ModelSignalFacts::of(of, recording).len(),
            "report::Recorded::of_model" => Recorded::of_model(of, recording, true),
            "report::identify_document" => identify_document(&[], spec, found),
            "report::signals_csv" => signals_csv((&[], &[Recorded::of_model(of, recording, true)]), found),
            "report::verdict" => verdict(found),
            "report::identify_page" => {
                let recorded = [Recorded::of_model(of, recording, false)];
                identify_page((std::slice::from_ref(plain), &recorded), spec, found, &how).html(true)
            },
            "report::selection_table" => selection_table(found),
            "report::exported_model" => {
                let of = exported_model(std::slice::from_ref(plain), &all, found);
                ExportFormat::ALL.map(|format| format.write(&of).unwrap_or_else(|e| e.to_string())).len()
            },
            "report::model_inspect_page" => {
                let facts = ModelSignalFacts::of(of, recording);
                let (record, recording, found) = (plain, recording.clone(), Ok(found.clone()));
                model_inspect_page(of, &[ModelInspection { record, recording, facts, found }], &how)
            },
            "report::model_inspect_document" => {
                let facts = ModelSignalFacts::of(of, recording);
                let (record, recording, found) = (plain, recording.clone(), Ok(found.clone()));
                model_inspect_document(of, &[ModelInspection { record, recording, facts, found }])
            },
        );
    }
}
