//! Horizontal box plots, one below the other, with legible names.

use super::histogram::decimals;
use super::{COLORS, Groups, grouped, nothing};
use crate::numeric::count;
use crate::report::traces::round_step;
use crate::text::significant;
use kuva::render::layout::{Layout, TickFormat};
use kuva::render::plots::Plot;
use std::sync::Arc;

/// Draws box plots (quartiles, Tukey's whiskers) of groups of values in rows, the first on top, on an axis over a
/// range. On a logarithmic axis, boxes and whiskers are those of the logarithms.
pub(in crate::report) fn box_rows(groups: Groups, label: &str, [low, high]: [f64; 2], is_log: bool) -> String {
    let shown = |value: &f64| value.is_finite() && (!is_log || *value > 0.0);
    let placed = |value: &f64| if is_log { value.log10() } else { *value };
    let of = |(name, values): (String, Vec<f64>)| (name, values.iter().filter(|v| shown(v)).map(placed).collect());
    // The plotting library counts rows from the bottom.
    let groups: Groups =
        groups.into_iter().map(of).filter(|(_, values): &(_, Vec<f64>)| !values.is_empty()).rev().collect();
    if groups.is_empty() {
        return nothing("");
    }
    let names: Vec<String> = groups.iter().map(|(name, _)| name.clone()).collect();
    let plots = vec![Plot::Box(grouped(groups).with_color(COLORS[1]).with_width(0.6).with_horizontal(true))];
    let margin = 0.03 * (placed(&high) - placed(&low));
    let mut layout = Layout::auto_from_plots(&plots)
        .with_x_label(label)
        .with_y_categories(names.clone())
        .with_x_axis_min(placed(&low) - margin)
        .with_x_axis_max(placed(&high) + margin)
        .with_width(1000.0);
    if is_log {
        let power = |v: f64| {
            let digits = if (v - v.round()).abs() < 1e-9 { 1 } else { 2 };
            significant(10.0_f64.powf(v), digits)
        };
        layout = layout.with_x_tick_format(TickFormat::Custom(Arc::new(power)));
        // Ticks are at decades if the range has at least two.
        let decades = placed(&high) - placed(&low);
        if decades >= 2.0 {
            layout = layout.with_x_tick_step((decades / 6.0).ceil());
        }
    } else {
        let step = round_step((high - low).max(1e-9 * high.abs()).max(f64::MIN_POSITIVE) / 6.0);
        layout = layout.with_x_tick_step(step).with_x_tick_format(decimals(step));
    }
    let height = 110.0 + 34.0 * count(names.len().max(2));
    super::svg(plots, layout.with_height(height))
}
