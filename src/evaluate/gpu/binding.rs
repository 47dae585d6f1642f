//! The buffers that a shader sees: the one place for their numbers and kinds. Shaders name them by constants that the
//! prelude makes of this list.

/// A buffer that a shader sees; its number is that of the binding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Binding {
    /// Which round of how many jobs.
    Round,
    /// What the workgroups work on.
    Jobs,
    /// Runs of constant inputs.
    Segments,
    /// Inputs and initial states.
    Inputs,
    /// Measured samples.
    Samples,
    /// Weights of samples.
    Weights,
    /// Step maps and constants of candidates.
    Maps,
    /// States between rounds.
    States,
    /// Weighted sums of errors.
    Sums,
}

impl Binding {
    /// All of them, in the order of their numbers.
    pub(super) const ALL: [Self; 9] = [
        Self::Round,
        Self::Jobs,
        Self::Segments,
        Self::Inputs,
        Self::Samples,
        Self::Weights,
        Self::Maps,
        Self::States,
        Self::Sums,
    ];

    /// Returns the number as the shader and the device take it.
    pub(super) const fn number(self) -> u32 {
        self as u32
    }

    /// Returns the constants that shaders name bindings by.
    pub(super) fn constants() -> String {
        let constant = |binding: Self| {
            format!("const {}_BINDING: u32 = {}u;\n", format!("{binding:?}").to_uppercase(), binding.number())
        };
        Self::ALL.into_iter().map(constant).collect()
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
    pub(super) fn usage(self) -> wgpu::BufferUsages {
        use wgpu::BufferUsages as U;
        match self {
            Self::Round => U::UNIFORM | U::COPY_DST,
            Self::Samples => U::UNIFORM | U::STORAGE | U::COPY_DST,
            Self::States => U::STORAGE,
            Self::Sums => U::STORAGE | U::COPY_SRC,
            _ => U::STORAGE | U::COPY_DST,
        }
    }
}
