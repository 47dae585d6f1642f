//! Tests of device faults and of the reuse of buffers, with access to private fields.

use super::super::constants::is_beyond;
use super::super::variant::Fetch;
use super::*;
use motorfit_core::candidates::Candidates;
use motorfit_evaluate::Problem;
use motorfit_evaluate::criterion::Criterion;
use motorfit_evaluate::{Model, Scalar};
use motorfit_motor::{Parameter, Space};
use motorfit_record::{Record, Samples};
use std::sync::Arc;
use std::time::Duration;

/// Opens the best adapter; `None` if there is none and the test may be skipped.
fn open() -> Option<Gpu> {
    let gpu = Gpu::open(&Selector::Best, None).ok();
    assert!(gpu.is_some() || std::env::var_os("MOTORFIT_NO_SKIP").is_none(), "no adapter");
    gpu
}

fn usual(gpu: &Gpu) -> Variant {
    let (precision, fetch) = (gpu.precision, Fetch::Direct);
    Variant { precision, absolute: false, weighted: false, uniform: true, fetch, features: None }
}

fn specimen(gpu: &Gpu) -> (Arc<Problem>, Vec<f64>) {
    let Specimen { problem, values, .. } = Specimen::new(usual(gpu)).unwrap();
    (problem, values)
}

fn evaluate(gpu: &mut Gpu, problem: &Arc<Problem>, values: &[f64]) -> Result<Vec<f64>> {
    let groups = [Group { problem, candidates: Candidates::new(values, 5), reference: None }];
    let mut costs = vec![0.0; values.len() / 5];
    gpu.evaluate(&Batch { groups: &groups }, &mut costs)?;
    Ok(costs)
}

#[test]
fn a_lost_device_is_an_error() {
    let Some(mut gpu) = open() else { return };
    let (problem, values) = specimen(&gpu);
    evaluate(&mut gpu, &problem, &values).unwrap();
    gpu.device.device.destroy();
    let lost = evaluate(&mut gpu, &problem, &values).unwrap_err();
    assert_eq!(lost.kind(), ErrorKind::Device);
    assert!(!lost.hint().is_empty(), "{lost}");
    let again = evaluate(&mut gpu, &problem, &values).unwrap_err();
    assert_eq!(again.kind(), ErrorKind::Device, "and stays one");
}

#[test]
fn a_device_with_wrong_costs_is_refused() {
    let Some(mut gpu) = open() else { return };
    let (problem, values) = specimen(&gpu);
    let costs = evaluate(&mut gpu, &problem, &values).unwrap();
    let specimen = Specimen::new(usual(&gpu)).unwrap();
    let compare = |costs: &[f64]| specimen.compare(&gpu.device.facts, gpu.precision, costs);
    compare(&costs).unwrap();
    // The cost of the first candidate may be any number above its cutoff, a fifth of it.
    let first = |factor: f64| [&[factor * costs[0]], &costs[1..]].concat();
    compare(&first(0.21)).unwrap();
    compare(&first(0.19)).unwrap_err();
    let wrong = compare(&costs.iter().map(|c| c * 1.001).collect::<Vec<_>>()).unwrap_err();
    assert_eq!(wrong.kind(), ErrorKind::Device);
    let text = wrong.to_string();
    assert!(text.contains("computes wrongly") && text.contains(&gpu.device.facts.name), "{text}");
}

#[test]
fn a_dispatch_that_does_not_end_is_an_error() {
    let Some(mut gpu) = open() else { return };
    let (problem, values) = specimen(&gpu);
    // The time limit is zero, and the work is too short to extend it.
    let many: Vec<f64> = values.iter().copied().cycle().take(5 * 50_000).collect();
    gpu.device.patience = Duration::ZERO;
    let steps = (50_000 * problem.active() as u64) / 20_000_000;
    assert_eq!(steps, 0);
    let hung = evaluate(&mut gpu, &problem, &many).unwrap_err();
    assert_eq!(hung.kind(), ErrorKind::Device);
    assert!(hung.to_string().contains("did not finish within"), "{hung}");
}

