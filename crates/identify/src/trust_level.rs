//! The level of trust in a result with its reasons, as a part of the result.

use motorfit_core::named::named;
use motorfit_core::setting::Text;
use motorfit_core::text::listed;

named! {
    /// The level of trust in the standard errors of a result.
    #[derive(serde::Serialize, serde::Deserialize)]
    #[serde(rename_all = "lowercase")]
    pub enum TrustLevel (default Check) {
        /// The standard errors can be trusted.
        Good = "good",
        /// Check the reasons before you trust the standard errors.
        Check = "check",
        /// The standard errors cannot be trusted.
        Poor = "poor",
    }
}

/// A reason against the level `good`.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct TrustReason {
    /// Stable identifier of the reason.
    pub code: &'static str,
    /// Description of the reason.
    pub message: Text,
}

/// The level of trust in a result, with its reasons and the next step.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize)]
pub struct Trust {
    /// Level of trust, the lowest that any reason leaves.
    pub level: TrustLevel,
    /// Names of the identified parameters and combinations, to which the level applies; empty without standard errors.
    pub of: Vec<String>,
    /// Parameters that the recordings do not identify.
    pub open: Vec<String>,
    /// Channel that would identify these, as `a current`; `None` if none is missing.
    pub needs: Option<String>,
    /// Reasons for a lower level, the most severe first; empty if the level is good.
    pub reasons: Vec<TrustReason>,
    /// Setting or operation to try next; `None` if the level is good.
    pub next: Option<Text>,
}

/// Largest number of names in a sentence.
const NAMES_MAX: usize = 8;

impl Trust {
    /// Returns the names to which the level applies, as `kV, kA and the time constant; R and L need a current`; empty if there are none, or for a poor level.
    #[must_use]
    pub fn subject(&self) -> String {
        if self.of.is_empty() || self.level == TrustLevel::Poor {
            return String::new();
        }
        let known = named(&self.of);
        match (&self.needs, self.open.len()) {
            (_, 0) => known,
            (Some(needs), 1) => format!("{known}; {} needs {needs}", named(&self.open)),
            (Some(needs), _) => format!("{known}; {} need {needs}", named(&self.open)),
            (None, 1) => format!("{known}; {} is not identified", named(&self.open)),
            (None, _) => format!("{known}; {} are not identified", named(&self.open)),
        }
    }
}

/// Lists names, or their number if they are many.
fn named(names: &[String]) -> String {
    let name = |name: &String| if name == "time_constant" { "the time constant".to_owned() } else { name.clone() };
    let names: Vec<String> = names.iter().map(name).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    if names.len() > NAMES_MAX { format!("{} parameters", names.len()) } else { listed(&names, "and") }
}

/// The codes of reasons with their meanings.
pub static REASONS: [(&str, &str); 41] = [
    ("poor_fit", "The residuals of a channel are large and far above its noise."),
    ("recording_missed", "The model does not fit a channel of one recording of a joint fit."),
    ("search_stuck", "A better optimum is known."),
    ("sign_reversed", "A channel has the opposite sign of the others."),
    ("units", "The magnitudes are implausible for a motor, but plausible in another unit."),
    ("recordings_differ", "The recordings are not of one motor under one condition."),
    ("filtered", "The signals of a model were filtered or resampled, which biases estimates of nonlinear equations."),
    ("not_accurate", "The estimates of a model depend on the steps of the integration."),
    ("validation", "Held-out recordings are predicted far worse than those of the fit."),
    ("not_converged", "The refinement has not converged."),
    ("search_inconclusive", "The global search is inconclusive."),
    ("not_verified", "No global search confirms the optimum."),
    ("not_polished", "Without a polish there are no standard errors."),
    ("residuals", "The residuals are autocorrelated, or correlated with the input."),
    ("implausible", "A current, speed or time constant is implausible for a motor: a unit may be wrong."),
    ("units_assumed", "No unit of a channel is given, and the assumed one scales the estimates."),
    (
        "position_ratio",
        "The position changes by another factor or sign than the integral of the speed, as behind a gear.",
    ),
    ("friction_differs", "Friction differs between the recordings."),
    ("model_incomplete", "The residuals show an effect that the model lacks."),
    ("not_separated", "Another model fits the recordings equally well."),
    ("at_bound", "A parameter ended at a bound."),
    ("late_voltage", "The outputs move before the recorded voltage changes."),
    ("between_samples", "The intersample behaviour of the voltage is not that of the discretization."),
    ("not_identifiable", "Not every parameter is identifiable."),
    ("sampled_law", "A control law of a model fits as well if it is sampled, with other estimates."),
    ("few_samples", "There are few samples."),
    ("averaged_sensor", "A sensor averages over samples, and the model has no moving average."),
    ("current_clipped", "The current is clipped or limited."),
    ("voltage_without_current", "The voltage does not reach the motor."),
    ("motion_without_input", "The motor moves without voltage."),
    ("speed_falls", "The speed falls where the voltage rises."),
    ("outliers", "Single samples are far from their neighbours."),
    ("input_noise", "The standard errors do not include the noise of the input."),
    ("initial_state", "A recording does not start as assumed."),
    ("units_disagree", "The speed is not the derivative of the position beside it."),
    ("unit_assumed", "The velocity of a mechanism has no unit."),
    ("voltage_small", "The voltage of the tests of a mechanism is as small as a duty cycle."),
    ("test_missing", "A test of a mechanism is missing."),
    ("test_without_motion", "A mechanism does not move in a test."),
    ("one_direction", "All tests of a mechanism move in one direction."),
    ("dead_time_long", "The dead time is longer than is plausible for a motor."),
];
