//! Proves: every assembled shader parses and validates, those in f32 without optional capabilities; the buffers have the layout
//! that the shaders read; an invalid shader is rejected.
//! Does not prove: that a driver compiles a shader correctly (see gpu.rs).
#![allow(clippy::unwrap_used, reason = "a test may stop")]

use motorfit::evaluate::gpu::{Fetch, LANES, Precision, ShaderFeatures, Variant, assemble};
use motorfit::model::{BuiltIn, ShaderPrecision};
use naga::valid::{Capabilities, ValidationFlags, Validator};

fn validate(source: &str, capabilities: Capabilities) -> Result<(naga::Module, naga::valid::ModuleInfo), String> {
    let module = naga::front::wgsl::parse_str(source).map_err(|e| e.emit_to_string(source))?;
    let info = Validator::new(ValidationFlags::all(), capabilities).validate(&module).map_err(|e| format!("{e:?}"))?;
    Ok((module, info))
}

/// Returns the capabilities that a variant needs: none for plain f32, features for f64 and subgroups.
fn capabilities(variant: Variant) -> Capabilities {
    let f64 = if variant.precision == Precision::F64 { Capabilities::FLOAT64 } else { Capabilities::empty() };
    let shared = if variant.fetch == Fetch::Subgroup { Capabilities::SUBGROUP } else { Capabilities::empty() };
    f64 | shared
}

/// Returns all variants of the shaders.
fn variants() -> impl Iterator<Item = Variant> {
    let linear = Precision::ALL.map(|precision| (precision, None));
    let extended = |bits: u8| {
        let [brushes, delayed, current, speed] = [1, 2, 4, 8].map(|bit| bits & bit != 0);
        let features = Some(ShaderFeatures { brushes, delayed, averages: [current, speed] });
        [Precision::F32Plain, Precision::F64].map(|precision| (precision, features))
    };
    linear.into_iter().chain((0..16).flat_map(extended)).flat_map(|(precision, features)| {
        (0..16_u8).map(move |bits| {
            let [absolute, weighted, uniform, shared] = [1, 2, 4, 8].map(|bit| bits & bit != 0);
            let fetch = if shared { Fetch::Subgroup } else { Fetch::Direct };
            Variant { precision, absolute, weighted, uniform, fetch, features }
        })
    })
}

#[test]
fn every_variant_is_valid() {
    // Three precisions for linear motors; two for motors with extensions, each in sixteen variants.
    assert_eq!(variants().count(), 16 * (3 + 2 * 16));
    for variant in variants() {
        validate(&assemble(variant), capabilities(variant)).unwrap_or_else(|e| panic!("{variant:?}: {e}"));
    }
}

#[test]
fn shaders_of_models_are_valid_without_optional_capabilities() {
    for model in BuiltIn::ALL.map(|of| of.model().unwrap()) {
        for (precision, capabilities) in
            [(ShaderPrecision::F32, Capabilities::empty()), (ShaderPrecision::F64, Capabilities::FLOAT64)]
        {
            let text = model.wgsl(precision).unwrap();
            let (module, _) = validate(&text, capabilities).unwrap_or_else(|e| panic!("{}: {e}", model.name()));
            // Loops are counted by software adapters: the loop over the samples is the only one.
            assert_eq!(text.matches("for (").count() + text.matches("while").count(), 1, "{text}");
            assert_eq!(module.entry_points.len(), 1);
        }
        assert!(validate(&model.wgsl(ShaderPrecision::F64).unwrap(), Capabilities::empty()).is_err());
    }
}

#[test]
fn buffer_layouts_agree_with_the_shaders() {
    for variant in variants() {
        let (module, _) = validate(&assemble(variant), capabilities(variant)).unwrap();
        let bytes = if variant.precision == Precision::F64 { 8 } else { 4 };
        let mut layouter = naga::proc::Layouter::default();
        layouter.update(module.to_ctx()).unwrap();
        let stride = |name: &str| {
            let (_, variable) = module.global_variables.iter().find(|(_, v)| v.name.as_deref() == Some(name)).unwrap();
            match module.types[variable.ty].inner {
                naga::TypeInner::Array { stride, .. } => stride,
                naga::TypeInner::Struct { span, .. } => span,
                ref other => panic!("{name}: {other:?}"),
            }
        };
        let lanes = u32::try_from(LANES).unwrap() * bytes;
        let sample = 16;
        for (name, expected) in [
            ("round", 12),
            ("jobs", 4),
            ("segments", 16),
            ("inputs", 4 * bytes),
            ("samples", sample),
            ("weights", 2 * bytes),
            ("maps", lanes),
            ("states", lanes),
            ("sums", lanes),
        ] {
            assert_eq!(stride(name), expected, "{name} in {variant:?}");
        }
    }
}

#[test]
fn an_invalid_shader_is_rejected() {
    let variant = Variant {
        precision: Precision::F32,
        absolute: false,
        weighted: false,
        uniform: true,
        fetch: Fetch::Direct,
        features: None,
    };
    let good = assemble(variant);
    validate(&good, Capabilities::empty()).unwrap();
    for (from, to) in [
        ("fn gain(", "fn gian("),
        ("sample.z", "sample.q"),
        ("@binding(MAPS_BINDING)", "@binding(WEIGHTS_BINDING)"),
        ("-> Run {", "-> Map {"),
    ] {
        assert!(good.contains(from));
        assert!(validate(&good.replacen(from, to, 1), Capabilities::empty()).is_err(), "{from} -> {to} went unnoticed");
    }
    let features = Some(ShaderFeatures { brushes: true, delayed: true, averages: [true; 2] });
    let extended = assemble(Variant { precision: Precision::F32Plain, features, ..variant });
    validate(&extended, Capabilities::empty()).unwrap();
    for (from, to) in [("fn advance(", "fn advances("), ("delay.shift", "delay.shaft"), ("const TAPS", "const TIPS")] {
        assert!(extended.contains(from));
        assert!(validate(&extended.replacen(from, to, 1), Capabilities::empty()).is_err(), "{from} -> {to}");
    }
    let f64 = assemble(Variant { precision: Precision::F64, ..variant });
    assert!(validate(&f64, Capabilities::empty()).is_err(), "f64 needs its capability");
}
