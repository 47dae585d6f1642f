//! Compute pipelines, compiled once for each shader variant.

use super::binding::Binding;
use super::device::Device;
use super::shader::assemble;
use super::variant::Variant;
use motorfit_core::Result;
use std::collections::HashMap;
use std::collections::hash_map::Entry;

/// The pipelines of one device, each with its bind group layout, by variant.
#[derive(Default)]
pub(crate) struct Pipelines(HashMap<Variant, (wgpu::BindGroupLayout, wgpu::ComputePipeline)>);

impl Pipelines {
    pub(crate) fn get(
        &mut self,
        device: &Device,
        variant: Variant,
    ) -> Result<&(wgpu::BindGroupLayout, wgpu::ComputePipeline)> {
        Ok(match self.0.entry(variant) {
            Entry::Occupied(made) => made.into_mut(),
            Entry::Vacant(place) => {
                let made = make(device, variant);
                device.check()?;
                place.insert(made)
            }
        })
    }
}

fn make(device: &Device, variant: Variant) -> (wgpu::BindGroupLayout, wgpu::ComputePipeline) {
    let kinds = Binding::ALL.map(|binding| binding.kind(variant.uniform));
    compile(device, &assemble(variant), &kinds, Binding::Round.number())
}

/// Compiles a shader with the entry point `evaluate`. Its buffers have these kinds in the order of their binding numbers; that with the
/// number `rounds` has a dynamic offset.
pub(crate) fn compile(
    device: &Device,
    shader: &str,
    kinds: &[wgpu::BufferBindingType],
    rounds: u32,
) -> (wgpu::BindGroupLayout, wgpu::ComputePipeline) {
    let device = &device.device;
    let entry = |(binding, kind): (u32, &wgpu::BufferBindingType)| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer { ty: *kind, has_dynamic_offset: binding == rounds, min_binding_size: None },
        count: None,
    };
    let entries: Vec<_> = (0..).zip(kinds).map(entry).collect();
    let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries });
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("evaluate"),
        source: wgpu::ShaderSource::Wgsl(shader.into()),
    });
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(&layout)],
        immediate_size: 0,
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("evaluate"),
        layout: Some(&pipeline_layout),
        module: &module,
        entry_point: Some("evaluate"),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    (layout, pipeline)
}
