//! The variants of a shader: precision, criterion, access to samples, extensions.

use super::features::{self, ShaderFeatures};
use motorfit_core::named::named;

named! {
    /// The precision of a GPU evaluation.
    #[derive(Hash)]
    pub enum Precision: Sizes {
        /// f32, in deviations from a reference trajectory.
        F32 = "f32" => Sizes { bytes: 4, sample: 4, fields: 14 },
        /// f32 without deviations, for benchmarks: faster, but within about 1e-3 of the optimum mostly rounding errors.
        F32Plain = "f32-plain" => Sizes { bytes: 4, sample: 4, fields: 10 },
        /// f64, on devices that support it.
        F64 = "f64" => Sizes { bytes: 8, sample: 2, fields: 10 },
    }
}

/// Sizes of numbers, samples and step maps in a precision.
struct Sizes {
    /// Size of a number \[bytes\].
    bytes: usize,
    /// Number of values of a sample: the measured ones and, for deviations, the increment of the reference. Uniform buffers
    /// require samples of 16 bytes.
    sample: usize,
    /// Number of entries of a step map.
    fields: usize,
}

impl Precision {
    /// Returns the number of operations (additions, multiplications or fused) that a shader needs per candidate-step: 4
    /// multiply–adds and 2 additions for the states, 2 subtractions and 2 multiply–adds for the errors. Deviations add 4 for
    /// the force and 2 for the output.
    #[must_use]
    pub fn operations(self) -> f64 {
        if self.is_deviation() { 16.0 } else { 10.0 }
    }

    /// Returns true if states are deviations from those of a reference.
    pub(crate) fn is_deviation(self) -> bool {
        self == Self::F32
    }

    /// Returns the WGSL type of a number.
    pub(crate) fn scalar(self) -> &'static str {
        if self.bytes() == 8 { "f64" } else { "f32" }
    }

    /// Returns the size of a number \[bytes\].
    pub(crate) const fn bytes(self) -> usize {
        self.row().bytes
    }

    /// Returns the number of fields of the step map of a linear motor.
    pub(crate) const fn fields(self) -> usize {
        self.row().fields
    }

    /// Returns the number of values of a sample.
    pub(crate) fn sample(self) -> usize {
        self.row().sample
    }

    /// Returns the precision without deviations, whose equations hold for linear motors only.
    pub(crate) fn plain(self) -> Self {
        if self.is_deviation() { Self::F32Plain } else { self }
    }
}

/// Access of invocations to samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Fetch {
    /// Every invocation reads every sample.
    Direct,
    /// Each of eight invocations reads one of eight samples and broadcasts it to the others, which is faster on software
    /// adapters.
    Subgroup,
}

/// A variant of the shader.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Variant {
    /// Precision of the evaluation.
    pub precision: Precision,
    /// True if |e| is summed rather than e².
    pub absolute: bool,
    /// True if samples have weights.
    pub weighted: bool,
    /// True if the samples fit a uniform buffer.
    pub uniform: bool,
    /// Access to samples.
    pub fetch: Fetch,
    /// Optional parts for motors with extensions; `None` for linear motors.
    pub features: Option<ShaderFeatures>,
}

impl Variant {
    /// Returns the number of entries of a step map.
    pub(crate) const fn fields(self) -> usize {
        if self.features.is_some() { features::FIELDS } else { self.precision.fields() }
    }

    /// Returns the number of words of a job.
    pub(crate) fn job(self) -> usize {
        if self.features.is_some() { features::JOB } else { JOB }
    }

    /// Returns the number of entries of a block that are kept between rounds.
    pub(crate) fn states(self) -> usize {
        if self.features.is_some() { features::STATES } else { 2 }
    }

    /// Returns the number of slots of constants after the step maps of a block.
    pub(crate) fn slots(self) -> usize {
        self.features.map_or(0, ShaderFeatures::slots)
    }

    /// Returns true if the voltage is delayed.
    pub(crate) fn is_delayed(self) -> bool {
        self.features.is_some_and(|features| features.delayed)
    }
}

/// Number of words of a job of linear motors.
const JOB: usize = 9;
/// Number of invocations of a workgroup, each of which simulates [`LANES`] candidates.
pub const WORKGROUP: usize = 32;
/// Number of candidates of an invocation: 2 or 4.
pub const LANES: usize = 2;
/// Number of samples whose errors are summed before the sum is added to the total.
pub const BLOCK: usize = 64;
/// Number of samples after which the sums of errors are compared with the limits of candidates.
pub(crate) const CHECKED_SAMPLES: usize = 2 * BLOCK;
/// Number of segments, which may have a single sample each, after which they are compared.
pub(crate) const CHECKED_SEGMENTS: usize = 16;
/// Size of a uniform buffer that every device supports \[bytes\].
pub const UNIFORM_BYTES: usize = 64 << 10;
