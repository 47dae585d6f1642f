//! JSON: all parameters with units and errors, and their roles in simulators.

use super::contents::{Exported, ExportedParameter};
use motorfit_model::Role;
use serde_json::{Map, Value, json};

/// Version of the format.
const VERSION: u32 = 1;

/// Returns the text of the file.
pub(super) fn text(of: &Exported) -> String {
    let parameter = |p: &ExportedParameter| {
        let entry = json!({"name": p.name, "value": p.value, "unit": p.unit, "std_error": p.std_error, "ci95": p.ci95});
        (p.symbol.clone(), entry)
    };
    let role = |(role, value): &(Role, f64)| (role.name().to_owned(), json!({"value": value, "unit": role.unit()}));
    let record = |(path, sha256): &(String, Option<String>)| json!({"path": path, "sha256": sha256});
    let document = json!({
        "format": "motorfit-machine",
        "format_version": VERSION,
        "motorfit": env!("CARGO_PKG_VERSION"),
        "title": of.title,
        "trust": of.trust,
        "parameters": of.parameters.iter().map(parameter).collect::<Map<String, Value>>(),
        "roles": of.roles.iter().map(role).collect::<Map<String, Value>>(),
        "not_in_roles": of.not_held,
        "voltage_V": of.voltage,
        "period_s": of.period_s,
        "records": of.records.iter().map(record).collect::<Vec<_>>(),
    });
    serde_json::to_string_pretty(&document).unwrap_or_default() + "\n"
}
