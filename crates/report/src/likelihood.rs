//! Profile likelihoods as a JSON document.

use super::document::warnings;
use motorfit_identify::{Identification, LIKELIHOOD_LIMIT, LikelihoodProfile};
use motorfit_record::{Record, Severity};
use serde_json::{Value, json as value};

/// Returns the JSON document of profile likelihoods.
#[must_use]
pub fn likelihood_document(records: &[Record], found: &Identification, profiles: &[LikelihoodProfile]) -> Value {
    let profile = |of: &LikelihoodProfile| {
        value!({
            "parameter": of.name(),
            "unit": of.axis.parameter.unit(),
            "value": of.value,
            "std_error": of.std_error,
            "ci95": of.ci95,
            "likelihood95": of.likelihood95,
            "points": of.points,
        })
    };
    value!({
        "motorfit": env!("CARGO_PKG_VERSION"),
        "trust": found.trust,
        "records": records,
        "discretization": found.model.discretization.name(),
        "with": found.extensions(),
        "limit": LIKELIHOOD_LIMIT,
        "profiles": profiles.iter().map(profile).collect::<Value>(),
        "warnings": warnings(&found.warnings, Severity::Report),
        "seconds": found.seconds,
    })
}
