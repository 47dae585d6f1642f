//! The whole shader of a program.

use super::elementary::definitions;
use super::emit::Emitter;
use super::layout::{HEAD, Layout};
use super::precision::ShaderPrecision;
use crate::model::program::{Operation, Program};
use std::fmt::Write as _;

/// Settings of a shader.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ShaderSettings {
    pub precision: ShaderPrecision,
    /// True if magnitudes of errors are summed, false if squares.
    pub is_absolute: bool,
    /// Number of invocations of a workgroup.
    pub workgroup: usize,
}

/// Returns the shader of a program; `None` if it has an operation that shaders do not have: a moving average.
pub(crate) fn shader(program: &Program, layout: &Layout, settings: &ShaderSettings) -> Option<String> {
    let precision = settings.precision;
    let mut emitter = Emitter::new(program, precision);
    for instruction in &program.setup {
        emitter.instruction(instruction, "HEAD")?;
    }
    let setup = std::mem::take(&mut emitter.text);
    let initial: Vec<String> =
        program.states.iter().map(|(_, value)| emitter.name(*value).map(str::to_owned)).collect::<Option<_>>()?;
    for (at, instruction) in program.body.iter().enumerate() {
        match instruction.operation {
            Operation::Output => {
                let value = emitter.name(instruction.registers[0])?.to_owned();
                let loss = loss(layout, usize::from(instruction.target), &value, settings.is_absolute);
                emitter.text.push_str(&loss);
            }
            Operation::Delay => emitter.delay(at)?,
            _ => emitter.instruction(instruction, "row")?,
        }
    }
    let body = emitter.text;
    Some(format!(
        "{}{DECLARATIONS}const HEAD = {HEAD}u;\nconst WORKGROUP = {}u;\nconst ROW = {}u;\n\n{}\n@compute @workgroup_size({})\n{}",
        precision.prelude(),
        settings.workgroup,
        layout.row(),
        definitions(program, precision),
        settings.workgroup,
        entry(layout, &initial, &setup, &body)
    ))
}

/// The buffers, whose contents are those of `Layout`.
const DECLARATIONS: &str = "
struct Round {
    // First sample, and the one after the last.
    first: u32,
    end: u32,
    candidates: u32,
    // Number of workgroups in a row of the dispatch.
    width: u32,
}

@group(0) @binding(0) var<uniform> round_of: Round;
@group(0) @binding(1) var<storage, read> rows: array<Scalar>;
@group(0) @binding(2) var<storage, read> parameters: array<Scalar>;
@group(0) @binding(3) var<storage, read_write> kept: array<Scalar>;

";

/// Returns the statements that add the error of an output to its sum.
fn loss(layout: &Layout, output: usize, value: &str, is_absolute: bool) -> String {
    let Some(place) = layout.measured.iter().position(|measured| *measured == output) else { return String::new() };
    let at = layout.uniforms + place;
    let weight =
        if layout.is_weighted { format!("rows[row + {}u] * ", at + layout.measured.len()) } else { String::new() };
    let sum = match is_absolute {
        true => format!("sum{place} + {weight}abs(error{place})"),
        false => format!("fma({weight}error{place}, error{place}, sum{place})"),
    };
    format!(
        "        let error{place} = rows[row + {at}u] - {value};\n        sum{place} = {sum};\n        is_finite = is_finite && abs(error{place}) < BOUND;\n"
    )
}

/// Returns the entry point.
fn entry(layout: &Layout, initial: &[String], setup: &str, body: &str) -> String {
    let (states, sums) = (layout.states, layout.kept() - layout.states - 1);
    let at = |place: usize| format!("kept[{place}u * round_of.candidates + candidate]");
    let mut text = String::from(
        "fn evaluate(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {\n    \
         let candidate = (group.y * round_of.width + group.x) * WORKGROUP + lane;\n    \
         if candidate >= round_of.candidates {\n        return;\n    }\n",
    );
    for n in 0..layout.parameters.len() {
        let _ = writeln!(text, "    let parameter{n} = parameters[{n}u * round_of.candidates + candidate];");
    }
    text.push_str(&setup.replace("\n        ", "\n    ").replacen("        ", "    ", 1));
    for (n, initial) in initial.iter().enumerate() {
        let _ = writeln!(text, "    var state{n} = {initial};");
    }
    for n in 0..sums {
        let _ = writeln!(text, "    var sum{n} = Scalar(0.0);");
    }
    text.push_str("    var is_finite = true;\n    if round_of.first > 0u {\n");
    for n in 0..states {
        let _ = writeln!(text, "        state{n} = {};", at(n));
    }
    for n in 0..sums {
        let _ = writeln!(text, "        sum{n} = {};", at(states + n));
    }
    let _ = writeln!(text, "        is_finite = {} < Scalar(0.5);\n    }}", at(states + sums));
    text.push_str("    for (var n = round_of.first; n < round_of.end; n++) {\n        let row = HEAD + n * ROW;\n");
    for n in 0..layout.uniforms {
        let _ = writeln!(text, "        let uniform{n} = rows[row + {n}u];");
    }
    text.push_str(body);
    for n in 0..states {
        let _ = writeln!(text, "        is_finite = is_finite && abs(state{n}) < BOUND;");
    }
    text.push_str("    }\n");
    for n in 0..states {
        let _ = writeln!(text, "    {} = state{n};", at(n));
    }
    for n in 0..sums {
        let _ = writeln!(text, "    {} = sum{n};", at(states + n));
    }
    let _ = writeln!(text, "    {} = select(Scalar(1.0), Scalar(0.0), is_finite);\n}}", at(states + sums));
    text
}