#[test]
fn too_little_memory_is_an_error() {
    let Some(mut gpu) = open() else { return };
    let (problem, values) = specimen(&gpu);
    // An allocation that the driver refuses is an error, not a panic of wgpu's default handler.
    let size = gpu.device.device.limits().max_buffer_size + 4;
    let usage = wgpu::BufferUsages::STORAGE;
    let descriptor = wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false };
    drop(gpu.device.device.create_buffer(&descriptor));
    let refused = gpu.device.check().unwrap_err();
    assert_eq!(refused.kind(), ErrorKind::Device);
    // A recording that is larger than the largest buffer.
    gpu.device.facts.binding_bytes_max = 1024;
    gpu.sets.clear();
    let large = evaluate(&mut gpu, &problem, &values).unwrap_err();
    assert!(large.to_string().contains("needs a buffer of"), "{large}");
}

fn buffers(gpu: &Gpu) -> Vec<wgpu::Buffer> {
    let of = |set: &Set| set.buffers.iter().chain([&set.upload, &set.read_back]).flatten().cloned().collect::<Vec<_>>();
    gpu.sets.iter().flat_map(of).collect()
}

#[test]
fn the_steady_state_makes_no_buffers_and_two_batches_overlap() {
    let Some(mut gpu) = open() else { return };
    let (problem, values) = specimen(&gpu);
    // With a small budget the batch takes four submissions, two at a time.
    gpu.budget = 10 * usual(&gpu).fields() * gpu.precision.bytes();
    let whole = evaluate(&mut gpu, &problem, &values).unwrap();
    let oracle: Vec<f64> = values.chunks(5).map(|row| Scalar::cost(&problem, row)).collect();
    Specimen::new(usual(&gpu)).unwrap().compare(&gpu.device.facts, gpu.precision, &whole).unwrap();
    assert!((FLIGHTS..=SETS).contains(&gpu.sets.len()), "{}", gpu.sets.len());
    let made = buffers(&gpu);
    for _ in 0..3 {
        assert_eq!(evaluate(&mut gpu, &problem, &values).unwrap(), whole);
    }
    assert_eq!(buffers(&gpu), made);
    // Two batches in flight are finished in reverse order.
    gpu.budget = 1 << 20;
    let candidates = Candidates::new(&values, 5);
    let first = [Group { problem: &problem, candidates, reference: None }];
    let second = [Group { problem: &problem, candidates: Candidates::new(&values[..35], 5), reference: None }];
    let (first, second) = (Batch { groups: &first }, Batch { groups: &second });
    let (a, b) = (gpu.begin(&first).unwrap(), gpu.begin(&second).unwrap());
    let mut costs = vec![0.0; oracle.len()];
    gpu.finish(&second, b, &mut costs[..7]).unwrap();
    assert_eq!(costs[..7], whole[..7]);
    gpu.finish(&first, a, &mut costs).unwrap();
    assert_eq!(costs, whole);
    // More pending batches than sets are an error, after which the evaluator still works.
    let mut pending: Vec<Pending> = (0..SETS).map(|_| gpu.begin(&second).unwrap()).collect();
    assert_eq!(gpu.begin(&second).err().unwrap().kind(), ErrorKind::Usage);
    for pending in pending.drain(..) {
        gpu.finish(&second, pending, &mut costs[..7]).unwrap();
        assert_eq!(costs[..7], whole[..7]);
    }
}

