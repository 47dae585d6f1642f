//! Curves as CSV.

use super::recorded::{Recorded, RecordedInput, at_own};
use motorfit_core::text::Shortest;
use motorfit_identify::Identification;
use motorfit_identify::model::ModelIdentification;
use motorfit_record::Record;

/// Headings and columns.
type Columns = (Vec<String>, Vec<Vec<f64>>);

/// Returns the columns of measured and modelled current and speed.
pub(super) fn motor_curves(records: &[Record], found: &Identification) -> Columns {
    let mut columns = vec![Vec::new(); 7];
    let modelled = found.modelled(records).unwrap_or_default();
    for ((n, record), [current, speed]) in (1_u32..).zip(records).zip(modelled) {
        let samples = record.samples();
        let none = || vec![f64::NAN; record.len()];
        columns[0].extend(vec![f64::from(n); record.len()]);
        columns[1].extend(&samples.time_s);
        let voltage = if samples.voltage.is_empty() { none() } else { samples.voltage.clone() };
        columns[2].extend(voltage);
        columns[3].extend(samples.current.as_deref().map_or_else(none, |of| at_own(record, 0, of)));
        columns[4].extend(current);
        columns[5].extend(samples.speed.as_deref().map_or_else(none, |of| at_own(record, 1, of)));
        columns[6].extend(speed);
    }
    let heads =
        ["recording", "time_s", "voltage_V", "current_A", "current_model_A", "speed_rad_s", "speed_model_rad_s"];
    (heads.map(str::to_owned).to_vec(), columns)
}

/// Returns the columns of the inputs, and of measured and modelled outputs, of a model.
pub(super) fn model_curves(recorded: &[Recorded], found: &ModelIdentification) -> Columns {
    let heading = |of: &RecordedInput| of.label.replace('·', "*");
    let inputs: Vec<String> = recorded.first().iter().flat_map(|of| &of.inputs).map(heading).collect();
    let mut heads: Vec<String> = ["recording", "time_s"].map(str::to_owned).into_iter().chain(inputs).collect();
    let first = heads.len();
    for output in &found.outputs {
        heads.push(format!("{} [{}]", output.name, output.unit));
        heads.push(format!("{} model [{}]", output.name, output.unit));
    }
    let mut columns = vec![Vec::new(); heads.len()];
    for ((n, recorded), fit) in (1_u32..).zip(recorded).zip(&found.fits) {
        let samples = recorded.time_s.len();
        columns[0].extend(vec![f64::from(n); samples]);
        columns[1].extend(&recorded.time_s);
        for (column, input) in columns[2..first].iter_mut().zip(&recorded.inputs) {
            column.extend(&input.values);
        }
        for (output, simulated) in recorded.outputs.iter().zip(&fit.simulated) {
            let none = || vec![f64::NAN; samples];
            columns[first + 2 * output.number].extend(output.measured.clone().unwrap_or_else(none));
            columns[first + 2 * output.number + 1].extend(simulated);
        }
    }
    (heads, columns)
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
