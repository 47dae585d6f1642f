//! Residuals of several fits below each other, so that their patterns can be compared.

use super::page::Figure;
use super::plot::{Chart, Line, panels};
use crate::record::{Quantity, Record};

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

/// Size of a panel \[pixels\].
const PANEL: [f64; 2] = [560.0, 230.0];
const CHANNELS: [(Quantity, &str, &str); 2] =
    [(Quantity::Current, "current", "residual [A]"), (Quantity::Speed, "speed", "residual [rad/s]")];

/// Draws the residuals (measured minus simulated) of current and speed over time, one row per fit. Channels that were not
/// recorded are left out.
#[must_use]
pub fn residual_panels(id: &str, rows: &[ResidualRow<'_>]) -> Figure {
    let panel = |n: usize, channel: usize| {
        let ResidualRow { name, record, signals } = &rows[n];
        let (quantity, title, label) = CHANNELS[channel];
        let measured = record.measured()[channel].filter(|_| record.driver() != quantity).unwrap_or_default();
        let residuals = measured.iter().zip(&signals[channel]).map(|(a, b)| a - b);
        let points = record.samples().time_s.iter().copied().zip(residuals).collect();
        let line = Line { points, ..Line::default() };
        let time = if n + 1 == rows.len() { "time [s]" } else { "" };
        Chart { lines: vec![line], ..Chart::new(format!("{name}: {title}"), [time, label]) }
    };
    let charts: Vec<Chart> = (0..rows.len()).flat_map(|n| [panel(n, 0), panel(n, 1)]).collect();
    Figure {
        id: id.to_owned(),
        map: false,
        svg: panels(&charts, 2, PANEL),
        alternative: "Residuals of current and speed over time, one row per fit".to_owned(),
        caption: "Measured minus simulated current and speed.".to_owned(),
    }
}
