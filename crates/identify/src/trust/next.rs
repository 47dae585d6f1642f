//! The next step after a result of the DC motor that is not good: the setting with the largest expected gain that is not in use yet, or, where no
//! setting helps, what to record.

use crate::result::Identification;
use crate::spec::IdentifySpec;
use crate::trust_level::{Trust, TrustReason};
use motorfit_core::setting::{Reference, Setting, Text, text};
use motorfit_motor::{Discretization, Input, Parameter, With};
use motorfit_record::{AssumedUnits, Record};

/// Reasons for which a larger model may be the remedy.
const LACKS: [&str; 6] =
    ["poor_fit", "recording_missed", "residuals", "averaged_sensor", "model_incomplete", "late_voltage"];

/// Advice on what to record, or to look at, where no setting removes a reason.
const ADVICE: [(&str, &str); 21] = [
    ("poor_fit", "Check the signals; a machine that is not this motor can be described by a model of its own."),
    ("recording_missed", "Leave the recording out, or check its signals."),
    ("search_stuck", "Record several levels of the input in both directions, with pauses."),
    ("recordings_differ", "Fit the recordings one by one."),
    ("friction_differs", "Fit the recordings one by one, or record them at the same temperature."),
    (
        "not_separated",
        "Record several levels of the input in both directions, with pauses: they tell friction, load and offsets apart.",
    ),
    ("search_inconclusive", "Record several levels of the input in both directions, with pauses."),
    ("late_voltage", "Log the voltage at the same instant as the outputs."),
    ("averaged_sensor", "Log the sensor without its filter."),
    (
        "model_incomplete",
        "Record several levels of the input in both directions, with pauses, or describe the effect by a model of its own.",
    ),
    (
        "residuals",
        "Record faster, with the sensors unfiltered, or describe the effect that is missing by a model of its own.",
    ),
    ("few_samples", "Record longer, or faster."),
    ("implausible", "Check the units of the columns."),
    ("units", "Check the units of the columns."),
    ("units_disagree", "Check the units of speed and position."),
    ("sign_reversed", "Check the signs of the columns."),
    ("input_noise", "Record the commanded voltage, or measure it with less noise."),
    ("speed_falls", "Drive the motor all the time: a bridge that is off does not hold the voltage."),
    ("validation", "Fit the held-out recordings too; check whether the motor, its load or its supply changed."),
    ("dead_time_long", "Begin the recording when the drive acts, on one clock."),
    ("not_converged", "Fix parameters that the recordings hardly show."),
];

/// Returns the next step for the reasons against a result, the most severe first.
pub(super) fn next_step(records: &[Record], (spec, found): (&IdentifySpec, &Identification), trust: &Trust) -> Text {
    let reasons = &trust.reasons[..];
    let has = |codes: &[&str]| reasons.iter().any(|reason| codes.contains(&reason.code));
    if has(&["between_samples"]) && found.input == Input::Voltage {
        let better = if found.model.discretization == Discretization::Foh { "zoh" } else { "foh" };
        return text!([Discretization = "{better}"]);
    }
    if let Some(step) = of_findings(records, found, reasons) {
        return step;
    }
    if has(&LACKS) && spec.with != With::Auto {
        return text!([With = "auto"]);
    }
    if let Some(assumed) = records.iter().find_map(AssumedUnits::of_motor) {
        return assumed.step();
    }
    if has(&["at_bound"]) && Parameter::ALL.iter().any(|p| !spec.auto_bounds.contains(p)) {
        return text!([Bounds = "auto"]);
    }
    if has(&["search_stuck", "search_inconclusive", "not_verified"]) && spec.method.is_search() {
        return text!([Method = "auto"]);
    }
    if has(&["not_verified", "not_polished"]) && !spec.is_polished() {
        return text!([Polish = "lm"]);
    }
    reasons
        .iter()
        .find_map(|reason| advice(found, trust, reason.code))
        .unwrap_or_else(|| "Record longer, or faster.".into())
}

/// Returns the first setting that a finding about a recording names as its remedy. The extensions are those of a selection among all.
fn of_findings(records: &[Record], found: &Identification, reasons: &[TrustReason]) -> Option<Text> {
    let remedies = reasons.iter().flat_map(|reason| found.warnings.iter().filter(|of| of.code == reason.code));
    // Samples that are excluded already are not to be excluded again.
    let is_masked = records.iter().any(|record| !record.excluded().is_empty());
    let is_own = |reference: &&Reference| match reference {
        Reference::Setting(Setting::Mask, _) => !is_masked,
        Reference::Setting(setting, _) => ![Setting::With, Setting::Initial].contains(setting),
        Reference::Command(_) => false,
    };
    let mut steps = remedies.filter_map(|warning| warning.remedy.as_ref()?.steps().find(is_own).cloned());
    steps.next().map(Text::from)
}

/// Returns what to do about a reason without a setting of its own.
fn advice(found: &Identification, trust: &Trust, code: &str) -> Option<Text> {
    match code {
        "not_identifiable" => Some(match (&trust.open[..], &trust.needs) {
            (_, Some(needs)) => format!("Record {needs}.").into(),
            ([only], None) if only == "L" => {
                text!("Record faster, with several samples in L/R, or fix it: " [Fix = "L=VALUE"] ".")
            }
            (_, None) => "Record steps up and down, in both directions, several samples in each time constant.".into(),
        }),
        "at_bound" => {
            let at = found.estimates.iter().find(|e| e.at_bound.is_some())?;
            Some(text!("Widen its bounds, as " [Bounds = "{}=MIN:MAX", at.name] ", if other values are plausible."))
        }
        _ => {
            let known = ADVICE.iter().find(|(known, _)| *known == code).map(|(_, advice)| Text::from(*advice));
            known.or_else(|| found.warnings.iter().find(|warning| warning.code == code)?.remedy.clone())
        }
    }
}
