//! The elementary functions that a shader needs.

use super::precision::ShaderPrecision;
use crate::graph::Unary;
use crate::program::{Operation, Program};

/// Includes the text of a file of `shaders/elementary/`.
macro_rules! elementary {
    ($name:literal) => {
        include_str!(concat!("../../shaders/elementary/", $name, ".wgsl"))
    };
}

/// Returns the definitions of the functions that the instructions of a program call.
pub(super) fn definitions(program: &Program, precision: ShaderPrecision) -> String {
    let has = |operations: &[Operation]| {
        program.setup.iter().chain(&program.body).any(|instruction| operations.contains(&instruction.operation))
    };
    let has_log = has(&[Operation::Function(Unary::Log), Operation::Power]);
    let has_exp = has_log || has(&[Operation::Function(Unary::Exp), Operation::Function(Unary::Tanh)]);
    let normalized = precision.normalized();
    let parts = [
        (has_exp, elementary!("exp")),
        (has_log, elementary!("log")),
        (has_log, &normalized),
        (has(&[Unary::Sin, Unary::Cos, Unary::Tan].map(Operation::Function)), elementary!("sine")),
        (has(&[Operation::Function(Unary::Atan), Operation::Atan2]), elementary!("atan")),
    ];
    parts.into_iter().filter_map(|(is_needed, text)| is_needed.then_some(text)).collect::<Vec<_>>().join("\n")
}
