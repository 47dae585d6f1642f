//! The buffers of a submission. They are reused by later submissions and grow when needed. A submission is one command encoder,
//! which includes the copies to and from the device.

use super::binding::Binding;
use super::clock::{BYTES as STAMPS, Clock};
use super::device::{Device, again, error};
use super::layout::{BatchLayout, ROUND_BYTES, Unit};
use super::maps::{write_limits, write_maps};
use super::pipelines::Pipelines;
use super::sums::Sums;
use super::variant::{UNIFORM_BYTES, Variant};
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_evaluate::Group;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The buffers of one submission.
#[derive(Default)]
pub(crate) struct Set {
    pub batch: Option<BatchLayout>,
    /// The submission in flight, whose sums are not collected yet.
    pub flight: Option<wgpu::SubmissionIndex>,
    pub buffers: [Option<wgpu::Buffer>; Binding::ALL.len()],
    /// Staging buffer of step maps, which is mapped whenever nothing is in flight.
    pub upload: Option<wgpu::Buffer>,
    pub read_back: Option<wgpu::Buffer>,
    bind_group: Option<(Variant, wgpu::BindGroup)>,
    /// Clock for timed submissions, created by the first.
    clock: Option<Clock>,
    /// True once the sums can be read.
    arrived: Arc<AtomicBool>,
}

impl Set {
    /// Uploads groups that use the shader `variant`, and starts their evaluation. Data of the last submission of this set are
    /// reused if only the candidates have changed.
    pub(crate) fn submit(
        &mut self,
        device: &Device,
        pipelines: &mut Pipelines,
        groups: &[Group<'_>],
        variant: Variant,
    ) -> Result<()> {
        let batch = match self.batch.take() {
            Some(batch) if batch.serves(groups, variant) => batch,
            _ => {
                let batch = BatchLayout::new(groups, variant);
                self.put_batch(device, &batch)?;
                batch
            }
        };
        let maps = self.put_maps(device, groups, &batch)?;
        let result = batch.sums_bytes();
        self.ensure(device, Binding::States, batch.states_bytes())?;
        self.ensure(device, Binding::Sums, result)?;
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        grow(&mut self.read_back, device, result + STAMPS, usage)?;
        if device.timed && self.clock.is_none() {
            self.clock = Clock::of(device);
        }
        let (layout, pipeline) = pipelines.get(device, batch.variant)?;
        self.bind(device, layout, batch.variant);
        let submission = self.start(device, pipeline, &batch, [maps as u64, result as u64])?;
        device.check()?;
        (self.batch, self.flight) = (Some(batch), Some(submission));
        Ok(())
    }

    fn put_batch(&mut self, device: &Device, batch: &BatchLayout) -> Result<()> {
        self.write(device, Binding::Round, &batch.round_bytes())?;
        self.write(device, Binding::Jobs, bytemuck::cast_slice(&batch.jobs))?;
        self.write(device, Binding::Segments, bytemuck::cast_slice(&batch.segments))?;
        self.write(device, Binding::Inputs, &batch.inputs)?;
        self.write(device, Binding::Samples, &batch.samples)?;
        self.write(device, Binding::Weights, &batch.weights)
    }

    /// Writes bytes to a buffer. The uniform buffer of samples always has its full size.
    fn write(&mut self, device: &Device, binding: Binding, bytes: &[u8]) -> Result<()> {
        let least = if binding == Binding::Samples { UNIFORM_BYTES } else { 0 };
        self.ensure(device, binding, bytes.len().max(least))?;
        if let Some(buffer) = &self.buffers[binding as usize] {
            device.queue.write_buffer(buffer, 0, bytes);
        }
        Ok(())
    }

    /// Computes the step maps and the limits directly in the mapped staging buffer. Returns their size \[bytes\].
    fn put_maps(&mut self, device: &Device, groups: &[Group<'_>], batch: &BatchLayout) -> Result<usize> {
        let variant = batch.variant;
        let maps = batch.maps_bytes();
        let bytes = maps + batch.limits_bytes();
        self.ensure(device, Binding::Maps, bytes)?;
        let usage = wgpu::BufferUsages::MAP_WRITE | wgpu::BufferUsages::COPY_SRC;
        grow(&mut self.upload, device, bytes, usage)?;
        let upload = self.upload.as_ref().ok_or_else(lost)?;
        let mut view = (upload.slice(..bytes as u64).get_mapped_range_mut()).map_err(|e| unmapped(device, &e))?;
        write_maps(groups, &batch.units, variant, view.slice(..maps));
        write_limits(groups, &batch.units, variant.precision, view.slice(maps..));
        drop(view);
        upload.unmap();
        Ok(bytes)
    }

    fn start(
        &self,
        device: &Device,
        pipeline: &wgpu::ComputePipeline,
        batch: &BatchLayout,
        [maps_bytes, bytes]: [u64; 2],
    ) -> Result<wgpu::SubmissionIndex> {
        let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let [maps, sums] = [Binding::Maps, Binding::Sums].map(|binding| self.buffers[binding as usize].as_ref());
        let (Some((_, bind_group)), Some(upload), Some(maps), Some(sums), Some(read_back)) =
            (&self.bind_group, &self.upload, maps, sums, &self.read_back)
        else {
            return Err(lost());
        };
        let clock = self.clock.as_ref().filter(|_| device.timed);
        encoder.copy_buffer_to_buffer(upload, 0, maps, 0, maps_bytes);
        for round in 0..batch.rounds {
            let timestamp_writes = clock.and_then(|clock| clock.stamps(round, batch.rounds));
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: None, timestamp_writes });
            pass.set_pipeline(pipeline);
            #[expect(clippy::cast_possible_truncation, reason = "256")]
            pass.set_bind_group(0, bind_group, &[round * ROUND_BYTES as u32]);
            let [x, y] = batch.workgroups();
            pass.dispatch_workgroups(x, y, 1);
        }
        encoder.copy_buffer_to_buffer(sums, 0, read_back, 0, bytes);
        if let Some(clock) = clock {
            clock.resolve(&mut encoder, read_back, bytes);
        }
        let submission = device.queue.submit([encoder.finish()]);
        self.arrived.store(false, Ordering::Release);
        let arrived = self.arrived.clone();
        read_back
            .slice(..bytes + STAMPS as u64)
            .map_async(wgpu::MapMode::Read, move |_| arrived.store(true, Ordering::Release));
        upload.slice(..).map_async(wgpu::MapMode::Write, |_| {});
        Ok(submission)
    }

