//! Curves as CSV.

use motorfit_core::text::Shortest;
use motorfit_identify::Identification;
use motorfit_record::{Quantity, Record};

/// Returns CSV with the measured and modelled signals of all recordings, one after the other.
#[must_use]
pub fn curves_csv(records: &[Record], found: &Identification) -> String {
    let mut columns = vec![Vec::new(); 7];
    let modelled = found.modelled(records).unwrap_or_default();
    for ((n, record), [current, speed]) in (1_u32..).zip(records).zip(modelled) {
        let samples = record.samples();
        let none = || vec![f64::NAN; record.len()];
        columns[0].extend(vec![f64::from(n); record.len()]);
        columns[1].extend(&samples.time_s);
        let voltage = if samples.voltage.is_empty() { none() } else { samples.voltage.clone() };
        columns[2].extend(voltage);
        columns[3].extend(samples.current.as_deref().map_or_else(none, |of| at_own(record, Quantity::Current, of)));
        columns[4].extend(current);
        columns[5].extend(samples.speed.as_deref().map_or_else(none, |of| at_own(record, Quantity::Speed, of)));
        columns[6].extend(speed);
    }
    let heads =
        ["recording", "time_s", "voltage_V", "current_A", "current_model_A", "speed_rad_s", "speed_model_rad_s"];
    columns_csv(&heads.map(str::to_owned), &columns)
}

/// Returns the values of an output at the samples at which it was measured, and NaN at those between.
#[must_use]
pub(super) fn at_own(record: &Record, quantity: Quantity, values: &[f64]) -> Vec<f64> {
    let of = |(n, value): (usize, &f64)| if record.is_measured(quantity, n) { *value } else { f64::NAN };
    values.iter().enumerate().map(of).collect()
}

/// Returns CSV text: a heading, then rows of numbers. A cell without a finite number is empty.
#[must_use]
pub fn columns_csv(heads: &[String], columns: &[Vec<f64>]) -> String {
    let mut text = heads.join(",") + "\n";
    for row in 0..columns.iter().map(Vec::len).max().unwrap_or(0) {
        for (n, column) in columns.iter().enumerate() {
            let comma = if n == 0 { "" } else { "," };
            let value =
                column.get(row).filter(|v| v.is_finite()).map_or_else(String::new, |v| Shortest(*v).to_string());
            text.extend([comma, &value]);
        }
        text.push('\n');
    }
    text
}
