//! The variants of a shader: its numbers, its criterion, how it reads samples, its extensions.

use super::features::{self, ShaderFeatures};
use crate::named::named;

named! {
    /// Numbers of a GPU evaluation.
    #[derive(Hash)]
    pub enum Precision: Sizes {
        /// f32 in deviations from a reference.
        F32 = "f32" => Sizes { bytes: 4, sample: 4, fields: 14 },
        /// f32 as it comes: faster, and within some 1e-3 of the optimum mostly rounding. For benches.
        F32Plain = "f32-plain" => Sizes { bytes: 4, sample: 4, fields: 10 },
        /// f64, where the device has it.
        F64 = "f64" => Sizes { bytes: 8, sample: 2, fields: 10 },
    }
}

/// The sizes that follow from a precision.
struct Sizes {
    /// Bytes of a number.
    bytes: usize,
    /// Numbers of a sample: what is measured, and for deviations the reference's increment. Uniform buffers want 16 bytes.
    sample: usize,
    /// Entries of a step map.
    fields: usize,
}

impl Precision {
    /// Operations (additions, multiplications or both in one) that a shader needs for a candidate-step: for the states
    /// 4 multiply–adds and 2 additions, for the errors 2 subtractions and 2 multiply–adds; deviations add 4 for the force
    /// and 2 to be observed.
    #[must_use]
    pub fn operations(self) -> f64 {
        if self.is_deviation() { 16.0 } else { 10.0 }
    }

    /// Returns whether states are deviations from those of a reference.
    pub(super) fn is_deviation(self) -> bool {
        self == Self::F32
    }

    /// The type of a number.
    pub(super) fn scalar(self) -> &'static str {
        if self.bytes() == 8 { "f64" } else { "f32" }
    }

    /// Returns the bytes of a number.
    pub(super) const fn bytes(self) -> usize {
        self.row().bytes
    }

    /// Returns the numbers of a sample.
    pub(super) fn sample(self) -> usize {
        self.row().sample
    }

    /// The same without deviations: those of a linear motor alone are linear themselves.
    pub(super) fn plain(self) -> Self {
        if self.is_deviation() { Self::F32Plain } else { self }
    }
}

/// The way in which invocations fetch samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Fetch {
    /// Each reads each.
    Direct,
    /// Each of eight reads one of eight and shows it to the others: pays on software adapters.
    Subgroup,
}

/// The variant for which a shader is assembled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Variant {
    /// Its numbers.
    pub precision: Precision,
    /// True if |e| is summed rather than e².
    pub absolute: bool,
    /// True if samples have weights.
    pub weighted: bool,
    /// True if the samples fit a uniform buffer.
    pub uniform: bool,
    /// The way in which invocations fetch samples.
    pub fetch: Fetch,
    /// The parts for motors with extensions; `None` for linear motors.
    pub features: Option<ShaderFeatures>,
}

impl Variant {
    /// Entries of a step map.
    pub(super) const fn fields(self) -> usize {
        if self.features.is_some() { features::FIELDS } else { self.precision.row().fields }
    }

    /// Words of a job.
    pub(super) fn job(self) -> usize {
        if self.features.is_some() { features::JOB } else { JOB }
    }

    /// Entries of the state of a block between rounds.
    pub(super) fn states(self) -> usize {
        if self.features.is_some() { features::STATES } else { 2 }
    }

    /// Slots of constants that a block has behind its step maps.
    pub(super) fn slots(self) -> usize {
        self.features.map_or(0, ShaderFeatures::slots)
    }

    /// Returns whether the voltage is delayed.
    pub(super) fn is_delayed(self) -> bool {
        self.features.is_some_and(|features| features.delayed)
    }
}

/// Words of a job of linear motors.
const JOB: usize = 9;
/// Invocations of a workgroup; each runs [`LANES`] candidates.
pub const WORKGROUP: usize = 32;
/// Candidates of an invocation: 2 or 4.
pub const LANES: usize = 2;
/// Samples whose errors are summed before they go to the total.
pub const BLOCK: usize = 64;
/// Bytes of a uniform buffer that every device has.
pub const UNIFORM_BYTES: usize = 64 << 10;
