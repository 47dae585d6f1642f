//! The whole shader of a program.

use super::elementary::definitions;
use super::emit::Emitter;
use super::layout::{HEAD, Layout};
use super::precision::ShaderPrecision;
use crate::program::{Operation, Program};
use crate::step::MemoryKind;

/// Settings of a shader.
#[derive(Debug, Clone, Copy)]
pub struct ShaderSettings {
    /// Precision of the numbers.
    pub precision: ShaderPrecision,
    /// True if magnitudes of errors are summed, false if squares.
    pub is_absolute: bool,
    /// Number of invocations of a workgroup.
    pub workgroup: usize,
}

/// Returns the shader of a program; `None` if it has a moving average, a delayed signal that depends on another one, or a constant that is
/// not a number.
pub fn shader(program: &Program, layout: &Layout, settings: &ShaderSettings) -> Option<String> {
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
            Operation::Memory(MemoryKind::Delay) => emitter.delay(at)?,
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

/// Returns the entry point. A round begins with the numbers that the one before it kept.
fn entry(layout: &Layout, initial: &[String], setup: &str, body: &str) -> String {
    let (states, sums) = (layout.states, layout.kept() - layout.states - 1);
    let at = |place: usize| format!("kept[{place}u * round_of.candidates + candidate]");
    let each = |count: usize, line: &dyn Fn(usize) -> String| (0..count).map(line).collect::<String>();
    let variable = |place: usize| match place.checked_sub(states) {
        None => format!("state{place}"),
        Some(output) => format!("sum{output}"),
    };
    let parameters = each(layout.parameters.len(), &|n| {
        format!("    let parameter{n} = parameters[{n}u * round_of.candidates + candidate];\n")
    });
    let setup: String = setup.lines().map(|line| format!("    {}\n", line.trim_start())).collect();
    let begin = each(states + sums, &|n| {
        format!("    var {} = {};\n", variable(n), initial.get(n).map_or("Scalar(0.0)", String::as_str))
    });
    let resume = each(states + sums, &|n| format!("        {} = {};\n", variable(n), at(n)));
    let uniforms = each(layout.uniforms, &|n| format!("        let uniform{n} = rows[row + {n}u];\n"));
    let bounds = each(states, &|n| format!("        is_finite = is_finite && abs(state{n}) < BOUND;\n"));
    let keep = each(states + sums, &|n| format!("    {} = {};\n", at(n), variable(n)));
    let mark = at(states + sums);
    format!(
        "fn evaluate(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {{
    let candidate = (group.y * round_of.width + group.x) * WORKGROUP + lane;
    if candidate >= round_of.candidates {{
        return;
    }}
{parameters}{setup}{begin}    var is_finite = true;
    if round_of.first > 0u {{
{resume}        is_finite = {mark} < Scalar(0.5);
    }}
    for (var n = round_of.first; n < round_of.end; n++) {{
        let row = HEAD + n * ROW;
{uniforms}{body}{bounds}    }}
{keep}    {mark} = select(Scalar(1.0), Scalar(0.0), is_finite);
}}
"
    )
}
