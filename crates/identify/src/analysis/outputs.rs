//! Outputs of machines, and their values as objects by name.

use motorfit_core::channels::NAMES;
use serde::Serialize;
use serde_json::{Value, json};

/// An output of a machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Output {
    /// Name, as `current`.
    pub name: String,
    /// Unit.
    pub unit: String,
}

/// Returns values of outputs by their names.
pub(crate) fn by_output<T: Serialize>(outputs: &[Output], values: &[T]) -> Value {
    outputs.iter().zip(values).map(|(output, value)| (output.name.clone(), json!(value))).collect()
}

/// Returns values of the outputs of the DC motor by their names.
pub(super) fn by_output_of_motor<T: Serialize>(values: &[T]) -> Value {
    NAMES.iter().zip(values).map(|(name, value)| ((*name).to_owned(), json!(value))).collect()
}
