//! A submission as bytes, for hosts that drive a device themselves, such as a page with WebGPU. [`Gpu`](super) does the same with wgpu.
//!
//! A host creates a pipeline from the shader with the entry point `evaluate`, and a bind group with the buffers of [`Submission::buffers`];
//! that of the rounds has a dynamic offset. It writes the maps of the candidates, dispatches [`Submission::workgroups`] once for each round
//! with the round's offset, and passes the bytes of the sums to [`Submission::costs`].

use super::binding::Binding;
use super::constants::is_served;
use super::features::ShaderFeatures;
use super::layout::{BUDGET, BatchLayout, Key, ROUND_BYTES, bytes};
use super::maps::{write_limits, write_maps};
use super::shader::assemble;
use super::sums::{Sums, add, finish_costs};
use super::variant::{Fetch, LANES, Precision, UNIFORM_BYTES, Variant};
use motorfit_core::candidates::Candidates;
use motorfit_core::setting::text;
use motorfit_core::{Error, Result};
use motorfit_evaluate::{Group, Problem};
use std::sync::Arc;
use wgpu_types::{BufferBindingType, WriteOnly};

/// Binding of a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BufferKind {
    /// Uniform buffer.
    Uniform,
    /// Storage buffer that shaders read.
    Read,
    /// Storage buffer that shaders write.
    Write,
}

impl BufferKind {
    /// Returns the name in WebGPU.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Read => "read-only-storage",
            Self::Write => "storage",
        }
    }
}

/// A buffer that is bound to the shader.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BufferBinding {
    /// Number of the binding.
    pub binding: u32,
    /// Binding of the buffer.
    pub kind: BufferKind,
    /// Usage, as the bits of WebGPU.
    pub usage: u32,
    /// Size of the buffer \[bytes\].
    pub size: usize,
    /// Size of the part that is bound at a time \[bytes\].
    pub binding_size: usize,
    /// First content; empty for the maps, the states and the sums.
    pub bytes: Vec<u8>,
}

/// The data of one submission in f32, apart from the candidates, whose number is fixed.
pub struct Submission {
    layout: BatchLayout,
}

impl Submission {
    /// Returns the largest number of candidates of a submission, whose maps take at most 32 MiB unless a single block is larger.
    #[must_use]
    pub fn candidates_max(problem: &Problem) -> usize {
        let (each, _) = bytes(problem, variant(problem));
        (BUDGET / each.max(1)).max(LANES)
    }

    /// Lays out the recordings of a problem and `count` candidates. Linear motors are evaluated in deviations from the motor
    /// `reference`; without one it is the middle of the bounds.
    ///
    /// # Errors
    /// Returns `Usage` if there are no candidates, the reference has another length than a candidate, or shaders in f32 do not serve
    /// the problem, so that the CPU has to evaluate it.
    pub fn new(problem: &Arc<Problem>, count: usize, reference: Option<&[f64]>) -> Result<Self> {
        let free = problem.space().free().len();
        let most = Self::candidates_max(problem);
        if !(1..=most).contains(&count) {
            let message = format!("found {count} candidates, expected 1 to {most} for these recordings");
            return Err(Error::usage(
                message,
                text!("Divide them into several submissions, or use " [Device = "cpu"] "."),
            ));
        }
        if free == 0 || reference.is_some_and(|reference| reference.len() != free) {
            let message = format!("the reference has another length than the {free} free parameters, or none is free");
            return Err(Error::usage(message, "Give a reference with a value for each free parameter."));
        }
        if !is_served(problem, Precision::F32.bytes(), usize::MAX) {
            let message = "shaders in f32 do not serve this problem";
            return Err(Error::usage(message, text!("Use " [Device = "cpu"] ".")));
        }
        let values = vec![1.0; free * count];
        let group = Group { problem, candidates: Candidates::new(&values, free), reference };
        let layout = BatchLayout::new(&[group], variant(problem));
        Ok(Self { layout })
    }

    /// Returns the shader in WGSL.
    #[must_use]
    pub fn shader(&self) -> String {
        assemble(self.layout.variant)
    }

