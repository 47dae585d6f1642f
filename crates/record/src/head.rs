//! Serialization of a recording in results: origin, columns and notes on its preparation, without the samples.

use super::record::Record;
use serde::{Serialize, Serializer};
use serde_json::json;

impl Serialize for Record {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let source = self.source();
        let head = json!({
            "path": source.path.as_ref().map(|path| path.to_string_lossy()),
            "part": source.part,
            "sha256": source.sha256,
            "samples": self.len(),
            "period_s": self.period_s(),
            "columns": source.columns,
            "notes": source.notes,
        });
        head.serialize(serializer)
    }
}
