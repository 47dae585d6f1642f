//! The table of the signals of a recording.

use motorfit::report::SignalStatistics;
use motorfit::text::significant;

/// Returns a table of signals, each with its name, unit and statistics.
pub(super) fn signal_table(signals: impl Iterator<Item = (String, String, SignalStatistics)>) -> String {
    let mut table = comfy_table::Table::new();
    table.load_style(comfy_table::presets::NOTHING);
    table.set_header(["signal", "unit", "min", "max", "mean", "rms", "noise σ"]);
    for (name, unit, of) in signals {
        let [min, max, mean, rms] = [of.min, of.max, of.mean, of.rms].map(|value| significant(value, 4));
        table.add_row([name, unit, min, max, mean, rms, significant(of.noise_sigma, 2)]);
    }
    for column in table.column_iter_mut().skip(2) {
        column.set_cell_alignment(comfy_table::CellAlignment::Right);
    }
    format!("{table}\n")
}
