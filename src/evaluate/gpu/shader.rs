//! Shaders: small WGSL files joined with a prelude for what a batch needs.

use super::extras::{self, Extras, Slot};

/// Numbers of a GPU evaluation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Precision {
    /// f32 in deviations from a reference.
    F32,
    /// f32 as it comes: faster, and within some 1e-3 of the optimum mostly rounding. For benches.
    F32Plain,
    /// f64, where the device has it.
    F64,
}

impl Precision {
    /// Its name in settings and results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F32Plain => "f32-plain",
            Self::F64 => "f64",
        }
    }

    /// Operations (additions, multiplications or both in one) that a shader needs for a candidate-step: for the states
    /// 4 multiply–adds and 2 additions, for the errors 2 subtractions and 2 multiply–adds; deviations add 4 for the force
    /// and 2 to be observed.
    #[must_use]
    pub fn operations(self) -> f64 {
        if self.is_deviation() { 16.0 } else { 10.0 }
    }

    /// Whether states are deviations from those of a reference.
    pub(super) fn is_deviation(self) -> bool {
        self == Self::F32
    }

    /// The type of a number.
    fn scalar(self) -> &'static str {
        if self.bytes() == 8 { "f64" } else { "f32" }
    }

    /// Bytes of a number.
    pub(super) const fn bytes(self) -> usize {
        match self {
            Self::F32 | Self::F32Plain => 4,
            Self::F64 => 8,
        }
    }

    /// Numbers of a sample: what is measured, and for deviations the reference's increment. Uniform buffers want 16 bytes.
    pub(super) fn sample(self) -> usize {
        match self {
            Self::F32 | Self::F32Plain => 4,
            Self::F64 => 2,
        }
    }

    /// Entries of a step map.
    const fn fields(self) -> usize {
        match self {
            Self::F32 => 14,
            Self::F32Plain | Self::F64 => 10,
        }
    }

    /// The same without deviations: those of a linear motor alone are linear themselves.
    pub(super) fn plain(self) -> Self {
        if self.is_deviation() { Self::F32Plain } else { self }
    }
}

/// How samples reach the invocations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Fetch {
    /// Each reads each.
    Direct,
    /// Each of eight reads one of eight and shows it to the others: pays on software adapters.
    Subgroup,
}

/// What a shader is assembled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Variant {
    /// Its numbers.
    pub precision: Precision,
    /// Whether |e| is summed rather than e².
    pub absolute: bool,
    /// Whether samples have weights.
    pub weighted: bool,
    /// Whether the samples fit a uniform buffer.
    pub uniform: bool,
    /// How samples reach the invocations.
    pub fetch: Fetch,
    /// For motors with extensions, which parts they need.
    pub extras: Option<Extras>,
}

impl Variant {
    /// All of them.
    pub fn all() -> impl Iterator<Item = Self> {
        let linear = [Precision::F32, Precision::F32Plain, Precision::F64].map(|precision| (precision, None));
        let extended = [Precision::F32Plain, Precision::F64];
        let extended = Extras::all().flat_map(move |extras| extended.map(|precision| (precision, Some(extras))));
        linear.into_iter().chain(extended).flat_map(|(precision, extras)| {
            (0..16_u8).map(move |bits| Self {
                precision,
                absolute: bits & 1 != 0,
                weighted: bits & 2 != 0,
                uniform: bits & 4 != 0,
                fetch: if bits & 8 == 0 { Fetch::Direct } else { Fetch::Subgroup },
                extras,
            })
        })
    }

    /// Entries of a step map.
    pub(super) const fn fields(self) -> usize {
        if self.extras.is_some() { extras::FIELDS } else { self.precision.fields() }
    }

    /// Words of a job.
    pub(super) fn job(self) -> usize {
        if self.extras.is_some() { extras::JOB } else { JOB }
    }

    /// Entries of the state of a block between rounds.
    pub(super) fn states(self) -> usize {
        if self.extras.is_some() { extras::STATES } else { 2 }
    }

    /// What a block has behind its step maps.
    pub(super) fn slots(self) -> &'static [Slot] {
        self.extras.map_or(&[], Extras::slots)
    }
}

/// Words of a job of linear motors.
const JOB: usize = 9;
/// Invocations of a workgroup; each runs [`LANES`] candidates.
pub const WORKGROUP: usize = 32;
/// Candidates of an invocation: 1, 2 or 4.
pub const LANES: usize = 2;
/// Samples whose errors are summed before they go to the total.
pub const BLOCK: usize = 64;
/// Bytes of a uniform buffer that every device has.
pub const UNIFORM_BYTES: usize = 64 << 10;

