//! Inspection of recordings: facts about the signals, as a JSON document and as a page.

#[cfg(feature = "pages")]
mod page;

#[cfg(feature = "pages")]
pub(crate) use page::name;
#[cfg(feature = "pages")]
pub use page::{inspect_page, record_figure};

use super::document::{by_symbol, warnings};
use super::spelling::command_line;
use motorfit_core::numeric::{mean, noise_sigma, rms, standard_deviation};
use motorfit_identify::{Identifiability, Inspection};
use motorfit_motor::response;
use motorfit_record::{Quantity, Record, Severity};
use serde::Serialize;
use serde_json::{Map, Value, json as value};

/// Statistics of a signal, in its unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SignalStatistics {
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Arithmetic mean.
    pub mean: f64,
    /// Root mean square.
    pub rms: f64,
    /// Population standard deviation.
    pub std: f64,
    /// Estimated standard deviation of the white noise.
    pub noise_sigma: f64,
}

impl SignalStatistics {
    /// Computes the statistics of a signal.
    #[must_use]
    pub fn of(signal: &[f64]) -> Self {
        Self {
            min: signal.iter().copied().fold(f64::INFINITY, f64::min),
            max: signal.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            mean: mean(signal),
            rms: rms(signal),
            std: standard_deviation(signal),
            noise_sigma: noise_sigma(signal),
        }
    }
}

/// Facts about one signal of a recording, in the SI unit of its quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalFacts {
    /// Quantity of the signal.
    pub quantity: Quantity,
    /// Statistics of the signal.
    pub statistics: SignalStatistics,
    /// Peak, settling and steady state of an output; `None` for inputs.
    pub response: Option<motorfit_motor::StepResponse>,
    /// True if three standard deviations of the noise exceed the settling band, so that there is no settling time.
    pub settling_hidden: bool,
}

impl SignalFacts {
    /// Computes the facts of all signals; `band` is the settling band as a fraction of the steady state.
    #[must_use]
    pub fn of(record: &Record, band: f64) -> Vec<Self> {
        let facts = |(quantity, signal): (Quantity, &[f64])| {
            let output = matches!(quantity, Quantity::Current | Quantity::Speed) && quantity != record.driver();
            let mut response = if output { response(&record.samples().time_s, signal, band) } else { None };
            let statistics = SignalStatistics::of(signal);
            let settling_hidden = response.is_some_and(|r| 3.0 * statistics.noise_sigma > band * r.steady_state.abs());
            if let (Some(response), true) = (&mut response, settling_hidden) {
                response.settling_time_s = None;
            }
            Self { quantity, statistics, response, settling_hidden }
        };
        signals(record).map(facts).collect()
    }
}

/// Returns the signals of a recording.
fn signals(record: &Record) -> impl Iterator<Item = (Quantity, &[f64])> {
    let samples = record.samples();
    let all = [
        (Quantity::Voltage, Some(&samples.voltage).filter(|voltage| !voltage.is_empty())),
        (Quantity::Torque, samples.torque.as_ref()),
        (Quantity::Current, samples.current.as_ref()),
        (Quantity::Speed, samples.speed.as_ref()),
    ];
    all.into_iter().filter_map(|(quantity, signal)| Some((quantity, signal?.as_slice())))
}

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
