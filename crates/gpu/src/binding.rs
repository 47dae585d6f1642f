//! The table of the buffers that are bound to a shader. The prelude of a shader has a constant for each binding number.

use motorfit_core::named::named;
use wgpu_types::{BufferBindingType, BufferUsages as U};

named! {
    /// A buffer that is bound to a shader, with the name of its constant there. The variant's number is the binding number.
    pub(crate) enum Binding: U {
        /// Index of the round, and number of jobs.
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
    /// Returns the binding number.
    pub(crate) const fn number(self) -> u32 {
        self as u32
    }

    /// Returns WGSL constants for the binding numbers.
    pub(crate) fn constants() -> String {
        Self::ALL.map(|binding| format!("const {}: u32 = {}u;\n", binding.name(), binding.number())).concat()
    }

    /// Returns the type in the layout of a pipeline. Samples are in a uniform buffer if they fit.
    pub(crate) fn kind(self, uniform_samples: bool) -> BufferBindingType {
        match self {
            Self::Round => BufferBindingType::Uniform,
            Self::Samples if uniform_samples => BufferBindingType::Uniform,
            _ => BufferBindingType::Storage { read_only: !matches!(self, Self::States | Self::Sums) },
        }
    }

    /// Returns the usage of the buffer.
    pub(crate) fn usage(self) -> U {
        self.row()
    }
}
