//! Shaders: small WGSL files joined with a prelude for what a batch needs.

/// Numbers of a GPU evaluation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Precision {
    /// f32 in deviations from a reference.
    F32,
    /// f64, where the device has it.
    F64,
}

impl Precision {
    /// Its name in flags and results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F64 => "f64",
        }
    }

    /// Bytes of a number.
    pub(super) fn bytes(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Numbers of a sample: what is measured, and in f32 the reference's state.
    pub(super) fn sample(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F64 => 2,
        }
    }

    /// Entries of a step map.
    pub(super) fn fields(self) -> usize {
        match self {
            Self::F32 => 14,
            Self::F64 => 10,
        }
    }
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
}

impl Variant {
    /// All of them.
    pub fn all() -> impl Iterator<Item = Self> {
        [Precision::F32, Precision::F64].into_iter().flat_map(|precision| {
            (0..8_u8).map(move |bits| Self {
                precision,
                absolute: bits & 1 != 0,
                weighted: bits & 2 != 0,
                uniform: bits & 4 != 0,
            })
        })
    }
}

/// Invocations of a workgroup; each runs [`LANES`] candidates.
pub const WORKGROUP: usize = 32;
/// Candidates of an invocation.
pub const LANES: usize = 4;
/// Bytes of a uniform buffer that every device has.
pub const UNIFORM_BYTES: usize = 64 << 10;

/// The WGSL source of a variant.
#[must_use]
pub fn assemble(variant: Variant) -> String {
    let Variant { precision, absolute, weighted, uniform } = variant;
    let (scalar, fields) = (precision.name(), precision.fields());
    let sample_bytes = precision.sample() * precision.bytes();
    let sample = precision.sample();
    let samples = if uniform {
        format!("var<uniform> samples: array<Sample, {}>", UNIFORM_BYTES / sample_bytes)
    } else {
        "var<storage, read> samples: array<Sample>".to_owned()
    };
    let prelude = format!(
        "alias Scalar = {scalar};\nalias Pair = vec2<{scalar}>;\nalias Sample = vec{sample}<{scalar}>;\nconst WORKGROUP: u32 = {WORKGROUP}u;\nconst FIELDS: u32 = {fields}u;\n\
         const ABSOLUTE: bool = {absolute};\nconst WEIGHTED: bool = {weighted};\n\
         @group(0) @binding(4) {samples};\n"
    );
    let lanes = lanes(scalar);
    let step = match precision {
        Precision::F32 => include_str!("../../../shaders/step_deviation.wgsl"),
        Precision::F64 => include_str!("../../../shaders/step_plain.wgsl"),
    };
    [
        prelude.as_str(),
        lanes.as_str(),
        include_str!("../../../shaders/input.wgsl"),
        step,
        include_str!("../../../shaders/sensor.wgsl"),
        include_str!("../../../shaders/accumulate.wgsl"),
    ]
    .join("\n")
}

/// `Lanes` and its arithmetic: as many vec4 as hold a block of candidates.
fn lanes(scalar: &str) -> String {
    let each =
        |separator: &str, text: &dyn Fn(usize) -> String| (0..LANES / 4).map(text).collect::<Vec<_>>().join(separator);
    let members = each(" ", &|n| format!("v{n}: vec4<{scalar}>,"));
    let function = |name: &str, parameters: &str, value: &dyn Fn(usize) -> String| {
        format!("fn {name}({parameters}) -> Lanes {{ return Lanes({}); }}\n", each(", ", value))
    };
    [
        format!("struct Lanes {{ {members} }}\n"),
        function("splat", "s: Scalar", &|_| format!("vec4<{scalar}>(s)")),
        function("add", "a: Lanes, b: Lanes", &|n| format!("a.v{n} + b.v{n}")),
        function("subtract", "a: Lanes, b: Lanes", &|n| format!("a.v{n} - b.v{n}")),
        function("difference", "s: Scalar, a: Lanes", &|n| format!("s - a.v{n}")),
        function("scale", "a: Lanes, s: Scalar", &|n| format!("a.v{n} * s")),
        function("scale_add", "a: Lanes, s: Scalar, c: Lanes", &|n| format!("a.v{n} * s + c.v{n}")),
        function("multiply_add", "a: Lanes, b: Lanes, c: Lanes", &|n| format!("a.v{n} * b.v{n} + c.v{n}")),
        function("magnitude", "a: Lanes", &|n| format!("abs(a.v{n})")),
    ]
    .concat()
}
