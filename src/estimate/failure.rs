//! Reasons why Steiglitz–McBride gives no estimate.

use crate::named::named;
use crate::setting::text;
use crate::{Error, ErrorKind};

named! {
    /// Why there is no estimate.
    #[non_exhaustive]
    pub enum SmFailure: &'static str {
        /// Current or speed was not measured.
        ChannelMissing = "channel_missing" => "it needs current and speed",
        /// The samples are not evenly spaced.
        Irregular = "irregular_samples" => "it needs evenly spaced samples",
        /// The voltage does not excite the motor enough for the two transfer functions.
        RankDeficient = "rank_deficient_excitation" => "the voltage does not excite the motor enough",
        /// The denominator found has a root on or outside the unit circle.
        Unstable = "unstable" => "the sampled motor that fits is unstable",
        /// The sampled motor has no real logarithm: a pole at or below zero.
        NoRealLogarithm = "no_real_logarithm" => "the sampled motor that fits has no continuous counterpart",
        /// The continuous motor found has a parameter that is not positive.
        NotAMotor = "not_a_motor" => "the motor that fits has a parameter that is not positive",
        /// A parameter is held: Steiglitz–McBride estimates all five.
        Held = "parameter_held" => "it estimates all five parameters and cannot hold any",
        /// Its motor does not fit the recordings.
        PoorFit = "poor_fit" => "its motor does not fit the recordings",
    }
}

impl SmFailure {
    /// Returns the reason in words.
    #[must_use]
    pub fn message(self) -> &'static str {
        self.row()
    }
}

impl From<SmFailure> for Error {
    fn from(failure: SmFailure) -> Self {
        let remedy = match failure {
            SmFailure::ChannelMissing | SmFailure::Irregular | SmFailure::Held => text!("Use " [Method = "auto"] "."),
            SmFailure::RankDeficient => "Record while the voltage changes.".into(),
            _ => text!("Use " [Method = "auto"] "; check the signs and units of the columns."),
        };
        Self::new(ErrorKind::NotIdentified, format!("Steiglitz–McBride failed: {}", failure.message()), remedy)
    }
}
