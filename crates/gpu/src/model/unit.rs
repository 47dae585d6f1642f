//! A recording of a model on the device: its shader and its rows.

use super::super::device::{Device, again, error};
use super::super::pipelines::compile;
use motorfit_core::Result;
use motorfit_core::numeric::single;
use motorfit_evaluate::interpreter::Loss;
use motorfit_evaluate::model::ModelProblem;
use motorfit_model::program::Operation;
use motorfit_model::step::MemoryKind;
use motorfit_model::wgsl::{HEAD, Layout, ShaderPrecision, ShaderSettings, shader};

/// Number of invocations of a workgroup.
pub(super) const WORKGROUP: u32 = 64;

/// A recording with its shader, before it is on the device.
pub(super) struct UnitSource {
    pub layout: Layout,
    pub shader: String,
    /// Head and rows, as bytes.
    pub rows: Vec<u8>,
    pub samples: usize,
}

impl UnitSource {
    /// Makes the shader and the rows of a recording; `None` if a shader cannot evaluate it.
    pub(super) fn new(problem: &ModelProblem, recording: usize, precision: ShaderPrecision) -> Option<Self> {
        let (programs, prepared) = problem.prepared(recording);
        let (program, rows) = (&programs.program, &prepared.rows);
        let has_delay = program.body.iter().any(|one| one.operation == Operation::Memory(MemoryKind::Delay));
        if has_delay && rows.clock.step_s.len() != 1 {
            return None;
        }
        let measured: Vec<bool> = prepared.factors.iter().map(|factor| *factor > 0.0).collect();
        let layout = Layout::new(program, &measured, prepared.loss != Loss::Squares);
        let settings = ShaderSettings {
            precision,
            is_absolute: prepared.loss == Loss::WeightedMagnitudes,
            workgroup: WORKGROUP as usize,
        };
        let shader = shader(program, &layout, &settings)?;
        let outputs = program.outputs;
        let mut numbers = Vec::with_capacity(HEAD + rows.samples * layout.row());
        numbers.extend([rows.clock.step_s.first().copied().unwrap_or(1.0), rows.clock.first_change_s.min(1e30)]);
        for n in 0..rows.samples {
            numbers.extend(&rows.uniforms[n * layout.uniforms..(n + 1) * layout.uniforms]);
            numbers.extend(layout.measured.iter().map(|output| rows.measured[n * outputs + output]));
            if layout.is_weighted {
                numbers.extend(layout.measured.iter().map(|output| rows.weights[n * outputs + output]));
            }
        }
        let samples = rows.samples;
        let mut rows = vec![0; numbers.len() * precision.bytes()];
        put(&mut rows, numbers.iter(), precision);
        Some(Self { layout, shader, rows, samples })
    }
}

/// Writes numbers in the precision of a shader.
pub(super) fn put<'a>(to: &mut [u8], numbers: impl Iterator<Item = &'a f64>, precision: ShaderPrecision) {
    let each = to.chunks_exact_mut(precision.bytes()).zip(numbers);
    match precision {
        ShaderPrecision::F64 => each.for_each(|(to, number)| to.copy_from_slice(&number.to_ne_bytes())),
        ShaderPrecision::F32 => each.for_each(|(to, number)| to.copy_from_slice(&single(*number).to_ne_bytes())),
    }
}

/// A recording on the device.
pub(super) struct Unit {
    pub recording: usize,
    pub layout: Layout,
    pub samples: usize,
    pub bind_layout: wgpu::BindGroupLayout,
    pub pipeline: wgpu::ComputePipeline,
    pub rows: wgpu::Buffer,
}

impl Unit {
    /// Compiles the shader and uploads the rows.
    pub(super) fn new(device: &Device, recording: usize, source: &UnitSource) -> Result<Self> {
        use wgpu::BufferBindingType::{Storage, Uniform};
        let (own, limit) = (&device.device, device.facts.binding_bytes_max);
        if source.rows.len() as u64 > limit {
            let message = format!(
                "a recording needs a buffer of {} bytes; {} allows {limit}",
                source.rows.len(),
                device.facts.name
            );
            return Err(error(message, again()));
        }
        let kinds = [Uniform, Storage { read_only: true }, Storage { read_only: true }, Storage { read_only: false }];
        let (bind_layout, pipeline) = compile(device, &source.shader, &kinds, 0);
        let rows = own.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: source.rows.len() as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        device.check()?;
        device.queue.write_buffer(&rows, 0, &source.rows);
        Ok(Self { recording, layout: source.layout.clone(), samples: source.samples, bind_layout, pipeline, rows })
    }
}
