//! Choice of the integration method of a model for a problem.
//!
//! Affine equations on an even clock take matrix exponentials, which are exact. For others the largest eigenvalue |λ| of the Jacobian
//! is sought over the bounds and along trajectories: a state at rest hides the stiffness of a backlash. With `h|λ|` up to 0.7
//! the error of the Runge–Kutta method is below 1e-3 of a step's change and falls with its fourth power; beyond, exponentials are exact
//! for the stiff affine part. On irregular clocks the Runge–Kutta method takes substeps instead.

use super::recording::ModelRecording;
use super::space::ModelSpace;
use super::stiffness::{STIFFNESS_MAX, largest_rate};
use motorfit_core::numeric::{count, whole};
use motorfit_model::step::Affine;
use motorfit_model::{IntegrationMethod, Model, ModelOutput};

/// Returns true if a ratio is a whole number up to the accuracy of a clock.
fn is_whole(ratio: f64) -> bool {
    ratio.round() >= 1.0 && (ratio / ratio.round() - 1.0).abs() < 1e-9
}

/// Largest number of substeps.
pub(super) const SUBSTEPS_MAX: usize = 64;

/// Stiffness of a model on some recordings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stiffness {
    /// Largest magnitude of an eigenvalue of the Jacobian that was found \[1/s\].
    pub rate: f64,
    /// Longest step times that rate.
    pub per_step: f64,
    /// True if the equations are affine in states and inputs.
    pub is_affine: bool,
}

/// The largest change of an estimate between two numbers of substeps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepChange {
    /// Place of the parameter among the free ones.
    pub axis: usize,
    /// Magnitude of the change \[standard errors\].
    pub std_errors: f64,
    /// Numbers of substeps, the smaller first.
    pub substeps: [usize; 2],
}

/// Integration method of a model on some recordings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelMethod {
    /// The method.
    pub method: IntegrationMethod,
    /// Number of substeps of the Runge–Kutta method; 1 for exponentials.
    pub substeps: usize,
    /// The stiffness that decided.
    pub stiffness: Stiffness,
    /// True if `h|λ|` of a substep is larger than the method is accurate for.
    pub is_rough: bool,
    /// The largest change of an estimate in the last halving of the steps; `None` where none was tried.
    pub change: Option<StepChange>,
    /// True if the model has friction that sticks, delays, filters of sensors, or laws that are sampled between samples, whose events within a step are exact to
    /// second order only.
    pub has_events: bool,
}

impl ModelMethod {
    /// Chooses the method of a model.
    pub(super) fn of(model: &Model, space: &ModelSpace, recordings: &[ModelRecording]) -> Self {
        let is_even = recordings.iter().all(|recording| recording.regular_step_s().is_some());
        let mut graph = model.graph.clone();
        let affine = Affine::of(model, &mut graph);
        let is_affine = affine.is_complete(&graph);
        let step = recordings.iter().map(ModelRecording::longest_step_s).fold(0.0, f64::max);
        let rate = if is_even && is_affine { 0.0 } else { largest_rate(model, space, recordings) };
        let stiffness = Stiffness { rate, per_step: step * rate, is_affine };
        let even = recordings.first().and_then(ModelRecording::regular_step_s);
        let is_of_samples = |period: f64| even.is_some_and(|step| is_whole(period / step) || is_whole(step / period));
        let is_sampled_between = !is_even || model.laws.iter().any(|law| !is_of_samples(law.period_s));
        let has_laws = !model.laws.is_empty();
        let is_late = !model.delayed.is_empty() || model.outputs.iter().any(ModelOutput::is_late);
        let has_events = model.reactions() > 0 || is_late || has_laws && is_sampled_between;
        // Laws that are sampled faster than the recording have their instants at substeps.
        let of_laws = model.laws.iter().map(|law| (step / law.period_s - 1e-6).ceil()).fold(1.0, f64::max);
        let of_laws = whole(of_laws.min(count(SUBSTEPS_MAX)));
        let change = None;
        let exponential = Self {
            method: IntegrationMethod::Exponential,
            substeps: of_laws,
            stiffness,
            is_rough: false,
            change,
            has_events,
        };
        if is_even && (is_affine || stiffness.per_step > STIFFNESS_MAX) {
            return exponential;
        }
        let needed = whole((stiffness.per_step / STIFFNESS_MAX).ceil().min(1e6)).max(1);
        let substeps = needed.next_multiple_of(of_laws).min(SUBSTEPS_MAX);
        let is_rough = needed > substeps;
        Self { method: IntegrationMethod::RungeKutta, substeps, stiffness, is_rough, change, has_events }
    }

    /// Returns true if steps are exact: affine equations with matrix exponentials, without friction that sticks and without delays.
    #[must_use]
    pub fn is_exact(&self) -> bool {
        self.method == IntegrationMethod::Exponential && self.stiffness.is_affine && !self.has_events
    }

    /// Returns true if a substep is too long for the largest eigenvalue of the equations. Exponentials are exact for their affine part.
    #[must_use]
    pub fn is_stiff(&self) -> bool {
        self.method == IntegrationMethod::RungeKutta
            && self.stiffness.per_step > STIFFNESS_MAX * motorfit_core::numeric::count(self.substeps)
    }

    /// Returns a description of the method and of the reason for it.
    #[must_use]
    pub fn described(&self) -> String {
        let Stiffness { per_step, is_affine, .. } = self.stiffness;
        let stiffness = motorfit_core::text::significant(per_step, 2);
        match self.method {
            IntegrationMethod::Exponential if self.is_exact() => {
                "matrix exponentials, exact: the equations are affine".to_owned()
            }
            IntegrationMethod::Exponential if is_affine => {
                let substeps =
                    if self.substeps > 1 { format!("{} substeps", self.substeps) } else { "one step".to_owned() };
                format!(
                    "matrix exponentials with {substeps}: the equations are affine, up to friction that sticks and delays"
                )
            }
            IntegrationMethod::Exponential if self.substeps > 1 => {
                format!("exponential Runge–Kutta of order 4 with {} substeps (h|λ| = {stiffness})", self.substeps)
            }
            IntegrationMethod::Exponential => {
                format!(
                    "exponential Runge–Kutta of order 4: the equations are stiff for the sampling period (h|λ| = {stiffness})"
                )
            }
            IntegrationMethod::RungeKutta if self.substeps == 1 => {
                format!("Runge–Kutta of order 4 (h|λ| = {stiffness})")
            }
            IntegrationMethod::RungeKutta => {
                format!("Runge–Kutta of order 4 with {} substeps (h|λ| = {stiffness})", self.substeps)
            }
        }
    }
}
