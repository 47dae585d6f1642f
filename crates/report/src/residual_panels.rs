//! Residuals of several fits below each other, so that their patterns can be compared.

use super::chart::{Chart, Form, Panel, Series};
use motorfit_record::{Quantity, Record};

/// The residuals of one fit: a row of a figure.
#[derive(Debug, Clone, Copy)]
pub struct ResidualRow<'a> {
    /// Title of the row.
    pub name: &'a str,
    /// Recording that was fitted.
    pub record: &'a Record,
    /// Simulated current \[A\] and speed \[rad/s\], one value per sample.
    pub signals: &'a [Vec<f64>; 2],
}

const CHANNELS: [(Quantity, &str, &str); 2] =
    [(Quantity::Current, "current", "A"), (Quantity::Speed, "speed", "rad/s")];

/// Returns the chart of the residuals (measured minus simulated) of current and speed over time, one row per fit. Channels that were
/// not recorded are left out.
#[must_use]
pub fn residual_panels(id: &str, rows: &[ResidualRow<'_>]) -> Chart {
    let panel = |n: usize, channel: usize| {
        let ResidualRow { name, record, signals } = &rows[n];
        let (quantity, title, unit) = CHANNELS[channel];
        let measured = record.measured()[channel].filter(|_| record.driver() != quantity).unwrap_or_default();
        let residuals = measured.iter().zip(&signals[channel]).map(|(a, b)| a - b);
        let points = record.samples().time_s.iter().copied().zip(residuals).collect();
        Panel::new(&format!("{name}: {title} [{unit}]"), vec![Series::new("", 1, Form::Line, points)])
    };
    Chart {
        id: id.to_owned(),
        axis: "time [s]".to_owned(),
        panels: (0..rows.len()).flat_map(|n| [panel(n, 0), panel(n, 1)]).collect(),
        is_grid: true,
        alternative: "residuals over time".to_owned(),
        caption: "Measured minus simulated current and speed.".to_owned(),
    }
}
