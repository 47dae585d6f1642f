//! A submission for the page, which talks to WebGPU.

use motorfit::evaluate::gpu::{BufferBinding, Submission};
use wasm_bindgen::prelude::wasm_bindgen;

/// A shader with its buffers. Their contents are taken one by one, since they may be large.
#[wasm_bindgen]
pub struct Job {
    shader: String,
    buffers: Vec<BufferBinding>,
    maps: Vec<u8>,
    bindings: [u32; 2],
    rounds: [u32; 2],
    workgroups: [u32; 2],
}

impl Job {
    /// Creates the job of a submission with the maps of its candidates.
    pub(crate) fn of(submission: &Submission, maps: Vec<u8>) -> Self {
        Self {
            shader: submission.shader(),
            buffers: submission.buffers(),
            maps,
            bindings: submission.bindings(),
            rounds: submission.rounds(),
            workgroups: submission.workgroups(),
        }
    }
}

#[wasm_bindgen]
impl Job {
    /// Returns the shader in WGSL.
    #[must_use]
    pub fn shader(&self) -> String {
        self.shader.clone()
    }

    /// Returns the number of the binding, the usage, the size and the size of the binding of each buffer.
    #[must_use]
    pub fn buffers(&self) -> Vec<u32> {
        let size = |bytes: usize| u32::try_from(bytes).unwrap_or(u32::MAX);
        self.buffers.iter().flat_map(|of| [of.binding, of.usage, size(of.size), size(of.binding_size)]).collect()
    }

    /// Returns the kinds of the buffers as WebGPU names them.
    #[must_use]
    pub fn kinds(&self) -> Vec<String> {
        self.buffers.iter().map(|of| of.kind.name().to_owned()).collect()
    }

    /// Returns the content of a buffer; empty if there is none.
    #[must_use]
    pub fn bytes(&mut self, binding: u32) -> Vec<u8> {
        if binding == self.bindings[0] {
            return std::mem::take(&mut self.maps);
        }
        let own = self.buffers.iter_mut().find(|of| of.binding == binding);
        own.map(|of| std::mem::take(&mut of.bytes)).unwrap_or_default()
    }

    /// Returns the binding of the sums.
    #[must_use]
    pub fn sums(&self) -> u32 {
        self.bindings[1]
    }

    /// Returns the number of rounds, and the distance of their offsets \[bytes\].
    #[must_use]
    pub fn rounds(&self) -> Vec<u32> {
        self.rounds.to_vec()
    }

    /// Returns the numbers of workgroups in two dimensions.
    #[must_use]
    pub fn workgroups(&self) -> Vec<u32> {
        self.workgroups.to_vec()
    }
}