/// The WGSL source of a variant.
#[must_use]
pub fn assemble(variant: Variant) -> String {
    let Variant { precision, absolute, weighted, uniform, fetch, extras } = variant;
    let (scalar, fields, sample, job) = (precision.scalar(), variant.fields(), precision.sample(), variant.job());
    let samples = if uniform {
        format!("var<uniform> samples: array<Sample, {}>", UNIFORM_BYTES / (sample * precision.bytes()))
    } else {
        "var<storage, read> samples: array<Sample>".to_owned()
    };
    let lanes = if LANES == 1 { scalar.to_owned() } else { format!("vec{LANES}<{scalar}>") };
    let prelude = format!(
        "alias Scalar = {scalar};\nalias Pair = vec2<{scalar}>;\nalias Sample = vec{sample}<{scalar}>;\n\
         alias Lanes = {lanes};\nconst WORKGROUP: u32 = {WORKGROUP}u;\nconst FIELDS: u32 = {fields}u;\nconst BLOCK: u32 = {BLOCK}u;\n\
         const JOB: u32 = {job}u;\nconst ABSOLUTE: bool = {absolute};\nconst WEIGHTED: bool = {weighted};\n\
         @group(0) @binding(4) {samples};\n"
    );
    let fetch = match fetch {
        Fetch::Direct => include_str!("../../../shaders/fetch_direct.wgsl"),
        Fetch::Subgroup => include_str!("../../../shaders/fetch_subgroup.wgsl"),
    };
    let input = include_str!("../../../shaders/input.wgsl");
    let sensor = include_str!("../../../shaders/sensor.wgsl");
    let loss = include_str!("../../../shaders/loss.wgsl");
    let Some(extras) = extras else {
        let step = match precision {
            Precision::F32 => include_str!("../../../shaders/step_deviation.wgsl"),
            Precision::F32Plain | Precision::F64 => include_str!("../../../shaders/step_plain.wgsl"),
        };
        let accumulate = include_str!("../../../shaders/accumulate.wgsl");
        return [&prelude, input, step, sensor, loss, accumulate, fetch].join("\n");
    };
    let parts = [
        &prelude,
        &extended_prelude(extras),
        input,
        include_str!("../../../shaders/step_extended.wgsl"),
        include_str!("../../../shaders/drive.wgsl"),
        include_str!("../../../shaders/delay.wgsl"),
        include_str!("../../../shaders/average.wgsl"),
        sensor,
        loss,
        include_str!("../../../shaders/accumulate_extended.wgsl"),
        fetch,
    ];
    parts.join("\n")
}

/// What shaders for motors with extensions need besides: which parts act, where their constants lie, and reading for
/// each candidate of an invocation at a place of its own.
fn extended_prelude(extras: Extras) -> String {
    let Extras { brushes, delayed, averages: [current, speed] } = extras;
    let slot = |of: Slot| extras.slots().iter().position(|slot| *slot == of).unwrap_or(0) * extras::FIELDS;
    let (averages, taps, special) = (slot(Slot::Averages), slot(Slot::Taps), slot(Slot::Special));
    let lanes = |of: &str| if LANES == 1 { of.to_owned() } else { format!("vec{LANES}<{of}>") };
    let (counts, choice) = (lanes("i32"), lanes("bool"));
    let axes = &["x", "y", "z", "w"][..LANES];
    let each = |read: &dyn Fn(&str) -> String| axes.iter().map(|axis| read(axis)).collect::<Vec<_>>().join(", ");
    let (told, past) = if LANES == 1 {
        ("inputs[at].x".to_owned(), "states[at]".to_owned())
    } else {
        (each(&|axis| format!("inputs[at.{axis}].x")), each(&|axis| format!("states[at.{axis}].{axis}")))
    };
    let (states, channels) = (extras::STATES, extras.channels());
    format!(
        "alias Counts = {counts};\nalias Choice = {choice};\nconst STATES: u32 = {states}u;\nconst CHANNELS: i32 = {channels};\n\
         const BRUSHES: bool = {brushes};\nconst DELAYED: bool = {delayed};\n\
         const AVERAGE_I: bool = {current};\nconst AVERAGE_W: bool = {speed};\n\
         const AVERAGES: u32 = {averages}u;\nconst TAPS: u32 = {taps}u;\nconst SPECIAL: u32 = {special}u;\n\
         fn told(at: Counts) -> Lanes {{ return Lanes({told}); }}\n\
         fn past(at: Counts) -> Lanes {{ return Lanes({past}); }}\n"
    )
}
