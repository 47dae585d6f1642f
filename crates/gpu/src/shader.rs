//! Assembly of shaders from the WGSL files of `shaders/` and a generated prelude.

use super::binding::Binding;
use super::features::{self, ShaderFeatures, Slot};
use super::variant::{
    BLOCK, CHECKED_SAMPLES, CHECKED_SEGMENTS, Fetch, LANES, Precision, UNIFORM_BYTES, Variant, WORKGROUP,
};
use motorfit_motor::Parameter;

/// Includes the text of a file of `shaders/`.
macro_rules! shader {
    ($name:literal) => {
        include_str!(concat!("../shaders/", $name, ".wgsl"))
    };
}

/// Returns the WGSL source of a variant.
#[must_use]
pub fn assemble(variant: Variant) -> String {
    let prelude = prelude(variant);
    let fetch = match variant.fetch {
        Fetch::Direct => shader!("fetch_direct"),
        Fetch::Subgroup => shader!("fetch_subgroup"),
    };
    let Some(features) = variant.features else {
        let step = match variant.precision {
            Precision::F32 => shader!("step_deviation"),
            Precision::F32Plain | Precision::F64 => shader!("step_plain"),
        };
        return [&prelude, shader!("input"), step, shader!("loss"), shader!("accumulate"), fetch].join("\n");
    };
    let parts = [
        &prelude,
        &extended_prelude(features),
        shader!("input"),
        shader!("drive"),
        shader!("delay"),
        shader!("friction"),
        shader!("sensor"),
        shader!("step_extended"),
        shader!("loss"),
        shader!("accumulate_extended"),
        fetch,
    ];
    parts.join("\n")
}

/// Returns the types, the constants and the declaration of the samples for a variant.
fn prelude(variant: Variant) -> String {
    let Variant { precision, absolute, weighted, uniform, .. } = variant;
    let (scalar, fields, sample, job) = (precision.scalar(), variant.fields(), precision.sample(), variant.job());
    let samples = if uniform {
        format!("var<uniform> samples: array<Sample, {}>", UNIFORM_BYTES / (sample * precision.bytes()))
    } else {
        "var<storage, read> samples: array<Sample>".to_owned()
    };
    let bindings = Binding::constants();
    format!(
        "alias Scalar = {scalar};\nalias Pair = vec2<{scalar}>;\nalias Sample = vec{sample}<{scalar}>;\n\
         alias Lanes = vec{LANES}<{scalar}>;\nconst WORKGROUP: u32 = {WORKGROUP}u;\nconst FIELDS: u32 = {fields}u;\nconst BLOCK: u32 = {BLOCK}u;\nconst CHECKED_SAMPLES: u32 = {CHECKED_SAMPLES}u;\n\
         const CHECKED_SEGMENTS: u32 = {CHECKED_SEGMENTS}u;\n\
         const JOB: u32 = {job}u;\nconst ABSOLUTE: bool = {absolute};\nconst WEIGHTED: bool = {weighted};\n{bindings}\
         @group(0) @binding(SAMPLES_BINDING) {samples};\n"
    )
}

/// Returns the second part of the prelude for motors with extensions: flags of the optional parts, offsets of their constants
/// (named by the symbol of the parameter), and functions that read a different index for each candidate of an invocation.
fn extended_prelude(features: ShaderFeatures) -> String {
    let ShaderFeatures { brushes, delayed, averages: [current, speed] } = features;
    let [averages, taps, special] =
        [Slot::Averages, Slot::Taps, Slot::Special].map(|slot| features.slot(slot) * features::FIELDS);
    let values: String = (Parameter::EXTENSIONS.iter().enumerate())
        .map(|(n, parameter)| format!("const AT_{}: u32 = {n}u;\n", parameter.symbol()))
        .collect();
    let axes = &["x", "y", "z", "w"][..LANES];
    let each = |read: &dyn Fn(&str) -> String| axes.iter().map(|axis| read(axis)).collect::<Vec<_>>().join(", ");
    let commanded = each(&|axis| format!("inputs[at.{axis}].x"));
    let past = each(&|axis| format!("states[at.{axis}].{axis}"));
    let (states, channels) = (features::STATES, features.channels());
    format!(
        "alias Counts = vec{LANES}<i32>;\nalias Choice = vec{LANES}<bool>;\nconst STATES: u32 = {states}u;\nconst CHANNELS: i32 = {channels};\n\
         const BRUSHES: bool = {brushes};\nconst DELAYED: bool = {delayed};\n\
         const AVERAGE_I: bool = {current};\nconst AVERAGE_W: bool = {speed};\n{values}\
         const AVERAGES: u32 = {averages}u;\nconst TAPS: u32 = {taps}u;\nconst SPECIAL: u32 = {special}u;\n\
         fn commanded(at: Counts) -> Lanes {{ return Lanes({commanded}); }}\n\
         fn past(at: Counts) -> Lanes {{ return Lanes({past}); }}\n"
    )
}
