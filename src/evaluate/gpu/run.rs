//! Buffers, pipelines and submissions. Buffers are kept and grow; a submission is one encoder with the copy-back in it.

use super::device::Device;
use super::layout::Scene;
use super::maps::write_maps;
use super::shader::{LANES, Precision, UNIFORM_BYTES, Variant, assemble};
use crate::evaluate::Group;
use crate::{Error, ErrorKind, Result};
use std::collections::HashMap;
use std::collections::hash_map::Entry;

/// Most workgroups in one dimension.
const DISPATCH_MAX: u32 = 65_535;
/// Bytes between the uniforms of rounds: the alignment that every device accepts.
const ROUND_BYTES: usize = 256;
const BINDINGS: usize = 9;

/// Pipelines of one device by variant.
#[derive(Default)]
pub(super) struct Pipelines(HashMap<Variant, (wgpu::BindGroupLayout, wgpu::ComputePipeline)>);

impl Pipelines {
    fn get(&mut self, device: &Device, variant: Variant) -> Result<&(wgpu::BindGroupLayout, wgpu::ComputePipeline)> {
        match self.0.entry(variant) {
            Entry::Occupied(made) => Ok(made.into_mut()),
            Entry::Vacant(place) => {
                let made = make(device, variant);
                device.check()?;
                Ok(place.insert(made))
            }
        }
    }
}

fn make(device: &Device, variant: Variant) -> (wgpu::BindGroupLayout, wgpu::ComputePipeline) {
    let device = &device.device;
    let storage = |read_only| wgpu::BufferBindingType::Storage { read_only };
    let entry = |binding: usize| {
        let ty = match binding {
            0 => wgpu::BufferBindingType::Uniform,
            4 if variant.uniform => wgpu::BufferBindingType::Uniform,
            7 | 8 => storage(false),
            _ => storage(true),
        };
        #[expect(clippy::cast_possible_truncation, reason = "nine bindings")]
        wgpu::BindGroupLayoutEntry {
            binding: binding as u32,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: binding == 0, min_binding_size: None },
            count: None,
        }
    };
    let entries: Vec<wgpu::BindGroupLayoutEntry> = (0..BINDINGS).map(entry).collect();
    let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries });
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("motorfit evaluate"),
        source: wgpu::ShaderSource::Wgsl(assemble(variant).into()),
    });
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(&layout)],
        immediate_size: 0,
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("motorfit evaluate"),
        layout: Some(&pipeline_layout),
        module: &module,
        entry_point: Some("evaluate"),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    (layout, pipeline)
}

/// The buffers of one submission in flight.
#[derive(Default)]
pub(super) struct Set {
    pub scene: Option<Scene>,
    maps: Vec<u8>,
    buffers: [Option<wgpu::Buffer>; BINDINGS],
    read_back: Option<wgpu::Buffer>,
    bind_group: Option<(Variant, wgpu::BindGroup)>,
}

/// A submission that has not been collected.
pub(super) struct Ticket {
    submission: wgpu::SubmissionIndex,
    bytes: u64,
    precision: Precision,
    steps: u64,
}

