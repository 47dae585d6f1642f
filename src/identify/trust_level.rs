//! The level of trust in a result, as results carry it.

use crate::named::named;
use crate::setting::Text;

named! {
    /// The level of trust in the standard errors of a result.
    #[derive(serde::Serialize, serde::Deserialize)]
    #[serde(rename_all = "lowercase")]
    pub enum TrustLevel (default Check) {
        /// The standard errors can be believed.
        Good = "good",
        /// Something is to be looked at first.
        Check = "check",
        /// The standard errors cannot be believed.
        Poor = "poor",
    }
}

/// A reason not to believe a result without more ado.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct TrustReason {
    /// A short name that does not change.
    pub code: &'static str,
    /// In words.
    pub message: Text,
}

/// The level of trust in a result, with its reasons and the next step.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize)]
pub struct Trust {
    /// The level.
    pub level: TrustLevel,
    /// Why not further, the gravest reason first; empty where the level is good.
    pub reasons: Vec<TrustReason>,
    /// Settings or the operation to try next; `None` where the level is good.
    pub next: Option<Text>,
}

/// The codes of reasons, each with what it says.
pub static REASONS: [(&str, &str); 28] = [
    ("poor_fit", "The model leaves much of a channel unexplained, far more than noise."),
    ("recording_missed", "The model misses a channel of one recording of a joint fit."),
    ("search_stuck", "A better optimum is known."),
    ("sign_reversed", "A channel has the opposite sign of the others."),
    ("units", "Magnitudes fit no motor, but would in another unit."),
    ("recordings_differ", "The recordings are not of one motor under one condition."),
    ("not_converged", "The refinement has not come to its end."),
    ("search_inconclusive", "The search of the whole box is inconclusive."),
    ("not_verified", "No search of the whole box confirms the optimum."),
    ("not_polished", "Without a polish there are no standard errors."),
    ("residuals", "The residuals are correlated, or the input explains part of them."),
    ("implausible", "No usual motor has such a current, speed or time constant: a unit may be wrong."),
    ("friction_differs", "Friction differs between the recordings."),
    ("model_incomplete", "The residuals show an effect that the model lacks."),
    ("not_separated", "Another model explains the recordings as well."),
    ("at_bound", "A parameter ended at a bound."),
    ("late_voltage", "The outputs move before the recorded voltage changes."),
    ("between_samples", "The voltage goes on otherwise between samples than the discretization has it."),
    ("not_identifiable", "Not every parameter is identifiable."),
    ("few_samples", "There are few samples."),
    ("averaged_sensor", "A sensor shows an average over samples, and the model has none."),
    ("current_clipped", "The current is cut off or limited."),
    ("voltage_without_current", "The voltage does not reach the motor."),
    ("motion_without_input", "The motor moves without voltage."),
    ("speed_falls", "The speed falls where the voltage rises."),
    ("input_noise", "Noise of the input biases the parameters."),
    ("initial_state", "A recording does not start as assumed."),
    ("dead_time_long", "The dead time is longer than a motor explains."),
];
