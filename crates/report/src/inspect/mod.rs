//! Inspection of recordings: facts about the signals, as a JSON document and as a page.

pub(crate) mod facts;
#[cfg(feature = "pages")]
mod page;

pub use facts::{SignalFacts, SignalStatistics};
#[cfg(feature = "pages")]
pub(crate) use page::name;
#[cfg(feature = "pages")]
pub use page::{inspect_page, record_figure};

use super::document::{by_symbol, warnings};
use super::spelling::command_line;
use motorfit_identify::{Identifiability, Inspection};
use motorfit_record::Severity;
use serde_json::{Map, Value, json as value};

/// Returns the JSON document of inspections; `band` is the settling band as a fraction of the steady state.
#[must_use]
pub fn inspect_document(inspections: &[Inspection<'_>], band: f64) -> Value {
    value!({
        "motorfit": env!("CARGO_PKG_VERSION"),
        "records": inspections.iter().map(|inspection| record_document(inspection, band)).collect::<Value>(),
    })
}

fn record_document(inspection: &Inspection<'_>, band: f64) -> Value {
    let record = inspection.record;
    let mut document = value!(record);
    let signals = SignalFacts::of(record, band).into_iter().map(|s| {
        let response = s.response.map(|r| {
            value!({
                "peak": r.peak, "peak_time_s": r.peak_time_s, "overshoot_percent": r.overshoot_percent,
                "settling_time_s": r.settling_time_s, "settling_band": band, "steady_state": r.steady_state,
            })
        });
        let of = s.statistics;
        let facts = value!({
            "unit": s.quantity.unit(), "min": of.min, "max": of.max, "mean": of.mean, "rms": of.rms, "std": of.std,
            "noise_sigma": of.noise_sigma, "response": response,
        });
        (s.quantity.to_string().replace(' ', "_"), facts)
    });
    document["jitter"] = record.steps().jitter.into();
    document["duration_s"] = (record.samples().time_s[record.len() - 1] - record.samples().time_s[0]).into();
    document["ignored_columns"] = record.source().ignored.clone().into();
    document["signals"] = signals.collect::<Map<_, _>>().into();
    document["identifiability"] = match &inspection.identifiability {
        Identifiability::Identifies { relative_error } => {
            let errors = by_symbol(*relative_error);
            value!({"identifies": true, "relative_std_error": errors, "message": null, "remedy": null})
        }
        Identifiability::Lacks { message, remedy } => {
            let (message, remedy) = (message.spelled(command_line), remedy.spelled(command_line));
            value!({"identifies": false, "relative_std_error": null, "message": message, "remedy": remedy})
        }
    };
    document["warnings"] = warnings(&inspection.warnings, Severity::Report);
    document["remarks"] = warnings(&inspection.warnings, Severity::Mention);
    document
}