#[test]
fn a_timed_evaluation_returns_the_computing_time() {
    let Some(mut gpu) = open() else { return };
    let (problem, values) = specimen(&gpu);
    let many: Vec<f64> = values.iter().copied().cycle().take(5 * 20_000).collect();
    let groups = [Group { problem: &problem, candidates: Candidates::new(&many, 5), reference: None }];
    let (mut plain, mut timed) = (vec![0.0; 20_000], vec![0.0; 20_000]);
    // The first evaluation allocates the buffers.
    for _ in 0..2 {
        gpu.evaluate(&Batch { groups: &groups }, &mut plain).unwrap();
    }
    let begun = std::time::Instant::now();
    let kernel = gpu.evaluate_timed(&Batch { groups: &groups }, &mut timed).unwrap();
    let whole = begun.elapsed().as_secs_f64();
    assert_eq!(plain, timed);
    if gpu.device.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
        let kernel = kernel.unwrap();
        assert!(kernel > 0.0 && kernel < whole, "{kernel} s of {whole} s");
    } else {
        assert_eq!(kernel, None);
    }
}

#[test]
fn every_part_of_extended_shaders_is_correct_and_checked() {
    let Some(mut gpu) = open() else { return };
    for precision in [gpu.precision, Precision::F32Plain] {
        for bits in 0..16_u8 {
            let [brushes, delayed, current, speed] = [1, 2, 4, 8].map(|bit| bits & bit != 0);
            let features = ShaderFeatures { brushes, delayed, averages: [current, speed] };
            let variant = Variant { precision, features: Some(features), ..usual(&gpu) };
            gpu.check_shader(variant).unwrap_or_else(|e| panic!("{variant:?}: {e}"));
            assert!(gpu.checked.contains(&variant));
        }
    }
    // The problem of the check is evaluated on the device, by the shader that it checks.
    let features = ShaderFeatures { brushes: true, delayed: true, averages: [true; 2] };
    let Specimen { problem, values, .. } = Specimen::new(Variant { features: Some(features), ..usual(&gpu) }).unwrap();
    let candidates = Candidates::new(&values, problem.space().free().len());
    let group = Group { problem: &problem, candidates, reference: None };
    assert!(is_served(&problem, 8, gpu.budget));
    assert_eq!(gpu.variant(&group).features, Some(features));
}

#[test]
fn problems_that_the_device_does_not_serve_are_evaluated_on_the_cpu() {
    let record = |uneven: f64| {
        let time_s = (0..50_u32).map(|n| f64::from(n) * 1e-3 + if n == 20 { uneven } else { 0.0 }).collect();
        let speed = (0..50_u32).map(f64::from).collect();
        let voltage = vec![1.0; 50];
        Record::new(Samples { time_s, voltage, torque: None, current: None, speed: Some(speed), ..Samples::default() })
            .unwrap()
    };
    let problem = |uneven: f64, extension: Parameter, max: f64| {
        let space = Space::table2_with(&[(extension, 1.0, max)], &[]).unwrap();
        Problem::new(&[record(uneven)], Model::default(), space, Criterion::default()).unwrap()
    };
    let serves = |uneven: f64, extension: Parameter, max: f64, budget: usize| {
        is_served(&problem(uneven, extension, max), 8, budget)
    };
    assert!(serves(0.0, Parameter::DeadTime, 2.0, 1 << 20));
    assert!(!serves(3e-4, Parameter::DeadTime, 2.0, 1 << 20), "late on an uneven clock");
    assert!(serves(3e-4, Parameter::Coulomb, 2.0, 1 << 20));
    assert!(serves(3e-4, Parameter::SpeedAverage, 9.0, 1 << 20));
    // Each of two candidates stores 16 past values and 4 states of 8 bytes.
    assert!(serves(0.0, Parameter::SpeedAverage, 9.0, 320));
    assert!(!serves(0.0, Parameter::SpeedAverage, 9.0, 319), "more than the budget");
    assert!(serves(0.0, Parameter::SpeedAverage, 1e9, 2 * (64 + 4) * 8), "no more than all samples");
    let beyond =
        |window: f64| is_beyond(&problem(0.0, Parameter::SpeedAverage, 9.0), &[1.0, 1.0, 1.0, 1.0, 1.0, window]);
    assert!(!beyond(9.0) && beyond(9.1) && beyond(f64::INFINITY));
}
