//! A problem on the device: evaluation of populations in rounds of samples.

use super::super::device::Device;
use super::super::layout::ROUND_BYTES;
use super::super::set::{grow, lost, unmapped};
use super::super::sums::{TASK, number};
use super::unit::{Unit, UnitSource, WORKGROUP, put};
use motorfit_core::Result;
use motorfit_evaluate::model::{LANES, ModelProblem};
use motorfit_model::wgsl::ShaderPrecision;
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Samples of a round: a dispatch that takes too long is ended by some drivers, and software adapters limit the iterations of a loop.
const ROUND: usize = 2048;
/// Largest number of candidates of a submission.
const CANDIDATES: usize = 1 << 17;
/// Largest size of a buffer of candidates \[bytes\].
const BUDGET: u64 = 64 << 20;

/// The recordings of a problem on the device, and the buffers of candidates.
pub(crate) struct Loaded {
    precision: ShaderPrecision,
    units: Vec<Unit>,
    rounds: Option<wgpu::Buffer>,
    parameters: Option<wgpu::Buffer>,
    kept: Option<wgpu::Buffer>,
    read_back: Option<wgpu::Buffer>,
    arrived: Arc<AtomicBool>,
}

impl Loaded {
    /// Puts a problem on the device; `None` if a shader cannot evaluate one of its recordings.
    pub(super) fn new(device: &Device, problem: &ModelProblem, precision: ShaderPrecision) -> Result<Option<Self>> {
        let source = |recording| UnitSource::new(problem, recording, precision);
        let sources: Option<Vec<UnitSource>> = (0..problem.recordings()).map(source).collect();
        sources.map(|sources| Self::of_sources(device, &sources, precision)).transpose()
    }

    /// Compiles shaders and uploads rows.
    pub(super) fn of_sources(device: &Device, sources: &[UnitSource], precision: ShaderPrecision) -> Result<Self> {
        let units = sources.iter().enumerate().map(|(recording, source)| Unit::new(device, recording, source));
        let units = units.collect::<Result<Vec<_>>>()?;
        device.check()?;
        Ok(Self {
            precision,
            units,
            rounds: None,
            parameters: None,
            kept: None,
            read_back: None,
            arrived: Arc::default(),
        })
    }

    /// Returns the number of recordings.
    pub(super) fn units(&self) -> usize {
        self.units.len()
    }

    /// Returns the largest number of candidates of a submission.
    pub(crate) fn candidates_max(&self, device: &Device) -> usize {
        let numbers = self.units.iter().map(|unit| unit.layout.parameters.len().max(unit.layout.kept())).max();
        let budget = usize::try_from(BUDGET.min(device.facts.binding_bytes_max)).unwrap_or(usize::MAX);
        (budget / (numbers.unwrap_or(1).max(1) * self.precision.bytes())).clamp(1, CANDIDATES)
    }

