//! What the reader of a result should know.

use super::IdentifySpec;
use crate::evaluate::Initial;
use crate::motor::Parameter;
use crate::record::Record;
use crate::text::significant;

/// Something that the reader of a result should know.
#[derive(Debug, Clone, PartialEq)]
pub struct Warning {
    /// A short name that does not change.
    pub code: &'static str,
    /// In words.
    pub message: String,
}

/// A fit below this is none.
const POOR_FIT_PERCENT: f64 = 50.0;

pub(super) fn poor_fit(fit_percent: [Option<f64>; 2]) -> Option<Warning> {
    let poor = |(name, fit): (&str, Option<f64>)| {
        fit.filter(|fit| *fit < POOR_FIT_PERCENT).map(|fit| format!("{name} {} %", significant(fit, 3)))
    };
    let list: Vec<String> = ["current", "speed"].into_iter().zip(fit_percent).filter_map(poor).collect();
    (!list.is_empty()).then(|| Warning {
        code: "poor_fit",
        message: format!(
            "the model does not fit ({}): do not use these parameters; check columns, units and signs, and --bounds",
            list.join(", ")
        ),
    })
}

pub(super) fn warnings_of(records: &[Record], spec: &IdentifySpec) -> Vec<Warning> {
    let mut warnings = Vec::new();
    for record in records {
        let name =
            record.source().path.as_ref().map_or_else(|| "the recording".to_owned(), |p| p.display().to_string());
        warnings.extend(
            record_warnings(record)
                .into_iter()
                .map(|Warning { code, message }| Warning { code, message: format!("{name}: {message}") }),
        );
    }
    warnings.extend(missing_channel(records, spec));
    if spec.model.initial == Initial::Zero && records.iter().flat_map(Record::measured).flatten().any(moves_at_start) {
        warnings.push(Warning {
            code: "initial_state",
            message: "a recording does not start at rest, but --initial zero says so; use --initial measured"
                .to_owned(),
        });
    }
    warnings
}

fn missing_channel(records: &[Record], spec: &IdentifySpec) -> Option<Warning> {
    let free = spec.space.free();
    let is_free = |parameter| free.iter().any(|axis| axis.parameter == parameter);
    let missing = |channel: usize| records.iter().all(|r| r.measured()[channel].is_none());
    let message = if missing(0) && free.len() > 3 {
        format!(
            "no current: speed alone fixes three combinations of the {} free parameters; record the current, or hold \
             two with --fix, R and K for example",
            free.len()
        )
    } else if missing(1) && [Parameter::K, Parameter::B, Parameter::J].into_iter().all(is_free) {
        "no speed: current alone leaves K, B and J free along K : B : J = 1 : 2 : 2; record the speed or hold K with \
         --fix"
            .to_owned()
    } else {
        return None;
    };
    Some(Warning { code: "channel_missing", message })
}

fn moves_at_start(signal: &[f64]) -> bool {
    signal[0].abs() > 0.05 * signal.iter().fold(0.0, |peak: f64, v| peak.max(v.abs()))
}

/// A period from which on it is doubted \[s\]: a motor moves faster, and a logger in milliseconds is common.
const PERIOD_DOUBTED_S: f64 = 0.02;

/// What is suspicious about a recording, whatever it is used for.
#[must_use]
pub fn record_warnings(record: &Record) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let mut warn = |code, message| warnings.push(Warning { code, message });
    let (period, jitter) = (record.period_s(), record.steps().jitter);
    if period >= PERIOD_DOUBTED_S {
        warn(
            "period_unit",
            format!(
                "{period} s between samples is long for a motor; if the times are milliseconds, name the unit: \
                 --columns time=HEADING:ms"
            ),
        );
    }
    if jitter > crate::record::TIME_JITTER_UNIFORM && !record.steps().step_index.is_empty() {
        let percent = significant(100.0 * jitter, 2);
        warn(
            "jitter",
            format!("steps between samples deviate by up to {percent} % from the period; each is simulated as it is"),
        );
    }
    let voltage = &record.samples().voltage;
    if voltage.iter().all(|v| v.to_bits() == voltage[0].to_bits()) && voltage[0] != 0.0 {
        warn(
            "constant_voltage",
            format!("the voltage is {} V throughout; fine if the motor starts from rest in this recording", voltage[0]),
        );
    }
    let assumed: Vec<String> = (record.source().columns.iter().filter(|c| !c.unit_named))
        .map(|c| format!("{} in {}", c.heading, c.unit))
        .collect();
    if !assumed.is_empty() {
        warn("unit_assumed", format!("no unit is named, taken to be {}; name it with --columns", assumed.join(", ")));
    }
    if record.source().last_line_open {
        warn("no_line_end", "the file ends without a line end: its last number may be cut off".to_owned());
    }
    warnings
}
