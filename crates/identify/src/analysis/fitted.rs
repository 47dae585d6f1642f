//! The view of a finished fit that the analysis uses.

use motorfit_estimate::Uncertainty;
use motorfit_motor::{Input, Parameter, Parameters, Scope, Space};

/// A fitted motor with its search space and uncertainty.
#[derive(Debug, Clone, Copy)]
pub struct FittedMotor<'a> {
    /// Input of the motor: voltage or current.
    pub input: Input,
    /// R, L, K, B and J, fixed ones included.
    pub parameters: &'a Parameters,
    /// Search space of the fit.
    pub space: &'a Space,
    /// Values of the free parameters, in the order of the space.
    pub values: &'a [f64],
    /// Parameters that the recordings do not identify.
    pub unidentified: &'a [(Parameter, Scope)],
    /// Standard errors and correlations; `None` without a refinement.
    pub uncertainty: Option<&'a Uncertainty>,
    /// Standard deviation of the residuals of current \[A\] and speed \[rad/s\]; `None` for a channel that was not measured.
    pub residual_sigma: &'a [Option<f64>],
}

impl FittedMotor<'_> {
    /// Returns the standard deviation of the residuals of current or speed; `None` if the channel was not measured.
    #[must_use]
    pub(super) fn sigma(&self, channel: usize) -> Option<f64> {
        self.residual_sigma.get(channel).copied().flatten()
    }

    /// Returns true if a parameter is not identifiable, for all recordings or for one of them.
    #[must_use]
    pub fn lacks(&self, parameter: Parameter) -> bool {
        self.unidentified.iter().any(|(of, _)| *of == parameter)
    }

    /// Returns the value of a shared parameter, free or fixed; `None` if the model has no such parameter.
    #[must_use]
    pub fn shared(&self, parameter: Parameter) -> Option<f64> {
        let free = self.space.free().iter().zip(self.values).map(|(axis, value)| (axis.parameter, axis.scope, *value));
        let mut all = free.chain(self.space.fixed().iter().copied());
        all.find(|(of, scope, _)| *of == parameter && *scope == Scope::Shared).map(|(.., value)| value)
    }
}
