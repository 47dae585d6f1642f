//! The normalized model: one motor that represents all that are consistent with recordings which lack a channel.

use crate::motor::{Parameter, Space};
use crate::warning::Warning;

/// A normalized representative of all motors consistent with recordings.
pub(super) struct NormalizedModel {
    /// What is free of it, and what is fixed.
    pub space: Space,
    /// R, L, K, B and J of one that is near.
    pub motor: [f64; 5],
    /// The parameters that the recordings do not identify.
    pub unknown: Vec<Parameter>,
    pub warning: Warning,
}
