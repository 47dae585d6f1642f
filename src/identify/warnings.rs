//! What the reader of a result should know.

use super::spec::{Identification, IdentifySpec};
use super::verify::Status;
use crate::estimate::{Estimate, SmFailure, Whiteness};
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

/// Below so many samples 95 % intervals cover 81 to 90 % (measured).
const SAMPLES_FEW: usize = 12;
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
        let name = name_of(record);
        warnings.extend(
            record_warnings(record)
                .into_iter()
                .map(|Warning { code, message }| Warning { code, message: format!("{name}: {message}") }),
        );
    }
    warnings.extend(sign_reversed(records));
    let samples: usize = records.iter().map(Record::len).sum();
    if samples < SAMPLES_FEW {
        let message = format!("{samples} samples: from fewer than {SAMPLES_FEW} the intervals come out too narrow");
        warnings.push(Warning { code: "few_samples", message });
    }
    warnings.extend(
        missing_channel(records, spec)
            .map(|(what, remedy)| Warning { code: "channel_missing", message: format!("{what}; {remedy}") }),
    );
    if spec.model.initial == Initial::Zero && records.iter().flat_map(Record::measured).flatten().any(moves_at_start) {
        warnings.push(Warning {
            code: "initial_state",
            message: "a recording does not start at rest, but --initial zero says so; use --initial free".to_owned(),
        });
    }
    warnings
}

fn name_of(record: &Record) -> String {
    record.source().path.as_ref().map_or_else(|| "the recording".to_owned(), |p| p.display().to_string())
}

/// What is said of a result.
pub(super) fn of_result(found: &Identification, estimate: &std::result::Result<Estimate, SmFailure>) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let mut warn = |code, message| warnings.push(Warning { code, message });
    if found.searched.is_fallback {
        let failure = estimate.as_ref().err().copied().unwrap_or(SmFailure::PoorFit);
        let message = format!("Steiglitz–McBride cannot serve: {}; a population search took over", failure.message());
        warn("sm_failed", message);
    }
    for parameter in Parameter::ALL {
        if let Some(side) = found.at_bound(parameter) {
            let symbol = parameter.symbol();
            warn(
                "at_bound",
                format!(
                    "{symbol} ended at its {side} bound; widen it with --bounds, or the others hold only if it is right"
                ),
            );
        }
    }
    warnings.extend(poor_fit(found.fit_percent));
    let mut warn = |code, message| warnings.push(Warning { code, message });
    if !found.converged {
        warn(
            "not_converged",
            "the refinement has not come to its end: the result may be near the optimum only".to_owned(),
        );
    }
    if let Some(uncertainty) = &found.uncertainty {
        let colored = |(name, white): (&str, &Option<Whiteness>)| {
            white.filter(|w| !w.is_white).map(|w| format!("{name} (from sample to sample {:.2})", w.lag1))
        };
        let list: Vec<String> =
            ["current", "speed"].into_iter().zip(&uncertainty.whiteness).filter_map(colored).collect();
        if !list.is_empty() {
            warn(
                "residuals_not_white",
                format!(
                    "the residuals are correlated, {}: the model misses something, or the sensors filter; the standard \
                     errors are then too small",
                    list.join(", ")
                ),
            );
        }
    }
    if found.verification.status == Status::SearchStuck {
        let times = significant(1.0 + found.verification.cost_gap.unwrap_or(f64::NAN), 3);
        let rescued = found.uncertainty.is_some() && found.verification.refined_agrees;
        let what = if rescued { "the refinement left it for a better one" } else { "a reference fits better" };
        warn(
            "search_stuck",
            format!(
                "the search ended in another optimum, whose weighted sum of squares is {times} times the best; {what}; \
                 use --method auto, more --generations or another --seed"
            ),
        );
    }
    warnings
}

/// What speed alone or current alone cannot give, and what to do.
pub(super) fn missing_channel(records: &[Record], spec: &IdentifySpec) -> Option<(String, String)> {
    let free = spec.space.free();
    let is_free = |parameter| free.iter().any(|axis| axis.parameter == parameter);
    let missing = |channel: usize| records.iter().all(|r| r.measured()[channel].is_none());
    if missing(0) && free.len() > 3 {
        let what = format!("no current: speed alone fixes three combinations of the {} free parameters", free.len());
        Some((what, "record the current, or hold two with --fix, R and K for example.".to_owned()))
    } else if missing(1) && [Parameter::K, Parameter::B, Parameter::J].into_iter().all(is_free) {
        let what = "no speed: current alone leaves K, B and J free along K : B : J = 1 : 2 : 2".to_owned();
        Some((what, "record the speed or hold K with --fix.".to_owned()))
    } else {
        None
    }
}

/// A channel whose sign is reversed: from rest, a motor without load takes energy in (Σ v i > 0), its torque
/// accelerates it (Σ i ω > 0), and so it turns as the voltage says (Σ v ω > 0).
pub(super) fn sign_reversed(records: &[Record]) -> Option<Warning> {
    let mut sums = [[0.0; 2]; 3];
    for record in records {
        let samples = record.samples();
        if samples.torque.as_ref().is_some_and(|t| t.iter().any(|t| *t != 0.0)) {
            return None;
        }
        let [current, speed] = record.measured();
        let voltage = Some(samples.voltage.as_slice());
        for (sum, (a, b)) in sums.iter_mut().zip([(voltage, current), (current, speed), (voltage, speed)]) {
            for (a, b) in a.unwrap_or_default().iter().zip(b.unwrap_or_default()) {
                sum[0] += a * b;
                sum[1] += (a * b).abs();
            }
        }
    }
    // Far from what noise or a moment of braking does.
    let [vi, iw, vw] = sums.map(|[sum, size]| if sum < -0.3 * size { -1 } else { i32::from(sum > 0.3 * size) });
    let reversed = match (vi, iw, vw) {
        (-1, -1, 1) | (-1, 0, 0) => "current",
        (1, -1, -1) | (0, 0, -1) => "speed",
        (-1, 1, -1) => "voltage",
        _ => return None,
    };
    let message = format!(
        "the sign of the {reversed} is reversed: it runs against what the other columns say; swap its sign in the file"
    );
    Some(Warning { code: "sign_reversed", message })
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
