//! The characteristics of a result as a document: by output error, and by regression beside it.

use super::characteristics::{Characteristic, Characteristics};
use super::feedforward::Regression;
use super::fitted::FittedMotor;
use serde_json::{Map, Value, json};

/// The part `characteristics` of a result: by output error, and by regression beside it.
pub(crate) fn characteristics_document(found: FittedMotor<'_>, regressions: &[Regression]) -> Value {
    let of = |c: Characteristic, unit: &str| json!({"value": c.value, "unit": unit, "std_error": c.std_error});
    let named = Characteristics::named_of(found);
    let by_error = named.map(|(name, unit, c)| (name.to_owned(), c.map_or(Value::Null, |c| of(c, unit))));
    let by_regression = |r: &Regression| {
        json!({
            "window_s": r.window_s, "window_samples": r.window_samples, "samples": r.samples,
            "kS": of(r.ks, named[0].1), "kV": of(r.kv, named[1].1), "kA": of(r.ka, named[2].1),
        })
    };
    json!({
        "output_error": by_error.into_iter().collect::<Map<String, Value>>(),
        "regression": regressions.iter().map(by_regression).collect::<Value>(),
    })
}