impl Set {
    /// Uploads and starts groups that need the shader `variant`. What the last submission of this set left on the
    /// device is used again where it fits.
    pub(super) fn submit(
        &mut self,
        device: &Device,
        pipelines: &mut Pipelines,
        groups: &[Group<'_>],
        variant: Variant,
    ) -> Result<Ticket> {
        let scene = match self.scene.take() {
            Some(scene) if scene.serves(groups, variant) => scene,
            _ => {
                let scene = Scene::new(groups, variant);
                self.upload(device, &scene)?;
                scene
            }
        };
        let variant = scene.variant;
        let mut maps = std::mem::take(&mut self.maps);
        write_maps(groups, &scene.units, variant.precision, &mut maps);
        self.write(device, 6, &maps, 0)?;
        self.maps = maps;
        let result = scene.blocks * 2 * LANES * variant.precision.bytes();
        self.ensure(device, 7, result, wgpu::BufferUsages::STORAGE)?;
        self.ensure(device, 8, result, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC)?;
        if self.read_back.as_ref().is_none_or(|b| b.size() < result as u64) {
            let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
            self.read_back = Some(buffer(device, result, usage)?);
        }
        let pipeline = pipelines.get(device, variant)?;
        self.bind(device, &pipeline.0, variant);
        let submission = self.start(device, &pipeline.1, &scene, result as u64)?;
        device.check()?;
        let steps = scene.steps;
        self.scene = Some(scene);
        Ok(Ticket { submission, bytes: result as u64, precision: variant.precision, steps })
    }

    fn upload(&mut self, device: &Device, scene: &Scene) -> Result<()> {
        let round = |index: u32| {
            let mut bytes = [0; ROUND_BYTES];
            bytes[..4].copy_from_slice(&index.to_ne_bytes());
            bytes[4..8].copy_from_slice(&scene.job_count.to_ne_bytes());
            bytes
        };
        let rounds: Vec<u8> = (0..scene.rounds).flat_map(round).collect();
        self.write(device, 0, &rounds, 0)?;
        self.write(device, 1, bytemuck::cast_slice(&scene.jobs), 0)?;
        self.write(device, 2, bytemuck::cast_slice(&scene.segments), 0)?;
        self.write(device, 3, &scene.inputs.bytes, 0)?;
        self.write(device, 4, &scene.samples.bytes, UNIFORM_BYTES)?;
        self.write(device, 5, &scene.weights.bytes, 0)
    }

    /// Puts bytes into a buffer of at least `least` bytes.
    fn write(&mut self, device: &Device, binding: usize, bytes: &[u8], least: usize) -> Result<()> {
        let usage = match binding {
            0 => wgpu::BufferUsages::UNIFORM,
            4 => wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::STORAGE,
            _ => wgpu::BufferUsages::STORAGE,
        };
        self.ensure(device, binding, bytes.len().max(least), usage | wgpu::BufferUsages::COPY_DST)?;
        if let Some(buffer) = &self.buffers[binding] {
            device.queue.write_buffer(buffer, 0, bytes);
        }
        Ok(())
    }

    fn start(
        &self,
        device: &Device,
        pipeline: &wgpu::ComputePipeline,
        scene: &Scene,
        bytes: u64,
    ) -> Result<wgpu::SubmissionIndex> {
        let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let (Some((_, bind_group)), Some(sums), Some(read_back)) =
            (&self.bind_group, &self.buffers[8], &self.read_back)
        else {
            return Err(lost());
        };
        for round in 0..scene.rounds {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(pipeline);
            #[expect(clippy::cast_possible_truncation, reason = "256")]
            pass.set_bind_group(0, bind_group, &[round * ROUND_BYTES as u32]);
            let x = scene.job_count.min(DISPATCH_MAX);
            pass.dispatch_workgroups(x, scene.job_count.div_ceil(x.max(1)), 1);
        }
        encoder.copy_buffer_to_buffer(sums, 0, read_back, 0, bytes);
        let submission = device.queue.submit([encoder.finish()]);
        read_back.slice(..bytes).map_async(wgpu::MapMode::Read, |_| {});
        Ok(submission)
    }

    /// Waits for a submission and hands its sums to `read`: per block those of current, then those of speed.
    pub(super) fn collect(&self, device: &Device, ticket: Ticket, read: &mut dyn FnMut(&[f64])) -> Result<()> {
        device.wait(ticket.submission, ticket.steps)?;
        let buffer = self.read_back.as_ref().ok_or_else(lost)?;
        let view = buffer.slice(..ticket.bytes).get_mapped_range().map_err(|e| {
            Error::new(ErrorKind::Device, format!("{}: results cannot be read: {e}", device.facts.name), "Run again.")
        })?;
        match ticket.precision {
            Precision::F32 => {
                let sums = view.chunks_exact(4).map(|b| f64::from(f32::from_ne_bytes([b[0], b[1], b[2], b[3]])));
                read(&sums.collect::<Vec<f64>>());
            }
            Precision::F64 => {
                let sums =
                    view.chunks_exact(8).map(|b| f64::from_ne_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]]));
                read(&sums.collect::<Vec<f64>>());
            }
        }
        drop(view);
        buffer.unmap();
        Ok(())
    }

    /// A buffer of at least `size` bytes; a new one ends the bind group.
    fn ensure(&mut self, device: &Device, binding: usize, size: usize, usage: wgpu::BufferUsages) -> Result<()> {
        if self.buffers[binding].as_ref().is_none_or(|b| b.size() < size as u64) {
            self.buffers[binding] = Some(buffer(device, size, usage)?);
            self.bind_group = None;
        }
        Ok(())
    }

    fn bind(&mut self, device: &Device, layout: &wgpu::BindGroupLayout, variant: Variant) {
        if self.bind_group.as_ref().is_some_and(|(of, _)| *of == variant) {
            return;
        }
        let resource = |binding: usize, buffer: &'_ wgpu::Buffer| {
            let size = match binding {
                0 => Some(ROUND_BYTES as u64),
                4 if variant.uniform => Some(UNIFORM_BYTES as u64),
                _ => None,
            };
            let buffer = buffer.clone();
            (buffer, size.and_then(wgpu::BufferSize::new))
        };
        let bound: Vec<(wgpu::Buffer, Option<wgpu::BufferSize>)> =
            self.buffers.iter().flatten().enumerate().map(|(n, b)| resource(n, b)).collect();
        #[expect(clippy::cast_possible_truncation, reason = "nine bindings")]
        let entries: Vec<wgpu::BindGroupEntry<'_>> = bound
            .iter()
            .enumerate()
            .map(|(n, (buffer, size))| wgpu::BindGroupEntry {
                binding: n as u32,
                resource: wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: 0, size: *size }),
            })
            .collect();
        let descriptor = wgpu::BindGroupDescriptor { label: None, layout, entries: &entries };
        self.bind_group = Some((variant, device.device.create_bind_group(&descriptor)));
    }
}

fn lost() -> Error {
    Error::new(ErrorKind::Device, "the device has lost its buffers", "Run again.")
}

/// Buffers grow by half, so that a slowly growing batch does not make a new one each time.
fn buffer(device: &Device, size: usize, usage: wgpu::BufferUsages) -> Result<wgpu::Buffer> {
    let limits = device.device.limits();
    let limit = usize::try_from(limits.max_buffer_size.min(device.facts.binding_bytes_max)).unwrap_or(usize::MAX);
    if size > limit {
        return Err(Error::new(
            ErrorKind::Device,
            format!("a recording needs a buffer of {size} bytes; {} has {limit}", device.facts.name),
            "Use --device cpu, or cut the recording.",
        ));
    }
    let size = (size + size / 2).next_multiple_of(ROUND_BYTES).max(UNIFORM_BYTES).min(limit) & !3;
    let descriptor = wgpu::BufferDescriptor { label: None, size: size as u64, usage, mapped_at_creation: false };
    let buffer = device.device.create_buffer(&descriptor);
    device.check()?;
    Ok(buffer)
}
