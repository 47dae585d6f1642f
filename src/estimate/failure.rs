//! Reasons why Steiglitz–McBride gives no estimate.

use crate::setting::text;
use crate::{Error, ErrorKind};

/// Why there is no estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum SmFailure {
    /// Current or speed was not measured.
    ChannelMissing,
    /// The samples are not evenly spaced.
    Irregular,
    /// The voltage does not excite the motor enough for the two transfer functions.
    RankDeficient,
    /// The denominator found has a root on or outside the unit circle.
    Unstable,
    /// The sampled motor has no real logarithm: a pole at or below zero.
    NoRealLogarithm,
    /// The continuous motor found has a parameter that is not positive.
    NotAMotor,
    /// A parameter is held: Steiglitz–McBride estimates all five.
    Held,
    /// Its motor does not fit the recordings.
    PoorFit,
}

impl SmFailure {
    /// A short name that does not change.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ChannelMissing => "channel_missing",
            Self::Irregular => "irregular_samples",
            Self::RankDeficient => "rank_deficient_excitation",
            Self::Unstable => "unstable",
            Self::NoRealLogarithm => "no_real_logarithm",
            Self::NotAMotor => "not_a_motor",
            Self::Held => "parameter_held",
            Self::PoorFit => "poor_fit",
        }
    }

    /// In words.
    #[must_use]
    pub fn message(self) -> &'static str {
        match self {
            Self::ChannelMissing => "it needs current and speed",
            Self::Irregular => "it needs evenly spaced samples",
            Self::RankDeficient => "the voltage does not excite the motor enough",
            Self::Unstable => "the sampled motor that fits is unstable",
            Self::NoRealLogarithm => "the sampled motor that fits has no continuous counterpart",
            Self::NotAMotor => "the motor that fits has a parameter that is not positive",
            Self::PoorFit => "its motor does not fit the recordings",
            Self::Held => "it estimates all five parameters and cannot hold any",
        }
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
