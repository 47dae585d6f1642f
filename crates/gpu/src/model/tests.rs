//! Shaders of models against the interpreter and the graph, on the adapter of this machine.

#![allow(clippy::unwrap_used, clippy::float_cmp, reason = "a test may stop; equal costs have no error")]

use super::check::check;
use super::loaded::Loaded;
use super::unit::UnitSource;
use crate::{Gpu, Precision, Selector};
use motorfit_core::ErrorKind;
use motorfit_core::candidates::Candidates;
use motorfit_core::numeric::{count, order_statistic};
use motorfit_evaluate::Evaluator as _;
use motorfit_evaluate::criterion::{Criterion, Norm, Scale};
use motorfit_evaluate::model::{ModelProblem, ModelRecording, ModelSettings, ModelSpace};
use motorfit_model::wgsl::ShaderPrecision;
use motorfit_model::{BuiltIn, IntegrationMethod, Model};
use rand::{RngExt as _, SeedableRng as _};
use std::sync::Arc;

/// Opens the best adapter; `None` if there is none and the test may be skipped.
fn open(precision: Precision) -> Option<Gpu> {
    let gpu = Gpu::unchecked(&Selector::Best, Some(precision)).ok();
    assert!(gpu.is_some() || std::env::var_os("MOTORFIT_NO_SKIP").is_none(), "no adapter");
    gpu
}

/// Makes a recording with square waves as inputs and sines as outputs: costs do not need a right answer.
fn recording(model: &Model, samples: usize, step_s: f64) -> ModelRecording {
    let square = |input: usize| -> Vec<f64> {
        let high = |n: usize| n >= 20 && (n / (50 + 20 * input)).is_multiple_of(2);
        (0..samples)
            .map(|n| if high(n) { 2.0 / count(1 + 3 * input) } else { -0.5 * count(usize::from(n > 20)) })
            .collect()
    };
    let sine = |output: usize| Some((0..samples).map(|n| (0.02 * count(n * (output + 1))).sin()).collect());
    ModelRecording {
        time_s: (0..samples).map(|n| step_s * count(n)).collect(),
        step_s: vec![step_s],
        inputs: (0..model.inputs().len()).map(square).collect(),
        measured: (0..model.outputs().len()).map(sine).collect(),
        counting: Vec::new(),
        effective_sample_ratio: 1.0,
        name: None,
        assumed: None,
    }
}

fn candidates(problem: &ModelProblem, number: usize) -> Vec<f64> {
    let axes = &problem.space().free;
    let mut numbers = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(3);
    (0..number * axes.len()).map(|n| axes[n % axes.len()].at(numbers.random::<f64>())).collect()
}

/// Returns the relative errors of the costs of a device, in increasing order; the interpreter is the reference.
fn errors(gpu: &mut Gpu, problem: &Arc<ModelProblem>, number: usize) -> Vec<f64> {
    let values = candidates(problem, number);
    let candidates = Candidates::new(&values, problem.space().free.len());
    let (mut own, mut expected) = (vec![0.0; number], vec![0.0; number]);
    gpu.costs(problem, candidates, &mut own).unwrap();
    problem.costs(candidates, &mut expected).unwrap();
    let pairs = own.iter().zip(&expected).filter(|(a, b)| a.is_finite() || b.is_finite());
    let mut errors: Vec<f64> = pairs.map(|(a, b)| if a == b { 0.0 } else { (a / b - 1.0).abs() }).collect();
    errors.sort_by(f64::total_cmp);
    errors
}

fn problem(model: &Model, recordings: Vec<ModelRecording>, settings: ModelSettings) -> Arc<ModelProblem> {
    Arc::new(ModelProblem::new(model, ModelSpace::new(model, recordings.len()), recordings, settings).unwrap())
}

#[test]
fn shaders_of_all_models_compute_the_costs_of_the_interpreter() {
    // More samples than a round. Rounding alone in f64; in f32 its accumulation. At the bounces of a backlash two computations part.
    for (precision, limits) in [(Precision::F64, [1e-12, 1e-9]), (Precision::F32, [1e-4, 1e-3])] {
        let Some(mut gpu) = open(precision) else { return };
        for of in BuiltIn::ALL {
            let model = of.model().unwrap();
            let step_s = if of == BuiltIn::Pmsm { 1e-4 } else { 1e-3 };
            for method in IntegrationMethod::ALL {
                let settings = ModelSettings { method: Some((method, 1)), ..ModelSettings::default() };
                let problem = problem(&model, vec![recording(&model, 2500, step_s)], settings);
                assert!(gpu.serves_model(&problem).unwrap(), "{}", of.name());
                let errors = errors(&mut gpu, &problem, 200);
                let [median, most] = [0.5, 0.8].map(|part| order_statistic(&mut errors.clone(), part));
                assert!(errors.len() > 100, "{}: {} finite costs", of.name(), errors.len());
                let limit = if of == BuiltIn::TwoMass { 0.5 } else { limits[1] };
                assert!(
                    median < limits[0] && most < limit,
                    "{} {method:?} {precision:?}: {median:e} {most:e}",
                    of.name()
                );
            }
        }
    }
}

