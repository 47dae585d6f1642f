//! The part of a result that only those of the DC motor have.

use super::estimates::Combination;
use crate::analysis::{NoiseFloor, Regression, Validation};
use motorfit_evaluate::Model;
use motorfit_motor::{Input, Parameter, Parameters, Scope, Space};

/// The DC motor of a result.
#[derive(Debug, Clone, PartialEq)]
pub struct DcMotor {
    /// Input of the recordings: voltage or current.
    pub input: Input,
    /// Simulation model: that of the spec, possibly with another intersample behaviour if that was selected automatically.
    pub model: Model,
    /// R, L, K, B and J of the first recording, fixed ones included.
    pub parameters: Parameters,
    /// Parameters that the recordings do not identify, those that only a missing channel would identify included.
    pub unidentified: Vec<(Parameter, Scope)>,
    /// Feedforward characteristics, where they and not the parameters are identified.
    pub identified: Vec<Combination>,
    /// Search space with the bounds as they were used.
    pub space: Space,
    /// Initial state `[i, ω]` of each recording \[A, rad/s\].
    pub initial: Vec<[f64; 2]>,
    /// Fit of held-out recordings, if there are any.
    pub validation: Option<Validation>,
    /// Feedforward characteristics by regression, for comparison with
    /// [`Characteristics::of`](crate::analysis::Characteristics::of).
    pub regressions: Vec<Regression>,
    /// Noise floor, if recordings have the same input.
    pub noise_floor: Option<NoiseFloor>,
}