    /// Returns the sums of the losses of each output over the first `samples` samples of a recording, shape
    /// `[outputs][candidates]`; +∞ for candidates that diverge.
    pub(crate) fn sums(
        &mut self,
        device: &Device,
        problem: &ModelProblem,
        (unit, samples): (usize, usize),
        candidates: &[&[f64]],
    ) -> Result<Vec<Vec<f64>>> {
        let samples = samples.min(self.units[unit].samples);
        self.upload(device, problem, (unit, samples), candidates)?;
        let count = candidates.len();
        let of = &self.units[unit];
        let (first, kept) = (of.layout.states, of.layout.kept());
        let size = ((kept - first) * count * self.precision.bytes()) as u64;
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        grow(&mut self.read_back, device, (kept - first) * count * self.precision.bytes(), usage)?;
        let (Some(rounds), Some(parameters), Some(kept_buffer), Some(read_back)) =
            (&self.rounds, &self.parameters, &self.kept, &self.read_back)
        else {
            return Err(lost());
        };
        let buffer = |buffer, bytes: Option<u64>| {
            let size = bytes.and_then(wgpu::BufferSize::new);
            wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: 0, size })
        };
        let resources = [
            buffer(rounds, Some(ROUND_BYTES as u64)),
            buffer(&of.rows, None),
            buffer(parameters, None),
            buffer(kept_buffer, None),
        ];
        let entries: Vec<_> =
            (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        let descriptor = wgpu::BindGroupDescriptor { label: None, layout: &of.bind_layout, entries: &entries };
        let bind_group = device.device.create_bind_group(&descriptor);
        let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let [x, y] = groups(count, device);
        for round in 0..samples.div_ceil(ROUND) {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&of.pipeline);
            pass.set_bind_group(0, &bind_group, &[small(round * ROUND_BYTES)]);
            pass.dispatch_workgroups(x, y, 1);
        }
        let from = (first * count * self.precision.bytes()) as u64;
        encoder.copy_buffer_to_buffer(kept_buffer, from, read_back, 0, size);
        let submission = device.queue.submit([encoder.finish()]);
        self.arrived.store(false, Ordering::Release);
        let arrived = self.arrived.clone();
        read_back.slice(..size).map_async(wgpu::MapMode::Read, move |_| arrived.store(true, Ordering::Release));
        let steps = (samples * count) as u64 * (problem.work() as u64 / 16 + 1);
        device.wait(submission, steps, &self.arrived)?;
        let view = read_back.slice(..size).get_mapped_range().map_err(|e| unmapped(device, &e))?;
        let outputs = of.layout.measured.len();
        let value = |place: usize, n: usize| number(&view, place * count + n, self.precision.bytes());
        let sum = |place: usize, n: usize| {
            let is_finite = value(outputs, n) < 0.5;
            if is_finite { value(place, n) } else { f64::INFINITY }
        };
        let column =
            |place: usize| (0..count).into_par_iter().with_min_len(TASK).map(|n| sum(place, n)).collect::<Vec<f64>>();
        let sums = (0..outputs).map(column).collect();
        drop(view);
        read_back.unmap();
        Ok(sums)
    }

    /// Uploads rounds and parameters.
    fn upload(
        &mut self,
        device: &Device,
        problem: &ModelProblem,
        (unit, samples): (usize, usize),
        candidates: &[&[f64]],
    ) -> Result<()> {
        use wgpu::BufferUsages as U;
        let of = &self.units[unit];
        let count = candidates.len();
        let [width, _] = groups(count, device);
        let mut rounds = Vec::new();
        for first in (0..samples).step_by(ROUND) {
            let words = [first, (first + ROUND).min(samples), count].map(small);
            let mut bytes = [0; ROUND_BYTES];
            for (place, word) in words.into_iter().chain([width]).enumerate() {
                bytes[4 * place..4 * place + 4].copy_from_slice(&word.to_ne_bytes());
            }
            rounds.extend(bytes);
        }
        let blocks: Vec<Vec<[f64; LANES]>> =
            candidates.par_chunks(LANES).map(|block| problem.lanes(block, of.recording)).collect();
        let values = |number: usize| {
            blocks.iter().zip(candidates.chunks(LANES)).flat_map(move |(block, chunk)| &block[number][..chunk.len()])
        };
        let row = (count * self.precision.bytes()).max(1);
        let mut parameters = vec![0; of.layout.parameters.len() * row];
        let rows = parameters.par_chunks_exact_mut(row).zip(&of.layout.parameters);
        rows.for_each(|(to, number)| put(to, values(*number), self.precision));
        let kept = of.layout.kept() * count * self.precision.bytes();
        grow(&mut self.rounds, device, rounds.len(), U::UNIFORM | U::COPY_DST)?;
        grow(&mut self.parameters, device, parameters.len(), U::STORAGE | U::COPY_DST)?;
        grow(&mut self.kept, device, kept, U::STORAGE | U::COPY_SRC)?;
        for (buffer, bytes) in [(&self.rounds, &rounds), (&self.parameters, &parameters)] {
            if let Some(buffer) = buffer.as_ref().filter(|_| !bytes.is_empty()) {
                device.queue.write_buffer(buffer, 0, bytes);
            }
        }
        Ok(())
    }
}

/// Returns the numbers of workgroups in both dimensions of a dispatch.
fn groups(candidates: usize, device: &Device) -> [u32; 2] {
    let all = small(candidates).div_ceil(WORKGROUP).max(1);
    let width = all.min(device.facts.workgroups_max.max(1));
    [width, all.div_ceil(width)]
}

/// Returns a number that the limits of a submission keep small.
fn small(number: usize) -> u32 {
    u32::try_from(number).unwrap_or(u32::MAX)
}