    /// Waits for the submission and passes its sums to `read` for each unit: per block those of current, then those of speed.
    /// Returns the beginning and the end of the submission in ticks of the device's clock if it was timed.
    pub(crate) fn collect(
        &mut self,
        device: &Device,
        read: &mut dyn FnMut(&Unit, &Sums<'_>),
    ) -> Result<Option<[u64; 2]>> {
        let (Some(submission), Some(batch), Some(buffer)) = (self.flight.take(), &self.batch, &self.read_back) else {
            return Err(lost());
        };
        device.wait(submission, batch.steps, &self.arrived)?;
        let bytes = batch.sums_bytes();
        let view = buffer.slice(..(bytes + STAMPS) as u64).get_mapped_range().map_err(|e| unmapped(device, &e))?;
        let sums = Sums { precision: batch.variant.precision, bytes: &view };
        batch.units.iter().for_each(|unit| read(unit, &sums));
        let stamps = self.clock.as_ref().filter(|_| device.timed);
        let stamps = stamps.map(|_| bytemuck::pod_read_unaligned(&view[bytes..]));
        drop(view);
        buffer.unmap();
        Ok(stamps)
    }

    /// Ensures that a buffer has at least `size` bytes. A new buffer invalidates the bind group.
    fn ensure(&mut self, device: &Device, binding: Binding, size: usize) -> Result<()> {
        if grow(&mut self.buffers[binding as usize], device, size, binding.usage())? {
            self.bind_group = None;
        }
        Ok(())
    }

    fn bind(&mut self, device: &Device, layout: &wgpu::BindGroupLayout, variant: Variant) {
        if self.bind_group.as_ref().is_some_and(|(of, _)| *of == variant) {
            return;
        }
        let entry = |(binding, buffer): (Binding, _)| {
            let bytes = match binding {
                Binding::Round => Some(ROUND_BYTES as u64),
                Binding::Samples if variant.uniform => Some(UNIFORM_BYTES as u64),
                _ => None,
            };
            let size = bytes.and_then(wgpu::BufferSize::new);
            let resource = wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: 0, size });
            wgpu::BindGroupEntry { binding: binding.number(), resource }
        };
        let entries: Vec<_> = Binding::ALL.into_iter().zip(self.buffers.iter().flatten()).map(entry).collect();
        let descriptor = wgpu::BindGroupDescriptor { label: None, layout, entries: &entries };
        self.bind_group = Some((variant, device.device.create_bind_group(&descriptor)));
    }
}

pub(crate) fn lost() -> Error {
    error("the buffers of the device were lost", "Run again.")
}

pub(crate) fn unmapped(device: &Device, reason: &dyn std::fmt::Display) -> Error {
    error(format!("{}: a buffer cannot be mapped: {reason}", device.facts.name), again())
}

/// Replaces a buffer of less than `size` bytes by a new one. Returns true if it did. A new buffer is larger than needed by
/// half, so that slowly growing batches rarely need another. Buffers for writing are created mapped.
pub(crate) fn grow(
    buffer: &mut Option<wgpu::Buffer>,
    device: &Device,
    size: usize,
    usage: wgpu::BufferUsages,
) -> Result<bool> {
    if buffer.as_ref().is_some_and(|buffer| buffer.size() >= size as u64) {
        return Ok(false);
    }
    let limits = device.device.limits();
    let limit = usize::try_from(limits.max_buffer_size.min(device.facts.binding_bytes_max)).unwrap_or(usize::MAX);
    if size > limit {
        let message = format!("a recording needs a buffer of {size} bytes; {} allows {limit}", device.facts.name);
        return Err(error(message, text!("Use " [Device = "cpu"] ", or cut the recording.")));
    }
    let size = (size + size / 2).next_multiple_of(ROUND_BYTES).max(UNIFORM_BYTES).min(limit) & !3;
    let mapped_at_creation = usage.contains(wgpu::BufferUsages::MAP_WRITE);
    let descriptor = wgpu::BufferDescriptor { label: None, size: size as u64, usage, mapped_at_creation };
    let made = device.device.create_buffer(&descriptor);
    device.check()?;
    *buffer = Some(made);
    Ok(true)
}
