//! Description of the device and the evaluator that computed costs.

use serde::Serialize;
use std::fmt;

/// The device that evaluated candidates.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct DeviceUsed {
    /// Kind: `cpu` or `gpu`.
    pub kind: &'static str,
    /// Name; empty if nothing was evaluated.
    pub name: String,
    /// Precision, `f32` or `f64`.
    pub precision: &'static str,
    /// Evaluator: `kernel` or `tables` on the CPU, `shader` on a GPU.
    pub evaluator: &'static str,
}

impl Default for DeviceUsed {
    /// Returns the CPU and its kernel, without a name.
    fn default() -> Self {
        Self { kind: "cpu", name: String::new(), precision: "f64", evaluator: "kernel" }
    }
}

impl fmt::Display for DeviceUsed {
    /// Writes the name, the precision and, if there were any, the tables.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let tables = if self.evaluator == "tables" { ", tables of poles" } else { "" };
        write!(f, "{}, {}{tables}", self.name, self.precision)
    }
}
