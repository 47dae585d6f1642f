//! JSON document of the characteristics of a result, from the output-error fit and from regressions.

use super::characteristics::{Characteristic, Characteristics};
use super::feedforward::Regression;
use super::fitted::FittedMotor;
use serde_json::{Map, Value, json};

/// Returns the key `characteristics` of a result, with the keys `output_error` and `regression`.
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
