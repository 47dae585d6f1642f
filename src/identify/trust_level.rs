//! How far a result can be believed, as results say it.

use crate::named::named;
use crate::setting::Text;

named! {
    /// How far the standard errors of a result can be believed.
    #[derive(serde::Serialize)]
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

/// Whether a result can be believed.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize)]
pub struct Trust {
    /// How far.
    pub level: TrustLevel,
    /// Why not further, the gravest reason first; empty where the level is good.
    pub reasons: Vec<TrustReason>,
    /// Settings or the operation to try next; `None` where the level is good.
    pub next: Option<Text>,
}
