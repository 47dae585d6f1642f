//! The buffers that a shader sees: the one place for their numbers and kinds. Shaders name them by constants that the
//! prelude makes of this list.

use crate::named::named;
use wgpu::BufferUsages as U;

named! {
    /// A buffer that a shader sees, by the name of its constant there; its number is that of the binding.
    pub(super) enum Binding: U {
        /// Which round of how many jobs.
        Round = "ROUND_BINDING" => U::UNIFORM.union(U::COPY_DST),
        /// The jobs of the workgroups.
        Jobs = "JOBS_BINDING" => U::STORAGE.union(U::COPY_DST),
        /// Runs of constant inputs.
        Segments = "SEGMENTS_BINDING" => U::STORAGE.union(U::COPY_DST),
        /// Inputs and initial states.
        Inputs = "INPUTS_BINDING" => U::STORAGE.union(U::COPY_DST),
        /// Measured samples.
        Samples = "SAMPLES_BINDING" => U::UNIFORM.union(U::STORAGE).union(U::COPY_DST),
        /// Weights of samples.
        Weights = "WEIGHTS_BINDING" => U::STORAGE.union(U::COPY_DST),
        /// Step maps and constants of candidates.
        Maps = "MAPS_BINDING" => U::STORAGE.union(U::COPY_DST),
        /// States between rounds.
        States = "STATES_BINDING" => U::STORAGE,
        /// Weighted sums of errors.
        Sums = "SUMS_BINDING" => U::STORAGE.union(U::COPY_SRC),
    }
}

impl Binding {
    /// Returns the number as the shader and the device take it.
    pub(super) const fn number(self) -> u32 {
        self as u32
    }

    /// Returns the constants that shaders name bindings by.
    pub(super) fn constants() -> String {
        Self::ALL.map(|binding| format!("const {}: u32 = {}u;\n", binding.name(), binding.number())).concat()
    }

    /// Returns the type in the layout of a pipeline; samples lie in a uniform buffer where they fit.
    pub(super) fn kind(self, uniform_samples: bool) -> wgpu::BufferBindingType {
        match self {
            Self::Round => wgpu::BufferBindingType::Uniform,
            Self::Samples if uniform_samples => wgpu::BufferBindingType::Uniform,
            _ => wgpu::BufferBindingType::Storage { read_only: !matches!(self, Self::States | Self::Sums) },
        }
    }

    /// Returns the usage of the buffer.
    pub(super) fn usage(self) -> U {
        self.row()
    }
}
