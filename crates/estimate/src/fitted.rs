//! A problem as estimators see it: recordings of a machine with outputs, of which some were measured, free parameters in their
//! coordinates, and initial states. The DC motor and users' models implement it (`motor.rs`, `model/fitted.rs`).

use motorfit_core::coordinate::Coordinate;
use motorfit_evaluate::noise_share;
use nalgebra::{DMatrix, DVector};

/// An output of a recording: the number of the recording and that of the output.
pub type Place = (usize, usize);

/// Standard deviation of each output of each recording; 1 for one that was not measured.
pub(crate) type Sigma = Vec<Vec<f64>>;

/// Returns the state `[i, ω]` of the DC motor from a list.
pub(super) fn state(initial: &[f64]) -> [f64; 2] {
    [0, 1].map(|n| initial.get(n).copied().unwrap_or_default())
}

/// A candidate with the initial states of each recording.
#[derive(Debug, Clone)]
pub struct Point {
    /// Values of the free parameters.
    pub values: Vec<f64>,
    /// Initial states of each recording.
    pub initial: Vec<Vec<f64>>,
}

/// Sums over the samples of an output of a recording, without weights: JᵀJ, Jᵀe and eᵀe with sensitivities J and residuals e. The
/// unknowns are those of the recording: the coordinates of its parameters in the order of the space, then its initial states if they
/// are unknown.
#[derive(Debug, Clone)]
pub struct Block {
    /// Products of the sensitivities with each other.
    pub matrix: DMatrix<f64>,
    /// Products of the sensitivities with the residuals.
    pub gradient: DVector<f64>,
    /// Sum of squared residuals.
    pub squares: f64,
}

impl Block {
    /// Returns the sums of an output that was not measured.
    #[must_use]
    pub fn none(unknowns: usize) -> Self {
        Self { matrix: DMatrix::zeros(unknowns, unknowns), gradient: DVector::zeros(unknowns), squares: 0.0 }
    }

    /// Returns true if all sums are finite, that is, the machine did not diverge.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.squares.is_finite() && self.matrix.iter().chain(&self.gradient).all(|value| value.is_finite())
    }
}

/// A problem that is fitted: its parameters, recordings and derivatives.
pub trait Fitted: Sync {
    /// Returns the coordinates of the free parameters.
    fn axes(&self) -> Vec<Coordinate>;
    /// Returns true if a free parameter acts on a recording.
    fn acts(&self, axis: usize, recording: usize) -> bool;
    /// Returns the number of recordings.
    fn recordings(&self) -> usize;
    /// Returns the number of outputs.
    fn outputs(&self) -> usize;
    /// Returns true if an output was measured.
    fn has(&self, of: Place) -> bool;
    /// Returns the number of samples of a recording.
    fn samples(&self, recording: usize) -> usize;
    /// Returns the number of samples of a measured output that are not masked.
    fn count(&self, of: Place) -> usize;
    /// Returns the measured values of an output that are not masked; empty for one that was not measured.
    fn measured(&self, of: Place) -> Vec<f64>;
    /// Returns the root mean square of a measured output.
    fn rms(&self, of: Place) -> f64;
    /// Returns the standard deviation of the noise of a measured output, estimated from the output alone.
    fn noise(&self, of: Place) -> f64;
    /// Returns the standard deviation of a measured output.
    fn deviation(&self, of: Place) -> f64;
    /// Returns the fraction of the samples of a recording that count as independent.
    fn effective_sample_ratio(&self, recording: usize) -> f64;
    /// Returns the initial states of a recording as they are measured or known.
    fn initial(&self, recording: usize) -> Vec<f64>;
    /// Returns the number of initial states of a recording that are unknown: all of [`Self::initial`], or none.
    fn states(&self, recording: usize) -> usize;
    /// Returns true if friction that sticks makes the cost not smooth.
    fn has_kinks(&self) -> bool;
    /// Returns how many points are computed side by side in the time of one.
    fn side_by_side(&self) -> usize;
    /// Returns the sums of the outputs of a recording at each point; `None` for a point at which the machine diverges.
    fn blocks(&self, points: &[Point], recording: usize) -> Vec<Option<Vec<Block>>>;
    /// Returns the residuals of each output at the samples that count; empty for one that was not measured.
    fn residuals(&self, values: &[f64], recording: usize, initial: &[f64]) -> Vec<Vec<f64>>;
    /// Returns the residuals of each output at all samples of its sensor, masked ones included; empty for one that was not measured.
    fn all_residuals(&self, values: &[f64], recording: usize, initial: &[f64]) -> Vec<Vec<f64>> {
        self.residuals(values, recording, initial)
    }
    /// Returns `Xᵀ Γ X` of each output, X the sensitivities to the unknowns of the recording and Γ the covariance of the autoregression
    /// with the coefficients of the output for innovations of variance one.
    fn shaped(&self, values: &[f64], recording: usize, initial: &[f64], filters: &[Vec<f64>]) -> Vec<DMatrix<f64>>;

    /// Returns the fraction of the variance of residuals of standard deviation `sigma` that noise can account for.
    fn noise_share(&self, of: Place, sigma: f64) -> f64 {
        noise_share(self.noise(of), sigma)
    }

    /// Returns true if an output was measured and residuals of standard deviation `sigma` exceed its noise.
    fn is_above_noise(&self, of: Place, sigma: f64) -> bool {
        self.has(of) && self.noise_share(of, sigma) < 1.0
    }
}
