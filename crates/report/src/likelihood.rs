//! Profile likelihoods as a JSON document.

use super::document::warnings;
use super::shown::Shown;
use motorfit_identify::{Identification, LIKELIHOOD_LIMIT, LikelihoodProfile};
use motorfit_record::{Record, Severity};
use serde_json::{Value, json as value};

/// Returns the JSON document of profile likelihoods.
#[must_use]
pub fn likelihood_document<M: Shown>(
    records: &[Record],
    found: &Identification<M>,
    profiles: &[LikelihoodProfile],
) -> Value {
    let profile = |of: &LikelihoodProfile| {
        value!({
            "parameter": of.name,
            "unit": of.unit,
            "value": of.value,
            "std_error": of.std_error,
            "ci95": of.ci95,
            "likelihood95": of.likelihood95,
            "points": of.points,
        })
    };
    let mut document = value!({
        "motorfit": env!("CARGO_PKG_VERSION"),
        "trust": found.trust,
        "records": records,
        "with": found.with,
        "limit": LIKELIHOOD_LIMIT,
        "profiles": profiles.iter().map(profile).collect::<Value>(),
        "warnings": warnings(&found.warnings, Severity::Report),
        "seconds": found.seconds,
    });
    for (key, value) in M::named(found).into_iter().chain(M::equations(found)) {
        document[key] = value;
    }
    document
}
