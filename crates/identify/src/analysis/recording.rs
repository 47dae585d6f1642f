//! Warnings about recordings that do not depend on the model: findings of the diagnosis, units, constant inputs.

use motorfit_core::setting::{Text, text};
use motorfit_record::warning::{Location, Warning, name_of};
use motorfit_record::{AssumedUnits, PERIOD_DOUBTED_S, Quantity, Record, Severity, diagnose};

/// Returns the warnings about recordings, each with the name of its recording.
#[must_use]
pub fn warnings_of_records(records: &[Record]) -> Vec<Warning> {
    let named = |record: &Record| {
        let name = name_of(record);
        let place = move |warning: Warning| {
            let place = Location { recording: Some(name.clone()), ..warning.place.unwrap_or_default() };
            Warning { place: Some(place), ..warning }
        };
        record_warnings(record).into_iter().map(place).collect::<Vec<_>>()
    };
    records.iter().flat_map(named).collect()
}

/// Describes the columns that were not used; empty if all were.
pub(crate) fn unused_columns(records: &[Record]) -> Text {
    let unused: Vec<String> = records.iter().flat_map(|r| r.source().ignored.iter().cloned()).take(12).collect();
    match unused.len() {
        0 => Text::default(),
        _ => text!((" (columns not used: {}; name one with ", unused.join(", ")) [Columns] ")"),
    }
}

/// Returns the warnings about one recording, remarks last.
#[must_use]
pub fn record_warnings(record: &Record) -> Vec<Warning> {
    let visible = diagnose(record).into_iter().filter(|finding| finding.is_visible(record));
    let mut warnings: Vec<Warning> = visible.map(|finding| Warning::found(record, finding)).collect();
    let columns = &record.source().columns;
    let period = record.period_s();
    let unit_open = columns.iter().any(|c| c.quantity == Quantity::Time && !c.unit_named);
    if period >= PERIOD_DOUBTED_S && unit_open && !warnings.iter().any(|w| w.code == "units") {
        let message = text!(
            "{period} s between samples is long for a motor; if the times are in milliseconds, name the unit: "
                [Columns = "time=HEADING:ms"]
        );
        warnings.push(Warning::new("period_unit", message));
    }
    let (driver, input) = (record.driver(), record.input());
    if input.iter().all(|v| v.to_bits() == input[0].to_bits()) && input[0] != 0.0 {
        let (value, unit) = (input[0], driver.unit());
        let message =
            format!("the {driver} is {value} {unit} throughout; fine if the motor starts from rest in this recording");
        let code = if driver == Quantity::Current { "constant_current" } else { "constant_voltage" };
        warnings.push(Warning::new(code, message));
    }
    if let Some(assumed) = AssumedUnits::of_motor(record) {
        let remedy = Some(assumed.remedy());
        warnings.push(Warning { remedy, ..Warning::new("unit_assumed", assumed.message()) });
    }
    if record.source().last_line_open {
        let message = "the file ends without a line break: its last number may be truncated";
        warnings.push(Warning::new("no_line_end", message));
    }
    warnings.sort_by_key(|warning| warning.severity == Severity::Mention);
    warnings
}
