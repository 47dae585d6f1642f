//! Sweeps.
#![allow(missing_docs)]
use crate::report::{Page, Reproduced, Table};
use crate::study::sweep::{Limits, SweepSummary};
pub struct SweepDocument;
impl SweepDocument {
    #[must_use]
    pub fn of(s: &SweepSummary, _: &Limits) -> serde_json::Value {
        serde_json::json!({"runs": s.runs, "missing": s.missing, "failed": s.failed})
    }
}
#[must_use]
pub fn sweep_tables(_: &SweepSummary, _: &Limits) -> Vec<Table> {
    Vec::new()
}
#[must_use]
pub fn shortened(t: &Table, _: usize) -> Table {
    t.clone()
}
#[must_use]
pub fn sweep_page(_: &SweepSummary, _: &Limits, _: &Reproduced) -> Page {
    Page { title: String::new(), answer: String::new(), sections: Vec::new() }
}
pub fn write_parquet(_: &std::path::Path, _: &std::path::Path) -> crate::Result<()> {
    Ok(())
}