#[test]
fn criteria_masks_and_joint_recordings_are_those_of_the_interpreter() {
    let Some(mut gpu) = open(Precision::F64) else { return };
    let model = BuiltIn::DcExtended.model().unwrap();
    for norm in Norm::ALL {
        for scale in [Scale::None, Scale::Std] {
            let criterion = Criterion { norm, scale, ..Criterion::default() };
            let mut masked = recording(&model, 300, 1e-3);
            let counting = |output| (0..300).map(move |n| n % (7 - 2 * (output % 2)) != 3).collect();
            masked.counting = (0..masked.measured.len()).map(counting).collect();
            let mut partial = recording(&model, 400, 5e-4);
            partial.measured[0] = None;
            let settings = ModelSettings { criterion, ..ModelSettings::default() };
            let problem = problem(&model, vec![masked, partial], settings);
            assert!(gpu.serves_model(&problem).unwrap());
            let errors = errors(&mut gpu, &problem, 100);
            assert!(errors.len() == 100 && errors[99] < 1e-10, "{norm:?} {scale:?}: {:e}", errors[99]);
        }
    }
}

/// A model whose outputs are all functions of the language, of an argument that grows.
const FUNCTIONS: &str = r#"
format = 1
name = "functions"
[inputs]
u = { unit = "1/s" }
[parameters]
a = { unit = "1", min = 0.1, max = 3 }
[states]
x = { unit = "1", d = "10*u", initial = 0.01 }
[outputs]
sin   = { unit = "1", value = "sin(a*x*8)" }
cos   = { unit = "1", value = "cos(a*x*8)" }
tan   = { unit = "1", value = "tan(0.5 + 0.1*sin(a*x))" }
exp   = { unit = "1", value = "exp(-a*x)" }
grow  = { unit = "1", value = "exp(a*x)" }
log   = { unit = "1", value = "log(a*abs(x) + 0.01)" }
sqrt  = { unit = "1", value = "sqrt(a*abs(x))" }
tanh  = { unit = "1", value = "tanh(a*x)" }
atan  = { unit = "1", value = "atan(a*x*3)" }
atan2 = { unit = "1", value = "atan2(a*x, cos(3*x))" }
pow   = { unit = "1", value = "abs(x)^a" }
sign  = { unit = "1", value = "sign(x)*a" }
zone  = { unit = "1", value = "deadzone(x, a)" }
clip  = { unit = "1", value = "clamp(x, -a, a) + min(x, a) + max(x, -a)" }
pick  = { unit = "1", value = "select(x < a && x > -a, x, 1/(1 + x*x))" }
"#;

#[test]
fn functions_of_shaders_are_those_of_the_interpreter() {
    let model = Model::parse(FUNCTIONS).unwrap();
    let samples = 500;
    for (precision, limit) in [(Precision::F64, 1e-12), (Precision::F32, 2e-4)] {
        let Some(mut gpu) = open(precision) else { return };
        for output in 0..model.outputs().len() {
            let mut one = recording(&model, samples, 1e-3);
            one.inputs[0] = (0..samples).map(|n| if n < 200 { 1.0 } else { -1.0 }).collect();
            one.measured = vec![None; model.outputs().len()];
            one.measured[output] = Some(vec![0.0; samples]);
            let criterion = Criterion { scale: Scale::None, ..Criterion::default() };
            let problem = problem(&model, vec![one], ModelSettings { criterion, ..ModelSettings::default() });
            assert!(gpu.serves_model(&problem).unwrap());
            let errors = errors(&mut gpu, &problem, 64);
            let worst = errors.last().copied().unwrap();
            assert!(errors.len() == 64 && worst < limit, "{} {precision:?}: {worst:e}", model.outputs()[output].name);
        }
    }
}

/// A delayed signal in an output, and a law that is sampled every fourth sample.
const LATE_AND_SAMPLED: &str = r#"
format = 1
name = "late and sampled"
[inputs]
v = { unit = "V" }
[constants]
Ts = { value = 4, unit = "ms" }
[parameters]
R  = { unit = "ohm", min = 0.1, max = 10 }
td = { unit = "s", min = 0, max = 0.02 }
T  = { unit = "s", min = 0.005, max = 0.1 }
kp = { unit = "1", min = 0.1, max = 3 }
[signals]
vm = { value = "v", unit = "V", delay = "td" }
[let]
u = "hold(clamp(kp*(v - h), -v0, v0), Ts)"
[states]
h = { unit = "V", d = "(vm + u - h)/T", initial = 0 }
[outputs]
i = { value = "vm/R", unit = "A" }
u = { value = "u", unit = "V" }
h = { value = "h", unit = "V" }
"#;

