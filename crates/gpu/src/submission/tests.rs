//! A host that drives a device by the bytes of submissions alone, compared with the scalar evaluator.

use super::super::device::{Device, Selector};
use super::super::pipelines::compile;
use super::*;
use motorfit_evaluate::criterion::{Criterion, Norm};
use motorfit_evaluate::{Model, Scalar};
use motorfit_motor::{Axis, Parameter, Scope, Space};
use motorfit_record::{Record, Samples};
use std::sync::atomic::AtomicBool;

/// Returns the sums of a submission, by its public functions alone.
fn sums(device: &Device, submission: &Submission, candidates: Candidates<'_>) -> Vec<u8> {
    let bound = submission.buffers();
    let [maps, result] = submission.bindings();
    let kinds: Vec<BufferBindingType> = bound
        .iter()
        .map(|of| match of.kind {
            BufferKind::Uniform => BufferBindingType::Uniform,
            BufferKind::Read => BufferBindingType::Storage { read_only: true },
            BufferKind::Write => BufferBindingType::Storage { read_only: false },
        })
        .collect();
    let (layout, pipeline) = compile(device, &submission.shader(), &kinds, 0);
    let own = &device.device;
    let create = |size: usize, usage| {
        let descriptor = wgpu::BufferDescriptor { label: None, size: size as u64, usage, mapped_at_creation: false };
        own.create_buffer(&descriptor)
    };
    let buffers: Vec<wgpu::Buffer> =
        bound.iter().map(|of| create(of.size, wgpu::BufferUsages::from_bits(of.usage).unwrap())).collect();
    for (of, buffer) in bound.iter().zip(&buffers) {
        let bytes = if of.binding == maps { submission.maps(candidates).unwrap() } else { of.bytes.clone() };
        if !bytes.is_empty() {
            device.queue.write_buffer(buffer, 0, &bytes);
        }
    }
    let entry = |(of, buffer): (&BufferBinding, _)| {
        let size = wgpu::BufferSize::new(of.binding_size as u64);
        let resource = wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: 0, size });
        wgpu::BindGroupEntry { binding: of.binding, resource }
    };
    let entries: Vec<_> = bound.iter().zip(&buffers).map(entry).collect();
    let group = own.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout: &layout, entries: &entries });
    let [rounds, distance] = submission.rounds();
    let [x, y] = submission.workgroups();
    let mut encoder = own.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    for round in 0..rounds {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[round * distance]);
        pass.dispatch_workgroups(x, y, 1);
    }
    let size = bound[result as usize].size;
    let read_back = create(size, wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
    encoder.copy_buffer_to_buffer(&buffers[result as usize], 0, &read_back, 0, size as u64);
    let submitted = device.queue.submit([encoder.finish()]);
    read_back.slice(..).map_async(wgpu::MapMode::Read, |_| {});
    device.wait(submitted, submission.steps(), &AtomicBool::new(false)).unwrap();
    read_back.slice(..).get_mapped_range().unwrap().to_vec()
}

/// Returns a recording with a step of the voltage.
fn recording() -> Record {
    let time_s: Vec<f64> = (0..400).map(|n| 1e-3 * f64::from(n)).collect();
    let of =
        |scale: f64, rate: f64| time_s.iter().map(|t| scale * (1.0 - (-(t - 0.05).max(0.0) * rate).exp())).collect();
    let samples = Samples {
        voltage: time_s.iter().map(|t| if *t < 0.05 { 0.0 } else { 10.0 }).collect(),
        current: Some(of(1.5, 60.0)),
        speed: Some(of(120.0, 20.0)),
        time_s,
        ..Samples::default()
    };
    Record::new(samples).unwrap()
}

#[test]
fn a_host_gets_the_costs_of_the_scalar_evaluator_from_the_bytes() {
    let Ok(device) = Device::open(&Selector::Best, false) else {
        assert!(std::env::var_os("MOTORFIT_NO_SKIP").is_none(), "no adapter");
        return;
    };
    let dead_time = Axis { parameter: Parameter::DeadTime, scope: Scope::Shared, min: 1e-4, max: 2e-2 };
    let delayed = Space::new([Space::table2().free(), &[dead_time]].concat(), Vec::new()).unwrap();
    // The bounds are those of the contract suite for f32 in deviations and without.
    for (space, norm, bound) in
        [(Space::table2(), Norm::Nrmse, 2e-5), (Space::table2(), Norm::Iae, 2e-5), (delayed, Norm::Nrmse, 1e-4)]
    {
        let criterion = Criterion { norm, ..Criterion::default() };
        let records = [recording(), recording()];
        let problem = Arc::new(Problem::new(&records, Model::default(), space, criterion).unwrap());
        let bounds = problem.space().bounds();
        let values: Vec<f64> = (0..101_u32)
            .flat_map(|n| bounds.iter().map(move |(min, max)| min * (max / min).powf(0.35 + 0.003 * f64::from(n))))
            .collect();
        let candidates = Candidates::new(&values, bounds.len());
        let submission = Submission::new(&problem, candidates.count(), None).unwrap();
        let costs = submission.costs(candidates, &sums(&device, &submission, candidates)).unwrap();
        for (row, cost) in costs.iter().enumerate() {
            let oracle = Scalar::cost(&problem, candidates.row(row));
            assert!((cost / oracle - 1.0).abs() < bound, "{norm:?} {row}: {cost} instead of {oracle}");
        }
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    let problem =
        Arc::new(Problem::new(&[recording()], Model::default(), Space::table2(), Criterion::default()).unwrap());
    assert!(Submission::new(&problem, 0, None).is_err());
    assert!(Submission::new(&problem, usize::MAX, None).is_err());
    // A candidate of one step has 14 numbers and a limit.
    assert_eq!(Submission::candidates_max(&problem), (32 << 20) / 60);
    assert!(Submission::new(&problem, (32 << 20) / 60 + 1, None).is_err());
    assert!(Submission::new(&problem, 3, Some(&[1.0])).is_err());
    let submission = Submission::new(&problem, 3, None).unwrap();
    let (right, wrong) = ([0.1; 15], [0.1; 10]);
    assert!(submission.maps(Candidates::new(&wrong, 5)).is_err());
    assert!(submission.costs(Candidates::new(&right, 5), &[0; 16]).is_err());
    assert!(submission.costs(Candidates::new(&right, 5), &[0; 32]).is_ok());
}