    /// Returns the buffers in the order of their bindings. The first one has the rounds, at the distance of [`Self::rounds`].
    #[must_use]
    pub fn buffers(&self) -> Vec<BufferBinding> {
        let layout = &self.layout;
        Binding::ALL
            .into_iter()
            .map(|binding| {
                let (bytes, size) = match binding {
                    Binding::Round => (layout.round_bytes(), 0),
                    Binding::Jobs => (bytemuck::cast_slice(&layout.jobs).to_vec(), 0),
                    Binding::Segments => (bytemuck::cast_slice(&layout.segments).to_vec(), 0),
                    Binding::Inputs => (layout.inputs.clone(), 0),
                    Binding::Samples => {
                        (layout.samples.clone(), if layout.variant.uniform { UNIFORM_BYTES } else { 0 })
                    }
                    Binding::Weights => (layout.weights.clone(), 0),
                    Binding::Maps => (Vec::new(), self.maps_bytes()),
                    Binding::States => (Vec::new(), layout.states_bytes()),
                    Binding::Sums => (Vec::new(), layout.sums_bytes()),
                };
                let kind = match binding.kind(layout.variant.uniform) {
                    BufferBindingType::Uniform => BufferKind::Uniform,
                    BufferBindingType::Storage { read_only: true } => BufferKind::Read,
                    BufferBindingType::Storage { read_only: false } => BufferKind::Write,
                };
                let size = size.max(bytes.len()).max(16);
                let binding_size = if binding == Binding::Round { ROUND_BYTES } else { size };
                BufferBinding {
                    binding: binding.number(),
                    kind,
                    usage: binding.usage().bits(),
                    size,
                    binding_size,
                    bytes,
                }
            })
            .collect()
    }

    /// Returns the number of the binding of the maps, and that of the sums.
    #[must_use]
    pub fn bindings(&self) -> [u32; 2] {
        [Binding::Maps.number(), Binding::Sums.number()]
    }

    /// Returns the number of rounds, and the distance of their offsets \[bytes\].
    #[must_use]
    pub fn rounds(&self) -> [u32; 2] {
        #[expect(clippy::cast_possible_truncation, reason = "256")]
        [self.layout.rounds, ROUND_BYTES as u32]
    }

    /// Returns the numbers of workgroups of a dispatch in two dimensions.
    #[must_use]
    pub fn workgroups(&self) -> [u32; 2] {
        self.layout.workgroups()
    }

    /// Returns the number of candidate-steps.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.layout.steps
    }

    /// Returns the content of the buffer of maps for candidates, with their cutoffs.
    ///
    /// # Errors
    /// Returns `Usage` if their number, or that of their values, is not that of the submission.
    pub fn maps(&self, candidates: Candidates<'_>) -> Result<Vec<u8>> {
        let group = [self.group(candidates)?];
        let mut bytes = vec![0; self.maps_bytes()];
        let (maps, limits) = bytes.split_at_mut(self.layout.maps_bytes());
        write_maps(&group, &self.layout.units, self.layout.variant, WriteOnly::from_mut(maps));
        write_limits(&group, &self.layout.units, self.layout.variant.precision, WriteOnly::from_mut(limits));
        Ok(bytes)
    }

    /// Returns the costs of candidates from the content of the buffer of sums.
    ///
    /// # Errors
    /// Returns `Usage` if the number of candidates, or that of the bytes, is not that of the submission.
    pub fn costs(&self, candidates: Candidates<'_>, sums: &[u8]) -> Result<Vec<f64>> {
        let group = self.group(candidates)?;
        if sums.len() != self.layout.sums_bytes() {
            let message = format!("{} bytes of sums, expected {}", sums.len(), self.layout.sums_bytes());
            return Err(Error::usage(message, "Give the whole buffer of the sums."));
        }
        let sums = Sums { precision: self.layout.variant.precision, bytes: sums };
        let mut costs = vec![0.0; group.candidates.count()];
        self.layout.units.iter().for_each(|unit| add(unit, group.problem, &sums, &mut costs));
        finish_costs(&group, &mut costs)?;
        Ok(costs)
    }

    fn maps_bytes(&self) -> usize {
        self.layout.maps_bytes() + self.layout.limits_bytes()
    }

    fn group<'a>(&'a self, candidates: Candidates<'a>) -> Result<Group<'a>> {
        let Some(Key { problem, reference, count }) = self.layout.key.first() else {
            return Err(Error::usage("there is no problem", "Give one."));
        };
        let (found, free) = (candidates.count(), problem.space().free().len());
        if found != *count || candidates.width() != free {
            let message = format!("found {found} candidates of {}, expected {count} of {free}", candidates.width());
            return Err(Error::usage(message, "Give a value for each free parameter of each candidate."));
        }
        Ok(Group { problem, candidates, reference: reference.as_deref() })
    }
}

fn variant(problem: &Problem) -> Variant {
    let features = ShaderFeatures::of(problem.features());
    Variant {
        precision: if features.is_some() { Precision::F32.plain() } else { Precision::F32 },
        absolute: problem.criterion().is_absolute(),
        weighted: problem.signals().iter().any(|signals| !signals.weight.is_empty()),
        uniform: true,
        fetch: Fetch::Direct,
        features,
    }
}

#[cfg(feature = "gpu")]
#[cfg(test)]
mod tests;