#[test]
fn late_signals_in_outputs_and_sampled_laws_are_those_of_the_interpreter() {
    let text = LATE_AND_SAMPLED.replace("[constants]", "[constants]\nv0 = { value = 1, unit = \"V\" }");
    let model = Model::parse(&text).unwrap();
    // In f32 a delay near a jump has another value.
    for (precision, limit) in [(Precision::F64, 1e-10), (Precision::F32, 1e-3)] {
        let Some(mut gpu) = open(precision) else { return };
        for (method, substeps) in IntegrationMethod::ALL.into_iter().flat_map(|method| [1, 3].map(|n| (method, n))) {
            let settings = ModelSettings { method: Some((method, substeps)), ..ModelSettings::default() };
            let problem = problem(&model, vec![recording(&model, 2500, 1e-3)], settings);
            assert!(gpu.serves_model(&problem).unwrap());
            let errors = errors(&mut gpu, &problem, 100);
            let most = order_statistic(&mut errors.clone(), 0.95);
            assert!(errors.len() == 100 && most < limit, "{method:?} {substeps} {precision:?}: {most:e}");
        }
    }
}

#[test]
fn friction_of_joints_that_act_on_each_other_is_that_of_the_interpreter() {
    let model = Model::parse(include_str!("../../../../examples/two-links.toml")).unwrap();
    // In f32 rounding decides now and then whether a joint rests in a step.
    for (precision, limit) in [(Precision::F64, 1e-9), (Precision::F32, 1e-2)] {
        let Some(mut gpu) = open(precision) else { return };
        for method in IntegrationMethod::ALL {
            let settings = ModelSettings { method: Some((method, 2)), ..ModelSettings::default() };
            let problem = problem(&model, vec![recording(&model, 2500, 1e-3)], settings);
            assert!(gpu.serves_model(&problem).unwrap());
            let errors = errors(&mut gpu, &problem, 200);
            let most = order_statistic(&mut errors.clone(), 0.9);
            assert!(errors.len() > 100 && most < limit, "{method:?} {precision:?}: {} {most:e}", errors.len());
        }
    }
}

#[test]
fn a_wrong_shader_is_refused() {
    let Some(gpu) = open(Precision::F64) else { return };
    let device = &gpu.device;
    let model = BuiltIn::Pmsm.model().unwrap();
    let problem = problem(&model, vec![recording(&model, 300, 1e-4)], ModelSettings::default());
    let source = UnitSource::new(&problem, 0, ShaderPrecision::F64).unwrap();
    let mut right = Loaded::of_sources(device, std::slice::from_ref(&source), ShaderPrecision::F64).unwrap();
    check(device, &mut right, &problem, ShaderPrecision::F64).unwrap();
    // An error in the sixth digit of one sum.
    let shader = source.shader.replace("sum1 = fma(", "sum1 = Scalar(1.000001) * fma(");
    assert_ne!(shader, source.shader);
    let wrong = UnitSource { shader, ..source };
    let mut wrong = Loaded::of_sources(device, &[wrong], ShaderPrecision::F64).unwrap();
    let error = check(device, &mut wrong, &problem, ShaderPrecision::F64).unwrap_err();
    assert!(error.kind() == ErrorKind::Device && error.to_string().contains("computes the model"), "{error}");
}

#[test]
fn a_lost_device_is_an_error() {
    let Some(mut gpu) = open(Precision::F64) else { return };
    let model = BuiltIn::DcMotor.model().unwrap();
    let problem = problem(&model, vec![recording(&model, 300, 1e-3)], ModelSettings::default());
    let values = candidates(&problem, 10);
    let candidates = Candidates::new(&values, problem.space().free.len());
    let mut costs = [0.0; 10];
    gpu.costs(&problem, candidates, &mut costs).unwrap();
    gpu.device.device.destroy();
    for _ in 0..2 {
        let error = gpu.costs(&problem, candidates, &mut costs).unwrap_err();
        assert!(error.kind() == ErrorKind::Device && !error.hint().is_empty(), "{error}");
    }
}

#[test]
fn moving_averages_are_evaluated_on_the_cpu() {
    let Some(mut gpu) = open(Precision::F64) else { return };
    let text = FUNCTIONS.replace("value = \"sin(a*x*8)\"", "value = \"sin(a*x*8)\", average = 4");
    let model = Model::parse(&text).unwrap();
    let problem = problem(&model, vec![recording(&model, 100, 1e-3)], ModelSettings::default());
    assert!(!gpu.serves_model(&problem).unwrap());
    let errors = errors(&mut gpu, &problem, 20);
    assert!(errors.iter().all(|error| *error == 0.0), "{errors:?}");
}
