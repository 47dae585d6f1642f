//! A finished fit, as the analysis takes it.

use crate::estimate::Uncertainty;
use crate::motor::{Input, Parameter, Parameters, Scope, Space};

/// A motor that was fitted, with what was free and how certain it is.
#[derive(Debug, Clone, Copy)]
pub struct FittedMotor<'a> {
    /// The input of the motor: its voltage, or its current.
    pub input: Input,
    /// R, L, K, B and J, fixed ones included.
    pub parameters: &'a Parameters,
    /// The space of the fit.
    pub space: &'a Space,
    /// Values of the free parameters, in the order of the space.
    pub values: &'a [f64],
    /// Parameters that the recordings do not identify.
    pub unidentified: &'a [(Parameter, Scope)],
    /// Standard errors and correlations; `None` without a refinement.
    pub uncertainty: Option<&'a Uncertainty>,
    /// σ of the residuals of current and speed; `None` for a channel not measured.
    pub residual_sigma: [Option<f64>; 2],
}

impl FittedMotor<'_> {
    /// Returns whether the recordings do not identify a parameter, in whichever of them.
    #[must_use]
    pub fn lacks(&self, parameter: Parameter) -> bool {
        self.unidentified.iter().any(|(of, _)| *of == parameter)
    }

    /// Returns the value that all recordings share of a parameter, free or fixed; `None` where the model lacks it.
    #[must_use]
    pub fn shared(&self, parameter: Parameter) -> Option<f64> {
        let free = self.space.free().iter().zip(self.values).map(|(axis, value)| (axis.parameter, axis.scope, *value));
        let mut all = free.chain(self.space.fixed().iter().copied());
        all.find(|(of, scope, _)| *of == parameter && *scope == Scope::Shared).map(|(.., value)| value)
    }
}
