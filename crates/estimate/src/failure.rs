//! Reasons for which Steiglitz–McBride returns no estimate.

use motorfit_core::named::named;
use motorfit_core::setting::text;
use motorfit_core::{Error, ErrorKind};

named! {
    /// Reason for which Steiglitz–McBride returns no estimate.
    #[non_exhaustive]
    pub enum SmFailure: &'static str {
        /// Current or speed was not measured.
        ChannelMissing = "channel_missing" => "it needs current and speed",
        /// The samples are not evenly spaced.
        Irregular = "irregular_samples" => "it needs evenly spaced samples",
        /// The voltage does not excite the motor enough to estimate both transfer functions.
        RankDeficient = "rank_deficient_excitation" => "the voltage does not excite the motor enough",
        /// The estimated denominator has a root on or outside the unit circle.
        Unstable = "unstable" => "the estimated discrete-time motor is unstable",
        /// The estimated transition matrix has no real logarithm: it has a pole at or below zero.
        NoRealLogarithm = "no_real_logarithm" => "the estimated discrete-time motor has no continuous-time counterpart",
        /// The estimated continuous-time motor has a parameter that is not positive.
        NotAMotor = "not_a_motor" => "the estimated motor has a parameter that is not positive",
        /// A parameter is fixed, and Steiglitz–McBride estimates all five.
        Held = "parameter_held" => "it estimates all five parameters and cannot hold any of them fixed",
        /// The model has extensions.
        NotLinear = "not_linear" => "it needs the linear model",
        /// The estimated motor does not fit the recordings.
        PoorFit = "poor_fit" => "the estimated motor does not fit the recordings",
    }
}

impl SmFailure {
    /// Returns the reason as text.
    #[must_use]
    pub fn message(self) -> &'static str {
        self.row()
    }
}

impl From<SmFailure> for Error {
    fn from(failure: SmFailure) -> Self {
        let remedy = match failure {
            SmFailure::ChannelMissing | SmFailure::Irregular | SmFailure::Held | SmFailure::NotLinear => {
                text!("Use " [Method = "auto"] ".")
            }
            SmFailure::RankDeficient => "Record while the voltage changes.".into(),
            _ => text!("Use " [Method = "auto"] "; check the signs and units of the columns."),
        };
        Self::new(ErrorKind::NotIdentified, format!("Steiglitz–McBride failed: {}", failure.message()), remedy)
    }
}
