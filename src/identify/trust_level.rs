//! The level of trust in a result, as results carry it.

use crate::named::named;
use crate::setting::Text;

named! {
    /// The level of trust in the standard errors of a result.
    #[derive(serde::Serialize, serde::Deserialize)]
    #[serde(rename_all = "lowercase")]
    pub enum TrustLevel (default Check) {
        /// They can be believed.
        Good = "good",
        /// Something is to be looked at first.
        Check = "check",
        /// They cannot be believed.
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
