//! A recording as results name it: where it is from, what its columns mean, and how it was prepared. The samples are not
//! part of it.

use super::Record;
use serde::{Serialize, Serializer};
use serde_json::{Value, json};

impl Serialize for Record {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let source = self.source();
        let column = |c: &super::Column| {
            json!({"quantity": c.quantity.to_string(), "heading": c.heading, "conversion": c.conversion,
                "unit": c.unit, "unit_named": c.unit_named})
        };
        let head = json!({
            "path": source.path.as_ref().map(|path| path.to_string_lossy()),
            "part": source.part,
            "sha256": source.sha256,
            "samples": self.len(),
            "period_s": self.period_s(),
            "columns": source.columns.iter().map(column).collect::<Value>(),
            "notes": source.notes,
        });
        head.serialize(serializer)
    }
}
